#include "innerspring/record/json.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "innerspring/version.h"

namespace innerspring {

namespace {

using Json = nlohmann::ordered_json;

Json vector(const Vector& v) {
    return Json::array({v.x(), v.y(), v.z()});
}

/// Names may hold any bytes a file name may hold.
std::string text(const Json& json) {
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json mesh(const std::string& name, std::size_t vertices, std::size_t triangles, double volume_m3) {
    return {{"name", name}, {"vertices", vertices}, {"triangles", triangles}, {"volume_m3", volume_m3}};
}

Json centre(const Centre& c) {
    return {{"kind", to_string(c.kind)}, {"position_m", vector(c.position)}, {"reason", c.reason}};
}

/// Moduli of D; the first is that along the fibres or towards the centre.
Json anisotropy(const Material& m) {
    const Anisotropy& a = m.anisotropy;
    const Vector D = moduli(m);
    Json j{{"kind", to_string(a.kind)}, {"mean_pa", mean_modulus(m)}, {"moduli_pa", vector(D)}};
    if (a.kind == Anisotropy::Kind::fibres) {
        constexpr std::string_view courses[] = {"straight", "around", "outward", "field"};
        j["course"] = courses[std::size_t(a.course)];
        if (a.course == Anisotropy::Course::straight || a.course == Anisotropy::Course::around)
            j["direction"] = vector(a.direction);
        if (a.course == Anisotropy::Course::around || a.course == Anisotropy::Course::outward)
            j["through_m"] = vector(a.through);
        if (a.course == Anisotropy::Course::around) j["pitch_deg"] = a.pitch_deg;
        if (a.course == Anisotropy::Course::field) j["field"] = a.file;
    }
    if (a.kind == Anisotropy::Kind::orthotropic)
        j["axes"] = {vector(a.axes.col(0)), vector(a.axes.col(1)), vector(a.axes.col(2))};
    return j;
}

Json material(const std::string& name, const Material& m) {
    return {{"name", name},
            {"mass_kg", m.mass},
            {"young_pa", m.young},
            {"surface_n_m", m.surface},
            {"damping_ratio", m.damping},
            {"poisson", m.poisson},
            {"anisotropy", anisotropy(m)}};
}

Json groups(const Groups& g) {
    return {{"weight", g.weight}, {"surface", g.surface}, {"force", g.force}};
}

Json five(const Quartiles& q) {
    return {{"min", q.min}, {"lower", q.lower}, {"median", q.median}, {"upper", q.upper}, {"max", q.max}};
}

Json head(const Subject& s) {
    Json j;
    j["version"] = version;
    j["mesh"] = mesh(s.mesh_name, s.vertices, s.triangles, s.volume_m3);
    j["scheme"] = to_string(s.scheme);
    j["centre"] = centre(s.centre);
    j["material"] = material(s.material_name, s.material);
    j["groups"] = groups(s.groups);
    return j;
}

std::string_view name(Verdict v) {
    return v == Verdict::fine ? "fine" : v == Verdict::usable ? "usable" : "unusable";
}

}  // namespace

std::string to_json(const Summary& s) {
    Json j = head(s.subject);
    j["integrator"] = to_string(s.integrator);
    j["precision"] = to_string(s.precision);
    j["dt_s"] = s.dt_s;
    j["substeps"] = s.substeps;
    j["duration_s"] = s.duration_s;
    j["volume_variation_percent"] = {{"final", s.volume_variation_percent.final},
                                     {"max", s.volume_variation_percent.max},
                                     {"mean", s.volume_variation_percent.mean}};
    j["pressure_pa"] = s.last.pressure;
    j["max_displacement_m"] = s.last.max_displacement;
    if (!s.last.tool_force.empty()) {
        j["tool_force_n"] = Json::array();
        for (const Vector& f : s.last.tool_force) j["tool_force_n"].push_back(vector(f));
    }
    j["displacement_mean_m"] = vector(s.last.mean_displacement);
    j["displacement_std_m"] = vector(s.last.std_displacement);
    j["energy"] = {
        {"kinetic_j", s.last.kinetic}, {"elastic_j", s.last.elastic}, {"potential_j", s.last.potential}};
    j["equilibrium"] = {
        {"reached", s.equilibrium_reached}, {"residual_n", s.residual_n}, {"tolerance_n", s.tolerance_n}};
    j["steps"] = s.steps;
    if (s.refinements > 0) j["refinement"] = {{"changes", s.refinements}, {"vertices_last", s.vertices_last}};
    j["seconds"] = s.seconds;
    j["ns_per_vertex_step"] = s.ns_per_vertex_step;
    j["state_hash"] = fmt::format("{:016x}", s.state_hash);
    j["warnings"] = s.warnings;
    if (!s.failure.empty()) j["failure"] = s.failure;
    if (s.stopped) j["stopped"] = true;
    return text(j);
}

std::string to_json(const CheckReport& r, const std::string& mesh_name) {
    Json j;
    j["version"] = version;
    j["mesh"] = mesh(mesh_name, r.vertices, r.triangles, r.volume_m3);
    j["verdict"] = name(r.verdict);
    j["edges"] = r.edges;
    j["components"] = r.components;
    j["genus"] = r.genus ? Json(*r.genus) : Json(nullptr);
    j["area_m2"] = r.area_m2;
    j["centroid_m"] = vector(r.centroid);
    j["bounding_box_m"] = {{"lower", vector(r.lower)}, {"upper", vector(r.upper)}};
    j["edge_length_m"] = {{"min", r.edge_min_m}, {"mean", r.edge_mean_m}, {"max", r.edge_max_m}};
    j["negative_tetrahedra"] = {{"by_count", r.negative_tetrahedra_by_count},
                                {"by_volume", r.negative_tetrahedra_by_volume}};
    j["self_intersections"] = r.self_intersections;
    j["findings"] = Json::array();
    for (const Finding& f : r.findings)
        j["findings"].push_back({{"what", f.what},
                                 {"verdict", name(f.verdict)},
                                 {"count", f.count},
                                 {"first", f.first},
                                 {"advice", f.advice}});
    return text(j);
}

std::string to_json(const EstimateReport& r) {
    Json j = head(r.subject);
    j["m_kg"] = five(r.estimate.m);
    j["K_n_m"] = five(r.estimate.K);
    j["k_n_m"] = five(r.estimate.k);
    j["L_m"] = five(r.estimate.L);
    j["mass_sum_kg"] = r.estimate.mass_sum;
    j["stiffness_sum_n_m"] = r.estimate.stiffness_sum;
    j["stiffness_theory_n_m"] = r.estimate.stiffness_theory;
    j["mass_shift_m"] = vector(r.estimate.mass_shift);
    j["sag_m"] = r.estimate.sag;
    j["largest_stable_step_s"] = r.largest_stable_step_s;
    j["warnings"] = r.warnings;
    return text(j);
}

}  // namespace innerspring
