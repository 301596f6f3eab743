#include "innerspring/study/truth_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "innerspring/mesh/write.h"
#include "innerspring/record/xml.h"
#include "innerspring/study/page.h"
#include "innerspring/study/truth_sphere.h"
#include "innerspring/version.h"

namespace innerspring {

namespace {

using Json = nlohmann::ordered_json;

/// The largest displacement is drawn as this share of R.
constexpr double drawn_share = 0.12;

Json number(const std::optional<double>& value) {
    return value && std::isfinite(*value) ? Json(*value) : Json(nullptr);
}

/// Letters and digits of a name, for a file.
std::string file_name(std::string_view text) {
    std::string name;
    for (const char c : text) {
        const bool plain =
            (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.';
        if (plain)
            name += c;
        else if (!name.empty() && name.back() != '_')
            name += '_';
    }
    return name;
}

std::string column_of(std::string_view model) {
    return file_name(model);
}

std::string command(const TruthResults& r) {
    return fmt::format("innerspring study truth {}{}-o DIR", r.arguments, r.arguments.empty() ? "" : " ");
}

/// Radial displacement, averaged over rings of 2 degrees from the axis to the equator and back.
Curve profile(const TruthShown& shown, std::size_t answer) {
    constexpr std::size_t rings = 45;
    std::vector<double> sum(rings, 0), weight(rings, 0);
    const TruthSubject& s = *shown.subject;
    const double unit = s.material.young * s.radius / shown.load->force_n;
    for (std::size_t i = 0; i < s.mesh.positions.size(); ++i) {
        const Vector outward = s.mesh.positions[i].normalized();
        const double angle = std::acos(std::min(1.0, std::abs(outward.dot(s.axis))));
        const std::size_t ring =
            std::min(rings - 1, std::size_t(angle / (std::acos(-1.0) / 2) * double(rings)));
        sum[ring] += unit * shown.answers[answer].second[i].dot(outward);
        weight[ring] += 1;
    }
    Curve curve{shown.answers[answer].first, {}, {}, answer == 0 ? 7 : 0, answer == 0 ? 2 : 1};
    for (std::size_t n = 0; n < rings; ++n) {
        if (weight[n] == 0) continue;
        curve.x.push_back((double(n) + 0.5) * 90 / double(rings));
        curve.y.push_back(sum[n] / weight[n]);
    }
    if (answer > 0) curve.colour = int((answer - 1) % 6) + 1;
    return curve;
}

}  // namespace

std::vector<Figure> truth_figures(const TruthResults& results, const std::vector<TruthShown>& shown) {
    std::vector<Figure> figures;
    Figure modes{"truth_modes",
                 "A sphere under the traction p P_n(cos θ): what it gives, of pR/E, by Lamé's series and by "
                 "each model. "
                 "Springs to the centre do not know n.",
                 "truth",
                 {"Normal modes of the sphere", "n", "u E / (p R) at cos θ = 1", {}, false, false},
                 "n",
                 {}};
    Curve exact{"series", {}, {}, 7, 2};
    for (const TruthModel& model : results.models) {
        Curve curve{model.name, {}, {}, 0, 1};
        for (const TruthRow& row : results.rows) {
            if (row.reference != "series" || row.model != model.name || !row.load.starts_with("mode "))
                continue;
            const int n = std::stoi(row.load.substr(5));
            const SphereSolution s{1,
                                   results.options.sphere_poisson,
                                   Vector::UnitZ(),
                                   {sphere_mode(n, 1, 1, results.options.sphere_poisson)}};
            const double C = s.at(Vector::UnitZ()).z();
            curve.x.push_back(n);
            curve.y.push_back(C * row.work_ratio);
            if (modes.plot.curves.empty()) exact.x.push_back(n), exact.y.push_back(C);
        }
        if (curve.x.empty()) continue;
        if (modes.plot.curves.empty()) {
            modes.plot.curves.push_back(exact);
            modes.y_columns.push_back("series_relative");
        }
        modes.plot.curves.push_back(std::move(curve));
        modes.plot.curves.back().colour = int((modes.plot.curves.size() - 2) % 6) + 1;
        modes.y_columns.push_back(column_of(model.name) + "_relative");
    }
    if (!modes.plot.curves.empty()) figures.push_back(std::move(modes));
    for (const TruthShown& s : shown) {
        if (s.load->kind != TruthLoad::Kind::squeeze || !s.series || s.answers[1].first == "elements")
            continue;
        Figure figure{"truth_" + file_name(s.load->name),
                      "A sphere pressed by two caps: radial displacement from the pole to the equator.",
                      "truth",
                      {"Sphere, " + s.load->name + " rad",
                       "angle from the axis [degrees]",
                       "radial displacement, u E R / F",
                       {},
                       false,
                       false},
                      "angle_degrees",
                      {}};
        for (std::size_t n = 0; n < s.answers.size(); ++n) {
            figure.plot.curves.push_back(profile(s, n));
            figure.y_columns.push_back(column_of(s.answers[n].first) + "_relative");
        }
        figures.push_back(std::move(figure));
    }
    return figures;
}

std::vector<std::string> write_truth_pictures(const std::vector<TruthShown>& shown,
                                              const std::filesystem::path& directory, const Painter& paint) {
    std::vector<std::string> names;
    for (const TruthShown& s : shown) {
        if (s.load->kind != TruthLoad::Kind::gravity && s.load->kind != TruthLoad::Kind::patch) continue;
        const auto& q = s.subject->mesh.positions;
        double high = 0;
        for (const Vector& u : s.answers[0].second) high = std::max(high, u.norm());
        const double factor = drawn_share * s.subject->radius / high;
        std::vector<Image> images;
        for (const auto& [name, u] : s.answers) {
            std::vector<Vector> x = q;
            std::vector<double> length;
            for (std::size_t i = 0; i < q.size(); ++i) {
                x[i] += factor * u[i];
                length.push_back(u[i].norm());
            }
            PictureOptions options;
            options.width = 480, options.height = 400;
            options.title = name + ", x" + fmt::format("{:.3g}", factor);
            options.legend = "displacement [m]";
            options.high = high;
            images.push_back(paint(x, s.subject->mesh.triangles, length, options, q));
        }
        names.push_back("truth_" + file_name(s.subject->name) + "_" + file_name(s.load->name) + ".png");
        write_whole(directory / names.back(), to_png(beside(images)));
    }
    return names;
}

std::string to_csv(const TruthResults& r) {
    std::string text =
        "subject,reference,load,model,force_group,l2_error_relative,peak_error_relative,peak_ratio,work_"
        "ratio,"
        "volume_error_swept_relative,volume_percent,reference_volume_percent,pole_relative,reference_pole_"
        "relative,"
        "equator_relative,reference_equator_relative\n";
    for (const TruthRow& row : r.rows) {
        text +=
            fmt::format("\"{}\",{},{},{},{},{},{},{},{},{},{},{}", row.subject, row.reference, row.load,
                        row.model, row.force_group, row.l2_error, row.peak_error, row.peak_ratio,
                        row.work_ratio, row.swept_share, row.volume_percent, row.reference_volume_percent);
        for (const auto& value : {row.pole, row.reference_pole, row.equator, row.reference_equator})
            text += value ? fmt::format(",{}", *value) : ",";
        text += "\n";
    }
    return text;
}

std::string to_json(const TruthResults& r) {
    Json j;
    j["version"] = version;
    j["study"] = "truth";
    j["command"] = command(r);
    j["material"] = {{"name", r.material_name}, {"young_pa", r.material.young}};
    if (r.material.density)
        j["material"]["density_kg_m3"] = *r.material.density;
    else
        j["material"]["mass_kg"] = r.material.mass;
    if (r.material.surface_ratio)
        j["material"]["surface_ratio"] = *r.material.surface_ratio;
    else
        j["material"]["surface_n_m"] = r.material.surface;
    const TruthOptions& o = r.options;
    j["amplitude"] = o.amplitude;
    j["patch_share"] = o.patch_share;
    j["held_share"] = o.held_share;
    j["models"] = Json::array();
    for (const TruthModel& m : r.models) j["models"].push_back({{"name", m.name}, {"about", m.about}});
    j["subjects"] = Json::array();
    for (const TruthSubjectInfo& s : r.subjects)
        j["subjects"].push_back({{"name", s.name},
                                 {"reference", s.reference},
                                 {"poisson", s.poisson},
                                 {"vertices", s.vertices},
                                 {"triangles", s.triangles},
                                 {"held", s.held},
                                 {"tetrahedra", s.tetrahedra},
                                 {"nodes", s.nodes},
                                 {"radius_m", s.radius_m}});
    j["rows"] = Json::array();
    for (const TruthRow& row : r.rows) {
        Json line = {{"subject", row.subject},
                     {"reference", row.reference},
                     {"load", row.load},
                     {"model", row.model},
                     {"force_group", number(row.force_group)},
                     {"l2_error", number(row.l2_error)},
                     {"peak_error", number(row.peak_error)},
                     {"peak_ratio", number(row.peak_ratio)},
                     {"work_ratio", number(row.work_ratio)},
                     {"volume_error_swept", number(row.swept_share)},
                     {"volume_percent", number(row.volume_percent)},
                     {"reference_volume_percent", number(row.reference_volume_percent)}};
        if (row.pole) {
            line["pole"] = number(row.pole), line["reference_pole"] = number(row.reference_pole);
            line["equator"] = number(row.equator), line["reference_equator"] = number(row.reference_equator);
        }
        j["rows"].push_back(std::move(line));
    }
    j["warnings"] = r.warnings;
    return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string to_html(const TruthResults& r, const std::filesystem::path& directory) {
    std::string html = page_head("truth");
    html += fmt::format(
        "<h1>The surface-only body against linear elasticity</h1>\n<p class=\"lead\">Same surface, same "
        "loads at every "
        "point of it; the displacement of the surface compared under loads that move the reference by {:g} "
        "R. "
        "innerspring {}.</p>\n<p><code>{}</code></p>\n",
        r.options.amplitude, version, escape_xml(command(r)));
    for (const std::string& warning : r.warnings) html += "<p>Note: " + escape_xml(warning) + "</p>\n";
    html += "<dl>\n";
    for (const TruthModel& m : r.models)
        html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escape_xml(m.name), escape_xml(m.about));
    html +=
        "</dl>\n<p>L2: area-weighted, relative. Peak error: largest difference over the largest displacement "
        "of the "
        "reference. Peak and work: the model's displacement there, and the work of the load, over the "
        "reference's: 1 is "
        "right, 2 twice as soft. Volume: gained or lost against the reference, of the volume that it sweeps; "
        "last, "
        "change of volume of model and reference at first order.</p>\n";
    for (const TruthSubjectInfo& s : r.subjects) {
        html += fmt::format("<h2>{}</h2>\n<p>{} vertices, {} held; reference: {}, ν = {:g}",
                            escape_xml(s.name), s.vertices, s.held, s.reference, s.poisson);
        if (s.tetrahedra) html += fmt::format("; {} quadratic tetrahedra, {} nodes", s.tetrahedra, s.nodes);
        html +=
            ".</p>\n<table>\n<tr><th>load</th><th>model</th><th>L2 error</th><th>peak error</th><th>peak</th>"
            "<th>work</th><th>volume</th><th>ΔV/V [%]</th><th>pole, equator: u E R/F</th></tr>\n";
        std::string_view load;
        for (const TruthRow& row : r.rows) {
            if (row.subject != s.name) continue;
            html += fmt::format(
                "<tr><td>{}</td><td>{}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</td><td>{:.3f}</"
                "td><td>{:+.3f}</td>"
                "<td>{:+.2g}, {:+.2g}</td><td>",
                row.load == load ? "" : escape_xml(row.load), escape_xml(row.model), row.l2_error,
                row.peak_error, row.peak_ratio, row.work_ratio, row.swept_share, row.volume_percent,
                row.reference_volume_percent);
            if (row.pole)
                html += fmt::format("{:.3f} ({:.3f}), {:.4f} ({:.4f})", *row.pole, *row.reference_pole,
                                    *row.equator, *row.reference_equator);
            html += "</td></tr>\n";
            load = row.load;
        }
        html += "</table>\n";
        for (const std::string& name : r.pictures)
            if (name == "truth_" + file_name(s.name) + "_gravity.png" ||
                name.starts_with("truth_" + file_name(s.name) + "_patch"))
                html += fmt::format(
                    "<figure>{}<figcaption><code>{}</code>: magnified; colours end at the reference's "
                    "largest displacement.</figcaption></figure>\n",
                    embedded(directory / name, "png", name), escape_xml(name));
    }
    html += "<div class=\"figures\">\n";
    for (const Figure& f : r.figures)
        html += fmt::format("<figure>{}<figcaption>{} <code>{}.csv</code></figcaption></figure>\n",
                            embedded(directory / (f.name + ".svg"), "svg+xml", f.plot.title),
                            escape_xml(f.caption), escape_xml(f.name));
    return html + "</div>\n</body>\n</html>\n";
}

}  // namespace innerspring
