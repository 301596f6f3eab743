#include <fmt/format.h>

#include "innerspring/body/estimate.h"
#include "innerspring/record/xml.h"
#include "innerspring/study/page.h"
#include "innerspring/study/study.h"
#include "innerspring/version.h"

namespace innerspring {

namespace {

constexpr std::string_view about_refinement =
    R"(The surface around a vertex is refined, masses and springs are re-estimated, and the same force acts as before.
What differs between the two motions is due to the mesh alone. With a <em>patch</em> load the force is spread over a
fixed radius, and the displacement is the mean with the load's weights, which is what the force works against; with a
<em>point</em> load all of it stays on one vertex, whose share of the surface shrinks as its triangles are split.
A_total: the mean stiffness is that of the refined mesh; A_node: that of the mesh before. Beside the inner springs there is
the surface, which has no stiffness in bending: where a push compresses it or meets a fold, a finer net gives way more.
That part of C's difference goes away with E_s.)";

constexpr std::string_view about_gravity =
    R"(The body is held by its inner springs and sinks under gravity. Volume variation over time for each scheme, about
several centres; a centre off the volume centroid costs volume at first order.)";

constexpr std::string_view about_force =
    R"(The volume that a force costs, from onset to equilibrium. A spring K_i gives way by F/K_i and takes a column of area
A_i with it: for A and B, whose springs are equal, the loss follows the density of the mesh; for C it follows A_i/K_i, the depth
under the load, which on a sphere is the same everywhere.)";

constexpr std::string_view about_volume =
    R"(The patch loads once more at Poisson's ratios from the paper's 0 to ½, by a pressure against the change of the
enclosed volume. Equilibria of scheme C, each from rest; the last force of each vertex is the one that presses it in by 0.3 R. The pressure makes up for the dent all over the surface, so on a sphere that
is squeezed at its poles the equator bulges; Lamé's series says by how much it does in a linear solid (<code>innerspring study truth</code> has
more caps and loads, and the shape of the dent).)";

std::string row(std::string_view term, const std::string& value) {
    return fmt::format("<dt>{}</dt><dd>{}</dd>\n", term, escape_xml(value));
}

std::string head(const StudyResults& r) {
    const Setting& s = r.setting;
    const Body& body = s.body();
    const Material& m = body.material;
    const Groups g = dimensionless_groups(body, s.gravity.norm(), s.force_n(s.force_groups.back()));
    std::string html = "<dl>\n";
    html += row("mesh", fmt::format("{}: {} vertices, {} triangles, {:.6g} m³, volume radius R = {:.4g} m",
                                    body.rest.name, body.vertices(), body.rest.triangles.size(), body.volume,
                                    body.radius));
    html += row("material", fmt::format("{}: M = {:.4g} kg, E = {:.4g} Pa, E_s = {:.4g} N/m, ζ = {:.3g}",
                                        s.material_name, m.mass, m.young, m.surface, m.damping));
    html += row("groups", fmt::format("Mg/(ER²) = {:.4g}, E_s/(ER) = {:.4g}, F/(ER²) = {:g} to {:g}",
                                      g.weight, g.surface, s.force_groups.front(), s.force_groups.back()));
    html += row("centre", fmt::format("{}: {}", to_string(body.centre.kind), body.centre.reason));
    html += row(
        "loads",
        fmt::format("{} forces at {} vertices spread over the surface, inward; patch: radius of influence "
                    "{:.3g} m; point: all on the vertex; refined within {:.3g} m of it",
                    s.force_groups.size(), s.sampled.size(), s.influence_m, s.region_m));
    html += row(
        "time",
        fmt::format("{:.4g} s in steps of {:.4g} s, sub-stepped as stability needs; largest force left on a "
                    "vertex at the end: {:.2g} of the load",
                    s.sampling.duration_s(), s.sampling.dt_s, r.largest_imbalance));
    html += row("cases", fmt::format("{}: simulations, or series of equilibria (volume)", r.cases));
    html += "</dl>\n<p><code>" + escape_xml(study_command(r, to_string(r.kind))) + "</code></p>\n";
    for (const std::string& warning : r.warnings) html += "<p>Note: " + escape_xml(warning) + "</p>\n";
    return html;
}

std::string_view css_class(Outcome outcome) {
    return outcome == Outcome::holds           ? "holds"
           : outcome == Outcome::holds_only_if ? "only"
           : outcome == Outcome::fails         ? "fails"
                                               : "open";
}

std::string title_of(std::string_view study) {
    return study == "refinement" ? "Refinement (Fig. 6)"
           : study == "gravity"  ? "Gravity (Figs. 7 and 8)"
           : study == "force"    ? "Force (Fig. 9)"
                                 : "Volume (Fig. 9 with Poisson's ratio)";
}

std::string command(const StudyResults& r, std::string_view study) {
    return "<code>" + escape_xml(study_command(r, study)) + "</code>";
}

std::string claims_table(const StudyResults& r) {
    std::string html =
        "<table>\n<tr><th>source</th><th>claim</th><th>measured</th><th>verdict</th><th>number "
        "(bound)</th></tr>\n";
    std::string_view study;
    for (const Claim& c : r.claims) {
        if (c.study != study)
            html += fmt::format("<tr class=\"group\"><th colspan=\"5\">{} {}</th></tr>\n", title_of(c.study),
                                command(r, c.study));
        study = c.study;
        const std::string number = c.outcome == Outcome::not_judged
                                       ? "-"
                                       : fmt::format("{:.3g} (≤ {:g})<br><small>{}</small>", c.number,
                                                     c.threshold, escape_xml(c.unit));
        html += fmt::format(
            "<tr><td>{}</td><td>{}</td><td>{}</td><td><span class=\"verdict {}\">{}</span>{}</td>"
            "<td class=\"number\">{}</td></tr>\n",
            escape_xml(c.source), escape_xml(c.claim), escape_xml(c.measured), css_class(c.outcome),
            to_string(c.outcome), c.condition.empty() ? "" : "<br>" + escape_xml(c.condition), number);
    }
    return html + "</table>\n";
}

std::string figure(const Figure& f, const std::filesystem::path& directory) {
    return fmt::format("<figure>{}<figcaption>{} <code>{}.csv</code></figcaption></figure>\n",
                       embedded(directory / (f.name + ".svg"), "svg+xml", f.plot.title),
                       escape_xml(f.caption), escape_xml(f.name));
}

std::string section(const StudyResults& r, const std::vector<Figure>& figures, std::string_view study,
                    std::string_view text, const std::filesystem::path& directory) {
    std::string html =
        fmt::format("<h2>{}</h2>\n<p>{}</p>\n<p>Shown by {}</p>\n", title_of(study), text, command(r, study));
    if (study == "refinement")
        for (const RefusedVertex& v : r.setting.refused)
            html += fmt::format("<p>Left out, vertex {}: {}</p>\n", v.vertex, escape_xml(v.reason));
    if (study == "gravity") {
        for (const RefusedCentre& c : r.gravity->refused)
            html +=
                fmt::format("<p>Refused, centre {}: {}</p>\n", escape_xml(c.centre), escape_xml(c.reason));
        html += fmt::format(
            "<figure>{}<figcaption>Fig. 7: displacement at rest under gravity, in one range of colours; "
            "centre {}. "
            "<code>fig7.png</code></figcaption></figure>\n",
            embedded(directory / "fig7.png", "png", "schemes B and C under gravity"),
            to_string(r.setting.body().centre.kind));
    }
    html += "<div class=\"figures\">\n";
    for (const Figure& f : figures)
        if (f.study == study) html += figure(f, directory);
    return html + "</div>\n";
}

}  // namespace

std::string to_html(const StudyResults& r, const std::vector<Figure>& figures,
                    const std::filesystem::path& directory) {
    const std::string name = escape_xml(r.setting.body().rest.name);
    std::string html =
        page_head(name) +
        fmt::format(
            "<h1>The paper's experiments on {}</h1>\n"
            "<p class=\"lead\">Arnab &amp; Raja, Irregular Surface Mesh Topology for Volumetric Deformable "
            "Model, section 4. "
            "Schemes: A regular; B irregular masses, regular springs; C the paper's proposal. innerspring "
            "{}.</p>\n",
            name, version);
    html += head(r);
    html +=
        "<h2>Claims</h2>\n<p>Verdicts follow from the numbers: a claim holds where its number is at most its "
        "bound.</p>\n";
    if (!r.setting.sphere)
        html +=
            "<p>This is not a sphere: laws 2 and 3 are those of a sphere, and are shown for "
            "comparison.</p>\n";
    html += claims_table(r);
    if (r.refinement) html += section(r, figures, "refinement", about_refinement, directory);
    if (r.gravity) html += section(r, figures, "gravity", about_gravity, directory);
    if (r.force) html += section(r, figures, "force", about_force, directory);
    if (r.volume) html += section(r, figures, "volume", about_volume, directory);
    return html + "</body>\n</html>\n";
}

}  // namespace innerspring
