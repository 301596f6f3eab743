#include "innerspring/study/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/team.h"

namespace innerspring {

namespace {

// One colour a scheme in all figures; lines of a law are black and dashed.
constexpr int colour_of(Scheme scheme) {
    return scheme == Scheme::A ? 1 : scheme == Scheme::B ? 2 : 3;
}
constexpr int colour_of(const Variant& v) {
    return v.mean == MeanStiffness::kept ? 6 : colour_of(v.scheme);
}
constexpr int black = 7;

/// B lies on A in many figures; dashed, both can be seen.
constexpr int dash_of(Scheme scheme) {
    return scheme == Scheme::B ? 2 : 1;
}

const char* const group_label = "force F/(ER²)";

std::string_view reading(LoadKind load) {
    return load == LoadKind::patch ? "patch load" : "point load";
}

std::string level_name(int levels) {
    return levels == 1 ? "one level" : fmt::format("{} levels", levels);
}

/// A figure over the force: a curve for each variant, from the means.
Figure over_force(const Setting& s, const RefinementStudy& study, LoadKind load, int levels, std::string name,
                  std::string title, std::string y_label, std::string y_column,
                  double (*value)(const RefinementMean&)) {
    Figure f{fmt::format("{}_{}_{}", name, to_string(load), levels), "", "refinement", {}, "force_group", {}};
    f.plot.title = fmt::format("{}: {}, {}", title, reading(load), level_name(levels));
    f.plot.x_label = group_label, f.plot.y_label = std::move(y_label);
    f.plot.log_x = f.plot.log_y = true;
    for (const Variant& v : variants) {
        Curve curve{std::string(v.name), s.force_groups, {}, colour_of(v), dash_of(v.scheme)};
        for (const RefinementMean& m : study.means)
            if (m.load == load && m.levels == levels && m.scheme == v.name) curve.y.push_back(value(m));
        f.plot.curves.push_back(std::move(curve));
        f.y_columns.push_back(fmt::format("{}_{}", v.name, y_column));
    }
    return f;
}

/// Displacement over time at one vertex, before (dashed) and after one level of refinement.
Figure over_time(const Setting& s, const Responses& responses, LoadKind load) {
    double group = s.force_groups.front();
    for (const double g : s.force_groups)
        if (g <= 1e-2) group = g;
    const Index vertex = s.refinable.front();
    Figure f{fmt::format("fig6_time_{}", to_string(load)),
             fmt::format("Vertex {}, F/(ER²) = {:g}. Dashed: before; solid: after one level of refinement.",
                         vertex, group),
             "refinement",
             {},
             "time_s",
             {}};
    f.plot.title = fmt::format("Displacement over time: {}", reading(load));
    f.plot.x_label = "time [s]";
    f.plot.y_label =
        load == LoadKind::patch ? "kernel-weighted displacement [m]" : "displacement of the vertex [m]";
    std::vector<double> time;
    for (int n = 0; n <= s.sampling.samples; ++n) time.push_back(n * s.sampling.dt_s);
    for (const Scheme scheme : schemes) {
        f.plot.curves.push_back(
            {fmt::format("{} before", to_string(scheme)), time,
             measured(load, responses.at(case_key(load, to_string(scheme), 0, vertex, group))),
             colour_of(scheme), 2});
        f.y_columns.push_back(fmt::format("{}_coarse_m", to_string(scheme)));
    }
    for (const Variant& v : variants) {
        f.plot.curves.push_back({std::string(v.name), time,
                                 measured(load, responses.at(refined_key(v, load, 1, vertex, group))),
                                 colour_of(v), 1});
        f.y_columns.push_back(fmt::format("{}_refined_m", v.name));
    }
    return f;
}

}  // namespace

std::vector<Figure> figures_of(const Setting& s, const RefinementStudy& study, const Responses& responses) {
    std::vector<Figure> figures;
    if (study.rows.empty()) return figures;
    for (const LoadKind load : load_kinds) {
        const std::string what =
            load == LoadKind::patch ? "kernel-weighted displacement" : "vertex's displacement";
        for (int levels = 1; levels <= s.options.levels; ++levels) {
            figures.push_back(over_force(s, study, load, levels, "fig6a", "Mean deviation",
                                         "mean deviation [m]", "mean_deviation_m",
                                         [](const RefinementMean& m) { return m.measured.mean_m; }));
            figures.back().caption =
                fmt::format("Fig. 6a: mean over time of |before - after|, of the {}.", what);
        }
        for (int levels = 1; levels <= s.options.levels; ++levels) {
            figures.push_back(over_force(s, study, load, levels, "fig6b", "Standard deviation",
                                         "standard deviation [m]", "std_deviation_m",
                                         [](const RefinementMean& m) { return m.measured.std_m; }));
            figures.back().caption =
                fmt::format("Fig. 6b: standard deviation over time of before - after, of the {}.", what);
        }
        for (int levels = 1; levels <= s.options.levels; ++levels) {
            figures.push_back(over_force(s, study, load, levels, "fig6_ratio", "Refined / coarse",
                                         "displacement, refined / coarse", "ratio",
                                         [](const RefinementMean& m) { return m.measured.ratio; }));
            figures.back().caption =
                fmt::format("In equilibrium, the {}; mean over {} vertices. 1: nothing changed.", what,
                            s.refinable.size());
            Plot& plot = figures.back().plot;
            plot.log_y = false;
            plot.curves.push_back(
                {"unchanged", s.force_groups, std::vector<double>(s.force_groups.size(), 1.0), black, 2});
        }
    }
    for (const LoadKind load : load_kinds) figures.push_back(over_time(s, responses, load));
    return figures;
}

std::vector<Figure> figures_of(const Setting& s, const GravityStudy& study) {
    std::vector<Figure> figures;
    std::vector<double> time;
    for (int n = 0; n <= s.sampling.samples; ++n) time.push_back(n * s.sampling.dt_s);
    for (const NamedCentre& centre : gravity_centres(s)) {
        if (centre.name.starts_with("off_") && centre.name != "off_4_percent") continue;
        Figure f{"fig8_" + centre.name, "", "gravity", {}, "time_s", {}};
        f.caption = std::isnan(centre.offset_share) ? "Fig. 8; every vertex has a centre of its own."
                    : centre.offset_share == 0
                        ? "Fig. 8; the centre is the volume centroid."
                        : fmt::format("Fig. 8; the centre is {:.3g} R off the volume centroid along gravity.",
                                      centre.offset_share);
        f.plot.title = "Volume under gravity, centre: " + centre.name;
        std::replace(f.plot.title.begin(), f.plot.title.end(), '_', ' ');
        f.plot.x_label = "time [s]", f.plot.y_label = "volume variation [%]";
        for (const GravityRow& row : study.rows)
            if (row.centre == centre.name) {
                f.plot.curves.push_back({"scheme " + std::string(to_string(row.scheme)), time,
                                         row.volume_percent, colour_of(row.scheme)});
                f.y_columns.push_back(fmt::format("{}_volume_variation_percent", to_string(row.scheme)));
            }
        if (!f.plot.curves.empty()) figures.push_back(std::move(f));
    }
    Figure f{"fig8_offset",
             "How the final volume variation grows with the centre's distance from the volume centroid along "
             "gravity.",
             "gravity",
             {"Volume under gravity, centre off the centroid",
              "offset of the centre [R]",
              "volume variation [%]",
              {}},
             "offset_share",
             {}};
    Curve law{"law 3", {}, {}, black, 2};
    for (const Scheme scheme : schemes) {
        Curve curve{"scheme " + std::string(to_string(scheme)), {}, {}, colour_of(scheme)};
        for (const GravityRow& row : study.rows) {
            if (row.scheme != scheme || (row.centre != "centroid" && !row.centre.starts_with("off_")))
                continue;
            curve.x.push_back(row.offset_share), curve.y.push_back(row.volume_variation_percent.final);
            if (scheme == Scheme::C) law.x.push_back(row.offset_share), law.y.push_back(row.law_percent);
        }
        f.plot.curves.push_back(std::move(curve));
        f.y_columns.push_back(fmt::format("{}_volume_variation_percent", to_string(scheme)));
    }
    if (law.x.size() > 1) {
        f.plot.curves.push_back(std::move(law));
        f.y_columns.push_back("law_percent");
        figures.push_back(std::move(f));
    }
    return figures;
}

std::vector<Figure> figures_of(const Setting& s, const ForceStudy& study) {
    const auto curve = [&](LoadKind load, Scheme scheme, DensityClass density, auto value) {
        Curve c{"scheme " + std::string(to_string(scheme)),
                s.force_groups,
                {},
                colour_of(scheme),
                dash_of(scheme)};
        for (const ForceMean& m : study.means)
            if (m.load == load && m.scheme == scheme && m.density == density) c.y.push_back(value(m));
        return c;
    };
    struct Measure {
        std::string_view name, title, y_label, column, caption;
        bool log_y;
        double (*value)(const ForceMean&);
    };
    static constexpr Measure measures[] = {
        {"mean", "Mean volume variation", "volume variation [%]", "mean_percent",
         "Fig. 9: mean over time of |ΔV/V|", true,
         [](const ForceMean& m) { return m.volume_variation_percent.mean; }},
        {"max", "Largest volume variation", "volume variation [%]", "max_percent",
         "Largest |ΔV/V| at any time", true,
         [](const ForceMean& m) { return m.volume_variation_percent.max; }},
        {"final", "Volume lost in equilibrium", "volume lost / law 2", "final_over_law",
         "ΔV/V in equilibrium over that of law 2, -3F/(4πR²(E + 3E_s/R))", false,
         [](const ForceMean& m) { return m.volume_variation_percent.final / m.law_percent; }},
        {"spread", "Spread of the loss over the surface", "standard deviation [%]", "final_std_percent",
         "Standard deviation over the vertices of ΔV/V in equilibrium: how the loss depends on the place",
         true, [](const ForceMean& m) { return m.final_std_percent; }}};
    std::vector<Figure> figures;
    for (const LoadKind load : load_kinds) {
        for (const Measure& measure : measures) {
            Figure f{
                fmt::format("fig9_{}_{}", measure.name, to_string(load)), "", "force", {}, "force_group", {}};
            f.caption = fmt::format("{}; over {} vertices spread over the surface.", measure.caption,
                                    s.sampled.size());
            f.plot.title = fmt::format("{}: {}", measure.title, reading(load));
            f.plot.x_label = group_label, f.plot.y_label = measure.y_label;
            f.plot.log_x = true, f.plot.log_y = measure.log_y;
            for (const Scheme scheme : schemes) {
                f.plot.curves.push_back(curve(load, scheme, DensityClass::sampled, measure.value));
                f.y_columns.push_back(fmt::format("{}_{}", to_string(scheme), measure.column));
            }
            figures.push_back(std::move(f));
        }
        // Two figures rather than one of six curves.
        for (const DensityClass density : {DensityClass::coarsest, DensityClass::densest}) {
            Figure f{fmt::format("fig9_{}_{}", to_string(density), to_string(load)),
                     "",
                     "force",
                     {},
                     "force_group",
                     {}};
            f.caption = fmt::format(
                "Fig. 9 at {} vertices of the {} tenth: mean over time of |ΔV/V| for each F/(ER²).",
                s.vertices(density).size(), to_string(density));
            f.plot.title =
                fmt::format("Mean volume variation, {} tenth: {}", to_string(density), reading(load));
            f.plot.x_label = group_label, f.plot.y_label = "volume variation / (F/(ER²)) [%]";
            f.plot.log_x = true;
            for (const Scheme scheme : schemes) {
                f.plot.curves.push_back(curve(load, scheme, density, [](const ForceMean& m) {
                    return m.volume_variation_percent.mean / m.force_group;
                }));
                f.y_columns.push_back(fmt::format("{}_mean_percent_per_force_group", to_string(scheme)));
            }
            figures.push_back(std::move(f));
        }
    }
    return figures;
}

std::vector<Figure> figures_of(const Setting& s, const VolumeStudy& study) {
    struct Measure {
        std::string_view name, title, y_label, column, caption;
        double (*value)(const VolumeMean&);
        double (*law)(const VolumeMean&);
    };
    static constexpr Measure measures[] = {
        {"final", "Volume under a push", "volume variation [%]", "largest_percent",
         "Fig. 9 with Poisson's ratio: |ΔV/V| in equilibrium, the largest. Dashed: law 2, 3F/(4πR²(E + 3κ + "
         "3E_s/R))",
         [](const VolumeMean& m) { return m.largest_percent; },
         [](const VolumeMean& m) { return -m.law_percent; }},
        {"pressure", "Pressure under a push", "pressure [Pa]", "pressure_pa",
         "What resists the change of volume, P = -κ ΔV/V; at ν = ½ its limit, in the mean. Dashed: of law 2",
         [](const VolumeMean& m) { return m.pressure_pa; }, [](const VolumeMean& m) { return m.law_pa; }},
        {"indentation", "Indentation under a push", "indentation [R]", "indentation_share",
         "Displacement of the loaded vertex: the volume term hardly makes the body harder under the finger; "
         "in the "
         "mean",
         [](const VolumeMean& m) { return m.indentation_share; }, nullptr}};
    std::vector<Figure> figures;
    for (const Measure& measure : measures) {
        Figure f{fmt::format("fig9_nu_{}", measure.name), "", "volume", {}, "force_group", {}};
        f.caption =
            fmt::format("{}; over {} vertices spread over the surface.", measure.caption, s.sampled.size());
        f.plot.title = measure.title;
        f.plot.x_label = group_label, f.plot.y_label = measure.y_label;
        f.plot.log_x = f.plot.log_y = true;
        std::vector<Curve> laws;
        int colour = 0;
        for (const double poisson : s.options.poisson) {
            colour = colour % 6 + 1;
            Curve curve{fmt::format("ν = {:g}", poisson), s.force_groups, {}, colour, 1};
            Curve law{fmt::format("law, {:g}", poisson), s.force_groups, {}, colour, 2};
            for (const VolumeMean& m : study.means)
                if (m.poisson == poisson && !m.deepest) {
                    curve.y.push_back(measure.value(m));
                    if (measure.law) law.y.push_back(measure.law(m));
                }
            // A pressure or a law that is zero everywhere has no place on a logarithmic axis.
            const auto drawn = [](const std::vector<double>& y) {
                return std::any_of(y.begin(), y.end(), [](double value) { return value > 0; });
            };
            if (drawn(law.y)) laws.push_back(std::move(law));
            if (!drawn(curve.y)) continue;
            f.plot.curves.push_back(std::move(curve));
            f.y_columns.push_back(fmt::format("nu_{:g}_{}", poisson, measure.column));
        }
        std::move(laws.begin(), laws.end(), std::back_inserter(f.plot.curves));
        if (!f.y_columns.empty()) figures.push_back(std::move(f));
    }
    if (study.bulge.empty()) return figures;
    Figure f{"fig9_nu_bulge",
             fmt::format("The equator of the sphere squeezed by two caps of {:g} rad, beside Lamé's series.",
                         bulge_cap),
             "volume",
             {"Bulge of a squeezed sphere", "Poisson's ratio", "equator outward, u E R / F", {}},
             "poisson",
             {"C_relative", "series_relative"}};
    Curve ours{"scheme C", {}, {}, colour_of(Scheme::C), 1}, series{"Lamé's series", {}, {}, black, 2};
    for (const BulgeRow& b : study.bulge) {
        ours.x.push_back(b.poisson), ours.y.push_back(b.equator);
        series.x.push_back(b.poisson), series.y.push_back(b.reference_equator);
    }
    f.plot.curves = {std::move(ours), std::move(series)};
    figures.push_back(std::move(f));
    return figures;
}

std::string draw_figures(const std::vector<Figure>& figures, const std::filesystem::path& directory,
                         int threads) {
    // Plots cost more in starting gnuplot than in drawing: several at a time.
    std::vector<std::string> failures(figures.size());
    Team team(threads);
    team.run(figures.size(), [&](std::size_t n) {
        const std::filesystem::path file = directory / figures[n].name;
        failures[n] = write_svg(figures[n].plot, file.string() + ".svg");
        if (failures[n].empty()) failures[n] = write_png(figures[n].plot, file.string() + ".png");
    });
    for (const std::string& failure : failures)
        if (!failure.empty()) return failure;
    return "";
}

}  // namespace innerspring
