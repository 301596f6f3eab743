// The whole chain: files, threads, stopping and resuming, refusals.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "innerspring/mesh/error.h"
#include "study/small_study.h"
#include "support/sanitized.h"

namespace innerspring {
namespace {

using namespace support;
namespace fs = std::filesystem;

/// Every column of a table says its unit, or is a name, an index or a ratio of two equal units.
void expect_units(const std::string& header) {
    std::istringstream columns(header);
    for (std::string column; std::getline(columns, column, ',');) {
        bool known = false;
        for (const char* end :
             {"_m", "_n", "_s", "_percent", "ratio", "relative", "_group", "_over_law", "load", "scheme",
              "levels", "vertex", "density_class", "poisson", "deepest", "_share", "_pa"})
            known |= column.ends_with(end);
        EXPECT_TRUE(known) << column << " in " << header;
    }
}

void expect_same(const fs::path& a, const fs::path& b, std::initializer_list<const char*> files) {
    for (const char* file : files) {
        EXPECT_FALSE(content(a / file).empty()) << file;
        EXPECT_EQ(content(a / file), content(b / file)) << file;
    }
}

/// Of a refinement study.
void expect_keys_and_units(const fs::path& folder) {
    const nlohmann::json s = summary(folder);
    for (const char* key : {"version", "mesh", "centre", "material", "groups", "influence_m", "region_m",
                            "dt_s", "duration_s", "command", "claims", "rows", "means"})
        EXPECT_TRUE(s.contains(key)) << key;
    EXPECT_EQ(s["rows"].size(), 2u * 4 * std::size_t(small_study(StudyKind::all, "").options.vertices) * 4);
    EXPECT_EQ(s["means"].size(), 2u * 4 * 4);
    for (const char* key : {"load", "scheme", "levels", "vertex", "force_n", "force_group", "coarse_final_m",
                            "refined_final_m", "ratio", "mean_deviation_m", "std_deviation_m",
                            "mean_deviation_relative", "std_deviation_relative"}) {
        EXPECT_TRUE(s["rows"][0].contains(key)) << key;
        EXPECT_TRUE(std::string(key) == "vertex" || s["means"][0].contains(key)) << key;
    }
    for (const auto& claim : s["claims"])
        for (const char* key :
             {"id", "source", "claim", "measured", "verdict", "number", "threshold", "command"})
            EXPECT_TRUE(claim.contains(key)) << key;
    std::size_t tables = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() != ".csv") continue;
        const std::string text = content(entry.path());
        expect_units(text.substr(0, text.find('\n')));
        EXPECT_EQ(text.find("nan"), std::string::npos) << entry.path();
        ++tables;
    }
    EXPECT_GE(tables, 9u);
}

/// One test, as each is a process of its own and the whole studies serve it all.
TEST(Study, ThreadsStopsAndCasesOfOtherStudiesLeaveNoTrace) {
    const TemporaryFolder whole("study-whole"), parts("study-parts"), force("study-force");
    StudyRun run = small_study(StudyKind::refinement, whole.path);
    run.threads = 2;
    run_study(small_sphere(), run);
    expect_keys_and_units(whole.path);

    std::atomic<bool> stop{false};
    run.directory = parts.path;
    run.threads = 1;
    run.stop = &stop;
    run.progress = [&](const StudyProgress&) { stop = true; };  // as soon as there is something to tell
    const StudyResults stopped = run_study(small_sphere(), run);
    ASSERT_TRUE(stopped.stopped);
    EXPECT_FALSE(fs::exists(parts.path / "summary.json"));

    run.stop = nullptr;
    run.resume = true;
    const std::size_t kept = stopped.cases;
    std::size_t least = SIZE_MAX;
    run.progress = [&](const StudyProgress& p) { least = std::min(least, p.done); };
    const StudyResults resumed = run_study(small_sphere(), run);
    EXPECT_FALSE(resumed.stopped);
    EXPECT_GT(least, kept);
    EXPECT_GT(resumed.cases, kept);
    expect_same(whole.path, parts.path, {"summary.json", "refinement.csv", "refinement_series_patch.csv"});

    StudyRun other = run;
    other.options.vertices = 4;
    EXPECT_THROW(run_study(small_sphere(), other), InputError) << "another study's cases";
    Scene stiffer = small_sphere();
    stiffer.material.young = 20;
    EXPECT_THROW(run_study(stiffer, run), InputError) << "another material's cases";

    if (INNERSPRING_SANITIZED) return;  // the same ways again
    // The force study shares cases with the refinement, by one thread; beside it from nothing, by two.
    run.kind = StudyKind::force;
    run.progress = {};
    run_study(small_sphere(), run);
    run.directory = force.path;
    run.threads = 2;
    run.resume = false;
    run_study(small_sphere(), run);
    expect_same(force.path, parts.path, {"summary.json", "force.csv", "fig9_mean_patch.csv"});
}

TEST(Study, TheVolumeStudyTakesUpItsCasesToTheSameBytes) {
    const TemporaryFolder whole("volume-whole"), parts("volume-parts");
    StudyRun run = small_study(StudyKind::volume, whole.path, 2);
    run.options.poisson = {0, 0.5};
    run.threads = 2;
    EXPECT_EQ(run_study(small_sphere(), run).cases, 4u);

    // Half of them, as if stopped there, by one thread; then the others.
    run.directory = parts.path;
    run.threads = 1;
    run.options.poisson = {0};
    EXPECT_EQ(run_study(small_sphere(), run).cases, 2u);
    EXPECT_NE(content(whole.path / "summary.json"), content(parts.path / "summary.json"));
    run.options.poisson = {0, 0.5};
    run.resume = true;
    EXPECT_EQ(run_study(small_sphere(), run).cases, 4u);
    expect_same(whole.path, parts.path,
                {"summary.json", "volume.csv", "fig9_nu_final.csv", "fig9_nu_bulge.csv"});
    const std::string table = content(whole.path / "volume.csv");
    expect_units(table.substr(0, table.find('\n')));
    const nlohmann::json s = summary(whole.path);
    EXPECT_EQ(s["rows"].size(), 2u * 2 * 5);
    for (const char* key : {"poisson", "force_n", "force_group", "deepest", "indentation_share",
                            "final_percent", "pressure_pa"}) {
        EXPECT_TRUE(s["rows"][0].contains(key)) << key;
        EXPECT_TRUE(s["means"][0].contains(key)) << key;
    }
    run.options.poisson = {0.5, 0.3};
    EXPECT_THROW(run_study(small_sphere(), run), InputError);
}

TEST(Study, TheReportStandsByItself) {
    const TemporaryFolder folder("study-report");
    StudyRun run = small_study(StudyKind::gravity, folder.path);
    run.pictures = true;
    int painted = 0;
    run.paint = [&](Positions x, Triangles triangles, std::span<const double> values,
                    const PictureOptions& options, Positions frame) {
        ++painted;
        return draw(x, triangles, values, options, frame);
    };
    const StudyResults results = run_study(small_sphere(), run);
    EXPECT_EQ(painted, 2) << "schemes B and C, by whoever was asked to";
    const std::string html = content(folder.path / "report.html");
    EXPECT_NE(html.find("</html>"), std::string::npos);
    EXPECT_EQ(html.find("http"), std::string::npos);
    EXPECT_EQ(html.find("<script"), std::string::npos);
    EXPECT_EQ(html.find("src=\"fig"), std::string::npos);
    EXPECT_NE(html.find("data:image/png;base64,"), std::string::npos);
    for (const Claim& c : results.claims) EXPECT_NE(html.find(to_string(c.outcome)), std::string::npos);
    for (const Figure& f : figures_of(results.setting, *results.gravity)) {
        EXPECT_NE(html.find(f.name + ".csv"), std::string::npos) << f.name;
        EXPECT_TRUE(fs::exists(folder.path / (f.name + ".csv"))) << f.name;
        // Without gnuplot there is a note instead.
        const bool drawn =
            fs::exists(folder.path / (f.name + ".svg")) && fs::exists(folder.path / (f.name + ".png"));
        EXPECT_TRUE(drawn || !results.warnings.empty()) << f.name;
    }
    const nlohmann::json rows = summary(folder.path)["rows"];
    for (const char* key : {"scheme", "centre", "volume_variation_percent", "displacement_std_m"})
        EXPECT_TRUE(rows[0].contains(key)) << key;
}

TEST(Study, RefusedCentresAreReportedAndTheRestIsMeasured) {
    const TemporaryFolder folder("study-organ");
    Scene scene;
    scene.mesh = "organ:vertices=250";
    const StudyResults results = run_study(scene, small_study(StudyKind::gravity, folder.path));
    EXPECT_EQ(results.setting.body().centre.kind, CentreKind::local);
    EXPECT_FALSE(results.gravity->refused.empty());
    EXPECT_EQ(results.gravity->rows.front().centre, "local");
    const nlohmann::json s = summary(folder.path);
    EXPECT_NE(s["refused"][0]["reason"].get<std::string>().find("not positive"), std::string::npos);
    for (const Claim& c : results.claims)
        if (c.id == "gravity_volume_centroid") {
            EXPECT_EQ(c.outcome, Outcome::not_judged);
            EXPECT_NE(c.condition.find("refused"), std::string::npos);
        }
}

TEST(Study, WhatCannotBeStudiedIsRefused) {
    const TemporaryFolder folder("study-refused");
    StudyRun run = small_study(StudyKind::all, folder.path / "out");
    Scene nothing;
    nothing.mesh = "no-such-file.obj";
    EXPECT_THROW(run_study(nothing, run), InputError);
    run.options.forces = 1;
    EXPECT_THROW(run_study(small_sphere(), run), InputError);
    run.options.forces = 4, run.options.region_share = 0.1;
    EXPECT_THROW(run_study(small_sphere(), run), InputError);
    EXPECT_THROW(parse_study("refinment"), InputError);
    EXPECT_FALSE(fs::exists(folder.path / "out"));
}

}  // namespace
}  // namespace innerspring
