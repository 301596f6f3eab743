#pragma once
// Looking into a CheckReport.
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "innerspring/mesh/check.h"
#include "innerspring/mesh/error.h"

namespace innerspring::testing {

inline const std::vector<std::string> keys{
    "closed",     "manifold_edges", "manifold_vertices",  "oriented",    "inside_out", "components",
    "degenerate", "duplicate",      "self_intersections", "star_shaped", "size"};

inline const Finding& finding(const CheckReport& report, const std::string& what) {
    const auto found = std::ranges::find(report.findings, what, &Finding::what);
    if (found == report.findings.end()) throw std::out_of_range(what);
    return *found;
}

/// The keys of all findings that are not fine.
inline std::vector<std::string> faults(const CheckReport& report) {
    std::vector<std::string> bad;
    for (const Finding& f : report.findings)
        if (f.verdict != Verdict::fine) bad.push_back(f.what);
    return bad;
}

using Keys = std::vector<std::string>;

/// What holds for every report.
inline CheckReport checked(const SurfaceMesh& mesh, const CheckOptions& options = {}) {
    const CheckReport report = check(mesh, options);
    Verdict worst = Verdict::fine;
    Keys found;
    for (const Finding& f : report.findings) {
        found.push_back(f.what);
        worst = std::max(worst, f.verdict);
        EXPECT_EQ(f.verdict == Verdict::fine, f.advice.empty()) << f.what;
        EXPECT_EQ(f.verdict == Verdict::fine, f.first.empty()) << f.what;
        if (f.verdict == Verdict::fine) {
            EXPECT_EQ(f.count, 0u) << f.what;
        }
    }
    EXPECT_EQ(found, keys);
    EXPECT_EQ(report.verdict, worst);
    EXPECT_EQ(report.vertices, mesh.positions.size());
    EXPECT_EQ(report.triangles, mesh.triangles.size());
    return report;
}

inline std::string refusal(const SurfaceMesh& mesh) {
    try {
        require_usable(mesh);
    } catch (const InputError& e) {
        return e.what();
    }
    return "";
}

inline void expect_mentions(const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
}

}  // namespace innerspring::testing
