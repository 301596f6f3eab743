#include "innerspring/study/claims.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/study/judge.h"

namespace innerspring {

namespace {

std::string reading(LoadKind load) {
    return load == LoadKind::patch ? "force spread over the radius of influence"
                                   : "all of the force on one vertex";
}

std::string level_name(int levels) {
    return levels == 1 ? "one level" : fmt::format("{} levels", levels);
}

const RefinementMean& find(const RefinementStudy& study, LoadKind load, std::string_view scheme, int levels,
                           double group) {
    return *std::find_if(study.means.begin(), study.means.end(), [&](const RefinementMean& m) {
        return m.load == load && m.scheme == scheme && m.levels == levels && m.force_group == group;
    });
}

const ForceMean& find(const ForceStudy& study, LoadKind load, DensityClass density, Scheme scheme,
                      double group) {
    return *std::find_if(study.means.begin(), study.means.end(), [&](const ForceMean& m) {
        return m.load == load && m.density == density && m.scheme == scheme && m.force_group == group;
    });
}

/// "least to largest" of the numbers.
std::string range(const std::vector<Judged>& numbers) {
    const auto [low, high] = std::minmax_element(
        numbers.begin(), numbers.end(), [](const Judged& a, const Judged& b) { return a.number < b.number; });
    return fmt::format("{:.3g} to {:.3g}", low->number, high->number);
}

/// Figs. 6a and 6b: C deviates least.
Claim least_deviation(const Setting& s, const RefinementStudy& study, LoadKind load, bool mean) {
    const auto value = [mean](const RefinementMean& m) {
        return mean ? m.measured.mean_m : m.measured.std_m;
    };
    Claim c{
        fmt::format("{}_least_{}", mean ? "mean" : "std", to_string(load)), mean ? "Fig. 6a" : "Fig. 6b",
        fmt::format("After refinement, scheme C's motion deviates least from that before ({} over time); {}",
                    mean ? "mean" : "standard deviation", reading(load))};
    c.threshold = 1, c.unit = "C / least of A_total, A_node, B", c.study = "refinement";
    std::vector<Judged> numbers;
    for (int levels = 1; levels <= s.options.levels; ++levels)
        for (const double group : s.force_groups) {
            double others = INFINITY;
            for (const Variant& v : variants)
                if (v.scheme != Scheme::C)
                    others = std::min(others, value(find(study, load, v.name, levels, group)));
            numbers.push_back(
                {group, level_name(levels), value(find(study, load, "C", levels, group)) / others});
        }
    judge(c, numbers);
    c.measured = fmt::format("C's is {} times the least of the others'", range(numbers));
    return c;
}

/// C's displacement stays what it was, within 1 % a level, for F/(E R^2) <= 1e-2.
Claim ratio_kept(const Setting& s, const RefinementStudy& study, LoadKind load, int levels) {
    Claim c{fmt::format("ratio_{}_{}", to_string(load), levels), "section 4.1",
            fmt::format(
                "Re-estimated by scheme C, the body answers as before: displacement within {} % after {} of "
                "refinement, F/(ER²) ≤ 0.01; {}",
                levels, level_name(levels), reading(load))};
    c.threshold = levels, c.unit = "% from 1", c.study = "refinement";
    std::vector<Judged> numbers;
    double least = INFINITY, largest = 0, worst_least = INFINITY, worst_largest = 0;
    for (const double group : s.force_groups)
        if (group <= 1e-2) {
            const RefinementMean& m = find(study, load, "C", levels, group);
            numbers.push_back({group, "", 100 * std::abs(m.measured.ratio - 1)});
            least = std::min(least, m.measured.ratio), largest = std::max(largest, m.measured.ratio);
            worst_least = std::min(worst_least, m.ratio_least),
            worst_largest = std::max(worst_largest, m.ratio_largest);
        }
    judge(c, numbers);
    c.measured = fmt::format(
        "refined / coarse {:.4g} to {:.4g} in the mean over the vertices, {:.4g} to {:.4g} at single ones",
        least, largest, worst_least, worst_largest);
    return c;
}

/// The other side: springs that do not follow the mesh add up where it becomes denser.
Claim others_stiffen(const Setting& s, const RefinementStudy& study) {
    Claim c{"others_stiffen_patch", "section 4.1",
            fmt::format(
                "Regular springs (A, B) do not: displacement less than half after one level of refinement, "
                "F/(ER²) ≤ 0.01; {}",
                reading(LoadKind::patch))};
    c.threshold = 0.5, c.unit = "refined / coarse", c.study = "refinement";
    std::vector<Judged> numbers;
    for (const Variant& v : variants) {
        if (v.scheme == Scheme::C) continue;
        double least = INFINITY, largest = 0;
        for (const double group : s.force_groups)
            if (group <= 1e-2) {
                const double ratio = find(study, LoadKind::patch, v.name, 1, group).measured.ratio;
                numbers.push_back({group, std::string(v.name), ratio});
                least = std::min(least, ratio), largest = std::max(largest, ratio);
            }
        c.measured += fmt::format("{}{} {:.3g} to {:.3g}", c.measured.empty() ? "refined / coarse: " : ", ",
                                  v.name, least, largest);
    }
    judge(c, numbers);
    return c;
}

const GravityRow* find(const GravityStudy& study, std::string_view centre, Scheme scheme) {
    for (const GravityRow& row : study.rows)
        if (row.centre == centre && row.scheme == scheme) return &row;
    return nullptr;
}

std::string refusal(const GravityStudy& study, std::string_view centre) {
    for (const RefusedCentre& r : study.refused)
        if (r.centre == centre) return "refused: " + r.reason;
    return "";
}

/// About the centre given by name; C's number against the least of the others or a bound.
Claim gravity_claim(
    const GravityStudy& study, std::string id, std::string source, std::string claim,
    const std::string& centre, double threshold, std::string unit,
    const std::function<double(const GravityRow&, const GravityRow&, const GravityRow&)>& number,
    const std::function<std::string(const GravityRow&, const GravityRow&, const GravityRow&)>& words) {
    Claim c{std::move(id), std::move(source), fmt::format("{}; centre: {}", claim, centre)};
    c.threshold = threshold, c.unit = std::move(unit), c.study = "gravity";
    const GravityRow *A = find(study, centre, Scheme::A), *B = find(study, centre, Scheme::B),
                     *C = find(study, centre, Scheme::C);
    if (!C) {
        c.condition = refusal(study, centre);
        judge(c, {});
        return c;
    }
    judge(c, {{0, "", number(*A, *B, *C)}});
    c.measured = words(*A, *B, *C);
    return c;
}

/// Law 3, relative to the centroid: what the offset adds.
Claim offset_law(const GravityStudy& study) {
    Claim c{"offset_law", "law 3",
            "A centre off the centroid costs scheme C the volume (2Mg/3V(E + 3E_s/R)) g·(centroid - c), "
            "within 10 % "
            "(exact on a sphere)"};
    c.threshold = 10, c.unit = "% from the law", c.study = "gravity";
    const GravityRow* base = find(study, "centroid", Scheme::C);
    std::vector<Judged> numbers;
    for (const GravityRow& row : study.rows)
        if (base && row.scheme == Scheme::C && row.centre.starts_with("off_")) {
            const double added = row.volume_variation_percent.final - base->volume_variation_percent.final;
            numbers.push_back({0, row.centre, 100 * std::abs(added / row.law_percent - 1)});
            c.measured += fmt::format("{}{:.3g} R: {:+.4f} % (law {:+.4f} %)", c.measured.empty() ? "" : ", ",
                                      row.offset_share, added, row.law_percent);
        }
    if (!base) c.condition = refusal(study, "centroid");
    judge(c, numbers);
    return c;
}

/// Fig. 9: averaged over the surface, C loses least.
Claim loses_least(const Setting& s, const ForceStudy& study, LoadKind load) {
    Claim c{fmt::format("loses_least_{}", to_string(load)), "Fig. 9",
            fmt::format(
                "Scheme C's mean volume variation under a force is the least, averaged over the surface; {}",
                reading(load))};
    c.threshold = 1, c.unit = "C / least of A, B", c.study = "force";
    std::vector<Judged> numbers;
    for (const double group : s.force_groups) {
        const auto mean = [&](Scheme scheme) {
            return find(study, load, DensityClass::sampled, scheme, group).volume_variation_percent.mean;
        };
        numbers.push_back({group, "", mean(Scheme::C) / std::min(mean(Scheme::A), mean(Scheme::B))});
    }
    judge(c, numbers);
    c.measured = fmt::format("C's is {} times the least of A's and B's", range(numbers));
    return c;
}

/// C's merit: the loss does not depend on where the force acts.
Claim same_everywhere(const Setting& s, const ForceStudy& study, LoadKind load) {
    Claim c{
        fmt::format("same_everywhere_{}", to_string(load)), "Fig. 9, law 2",
        fmt::format(
            "Scheme C's loss does not depend on the place: its spread over the vertices is at most a fifth "
            "of A's and B's for F/(ER²) ≤ 0.001; {}",
            reading(load))};
    c.threshold = 0.2, c.unit = "C / least of A, B", c.study = "force";
    std::vector<Judged> numbers;
    for (const double group : s.force_groups)
        if (group <= 1e-3) {
            const auto std = [&](Scheme scheme) {
                const ForceMean& m = find(study, load, DensityClass::sampled, scheme, group);
                return m.final_std_percent;
            };
            numbers.push_back({group, "", std(Scheme::C) / std::min(std(Scheme::A), std(Scheme::B))});
            const auto relative = [&](Scheme scheme) {
                return 100 * std(scheme) /
                       std::abs(find(study, load, DensityClass::sampled, scheme, group)
                                    .volume_variation_percent.final);
            };
            c.measured = fmt::format(
                "standard deviation over the vertices at F/(ER²) = {:g}: A {:.3g} %, B {:.3g} %, C {:.3g} % "
                "of the loss",
                group, relative(Scheme::A), relative(Scheme::B), relative(Scheme::C));
        }
    judge(c, numbers);
    return c;
}

Claim force_law(const Setting& s, const ForceStudy& study, LoadKind load) {
    Claim c{fmt::format("force_law_{}", to_string(load)), "law 2",
            fmt::format("Scheme C loses 3F/(4πR²(E + 3E_s/R)) of its volume, within 5 % for F/(ER²) ≤ 0.001 "
                        "(exact on a sphere); {}",
                        reading(load))};
    c.threshold = 5, c.unit = "% from the law", c.study = "force";
    std::vector<Judged> numbers;
    for (const double group : s.force_groups)
        if (group <= 1e-3) {
            const ForceMean& m = find(study, load, DensityClass::sampled, Scheme::C, group);
            numbers.push_back(
                {group, "", 100 * std::abs(m.volume_variation_percent.final / m.law_percent - 1)});
            c.measured = fmt::format("{:+.4g} % at F/(ER²) = {:g} (law {:+.4g} %)",
                                     m.volume_variation_percent.final, group, m.law_percent);
        }
    judge(c, numbers);
    return c;
}

/// Where the mesh is dense the regular springs are too stiff, and lose less.
Claim dense_places(const Setting& s, const ForceStudy& study, LoadKind load) {
    Claim c{fmt::format("dense_places_{}", to_string(load)), "Fig. 9, ours",
            fmt::format("Where the mesh is dense A and B lose less than C; {}", reading(load))};
    c.threshold = 1, c.unit = "largest of A, B / C", c.study = "force";
    std::vector<Judged> numbers;
    for (const double group : s.force_groups) {
        const auto mean = [&](Scheme scheme) {
            return find(study, load, DensityClass::densest, scheme, group).volume_variation_percent.mean;
        };
        numbers.push_back({group, "", std::max(mean(Scheme::A), mean(Scheme::B)) / mean(Scheme::C)});
    }
    judge(c, numbers);
    c.measured =
        fmt::format("at the densest tenth, the larger of A's and B's is {} times C's", range(numbers));
    return c;
}

}  // namespace

std::vector<Claim> claims_of(const Setting& s, const RefinementStudy& study) {
    if (study.rows.empty()) {
        Claim c{"refinement", "section 4.1", "The body answers as before after refinement"};
        c.condition = "no place can be refined: " + s.refused.front().reason, c.study = "refinement";
        return {c};
    }
    std::vector<Claim> claims;
    for (const LoadKind load : load_kinds) {
        claims.push_back(least_deviation(s, study, load, true));
        claims.push_back(least_deviation(s, study, load, false));
        for (int levels = 1; levels <= s.options.levels; ++levels)
            claims.push_back(ratio_kept(s, study, load, levels));
        if (load == LoadKind::patch) claims.push_back(others_stiffen(s, study));
    }
    return claims;
}

std::vector<Claim> claims_of(const Setting& s, const GravityStudy& study) {
    using Row = const GravityRow&;
    const std::string own = gravity_centres(s).front().name;
    const auto largest = [](Row r) { return r.volume_variation_percent.max; };
    std::vector<Claim> claims;
    claims.push_back(gravity_claim(
        study, "distorts_less", "Fig. 7", "Under gravity scheme C distorts less than B", own, 1, "C / B",
        [](Row, Row B, Row C) { return C.displacement_std_m / B.displacement_std_m; },
        [](Row, Row B, Row C) {
            return fmt::format(
                "standard deviation of the displacement over the surface: B {:.3g} m, C {:.3g} m",
                B.displacement_std_m, C.displacement_std_m);
        }));
    std::vector<std::string> centres = {own};
    if (own != "centroid") centres.push_back("centroid");
    for (const std::string& centre : centres)
        claims.push_back(gravity_claim(
            study, centre == own ? "gravity_volume" : "gravity_volume_centroid", "Fig. 8",
            "Under gravity scheme C's volume changes by less than 0.03 %", centre, 0.03, "%",
            [&](Row, Row, Row C) { return largest(C); },
            [&](Row, Row, Row C) { return fmt::format("at most {:.3g} %", largest(C)); }));
    claims.push_back(gravity_claim(
        study, "gravity_least", "Fig. 8", "Under gravity scheme C's volume changes less than B's", own, 1,
        "C / B", [&](Row, Row B, Row C) { return largest(C) / largest(B); },
        [&](Row A, Row B, Row C) {
            return fmt::format("at most: A {:.3g} %, B {:.3g} %, C {:.3g} %", largest(A), largest(B),
                               largest(C));
        }));
    claims.push_back(gravity_claim(
        study, "vertex_mean_volume", "Fig. 8", "The same about the mean of the vertices", "vertex_mean", 0.03,
        "%", [&](Row, Row, Row C) { return largest(C); },
        [&](Row, Row, Row C) {
            return fmt::format(
                "at most {:.3g} %; the mean of the vertices is {:.3g} R off the centroid along gravity",
                largest(C), C.offset_share);
        }));
    claims.push_back(offset_law(study));
    return claims;
}

std::vector<Claim> claims_of(const Setting& s, const ForceStudy& study) {
    std::vector<Claim> claims;
    for (const LoadKind load : load_kinds) {
        claims.push_back(loses_least(s, study, load));
        claims.push_back(same_everywhere(s, study, load));
        claims.push_back(force_law(s, study, load));
        claims.push_back(dense_places(s, study, load));
    }
    return claims;
}

}  // namespace innerspring
