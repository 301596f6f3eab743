#include <cmath>
#include <nlohmann/json.hpp>

#include "innerspring/body/estimate.h"
#include "innerspring/study/study.h"
#include "innerspring/version.h"

namespace innerspring {

namespace {

using Json = nlohmann::ordered_json;

/// A number, or null where there is none (local centres have no offset).
Json number(double value) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json json(const VolumeVariation& v) {
    return {{"mean", v.mean}, {"max", v.max}, {"final", v.final}};
}

void add(Json& j, const Deviation& d, const std::string& prefix = "") {
    j[prefix + "coarse_final_m"] = d.coarse_final_m;
    j[prefix + "refined_final_m"] = d.refined_final_m;
    j[prefix + "ratio"] = d.ratio;
    j[prefix + "mean_deviation_m"] = d.mean_m;
    j[prefix + "std_deviation_m"] = d.std_m;
    j[prefix + "mean_deviation_relative"] = d.mean_relative;
    j[prefix + "std_deviation_relative"] = d.std_relative;
}

Json json(const RefinementStudy& study) {
    Json rows = Json::array(), means = Json::array();
    for (const RefinementRow& r : study.rows) {
        Json j = {{"load", to_string(r.load)}, {"scheme", r.scheme},   {"levels", r.levels},
                  {"vertex", r.vertex},        {"force_n", r.force_n}, {"force_group", r.force_group}};
        add(j, r.measured);
        add(j, r.vertex_own, "vertex_");
        rows.push_back(std::move(j));
    }
    for (const RefinementMean& m : study.means) {
        Json j = {{"load", to_string(m.load)},
                  {"scheme", m.scheme},
                  {"levels", m.levels},
                  {"force_n", m.force_n},
                  {"force_group", m.force_group}};
        add(j, m.measured);
        j["ratio_least"] = m.ratio_least;
        j["ratio_largest"] = m.ratio_largest;
        add(j, m.vertex_own, "vertex_");
        means.push_back(std::move(j));
    }
    return {{"rows", rows}, {"means", means}};
}

Json json(const GravityStudy& study) {
    Json rows = Json::array(), refused = Json::array();
    for (const GravityRow& r : study.rows)
        rows.push_back({{"scheme", to_string(r.scheme)},
                        {"centre", r.centre},
                        {"offset_share", number(r.offset_share)},
                        {"volume_variation_percent", json(r.volume_variation_percent)},
                        {"law_percent", number(r.law_percent)},
                        {"displacement_std_m", r.displacement_std_m}});
    for (const RefusedCentre& c : study.refused)
        refused.push_back({{"centre", c.centre}, {"reason", c.reason}});
    return {{"rows", rows}, {"refused", refused}};
}

Json json(const ForceStudy& study) {
    Json rows = Json::array(), means = Json::array();
    for (const ForceRow& r : study.rows)
        rows.push_back({{"load", to_string(r.load)},
                        {"scheme", to_string(r.scheme)},
                        {"vertex", r.vertex},
                        {"density_class", to_string(r.density)},
                        {"force_n", r.force_n},
                        {"force_group", r.force_group},
                        {"volume_variation_percent", json(r.volume_variation_percent)}});
    for (const ForceMean& m : study.means)
        means.push_back({{"load", to_string(m.load)},
                         {"scheme", to_string(m.scheme)},
                         {"density_class", to_string(m.density)},
                         {"force_n", m.force_n},
                         {"force_group", m.force_group},
                         {"volume_variation_percent", json(m.volume_variation_percent)},
                         {"final_std_percent", m.final_std_percent},
                         {"final_spread_percent", m.final_spread_percent},
                         {"law_percent", m.law_percent}});
    return {{"rows", rows}, {"means", means}};
}

Json json(const VolumeStudy& study) {
    Json rows = Json::array(), means = Json::array(), bulge = Json::array();
    for (const VolumeRow& r : study.rows)
        rows.push_back({{"poisson", r.poisson},
                        {"vertex", r.vertex},
                        {"force_n", r.force_n},
                        {"force_group", r.force_group},
                        {"deepest", r.deepest},
                        {"indentation_share", r.indentation_share},
                        {"final_percent", r.final_percent},
                        {"pressure_pa", r.pressure_pa}});
    for (const VolumeMean& m : study.means)
        means.push_back({{"poisson", m.poisson},
                         {"force_n", m.force_n},
                         {"force_group", m.force_group},
                         {"deepest", m.deepest},
                         {"indentation_share", m.indentation_share},
                         {"final_percent", m.final_percent},
                         {"largest_percent", m.largest_percent},
                         {"law_percent", m.law_percent},
                         {"pressure_pa", m.pressure_pa},
                         {"law_pa", m.law_pa}});
    for (const BulgeRow& b : study.bulge)
        bulge.push_back(
            {{"poisson", b.poisson}, {"equator", b.equator}, {"reference_equator", b.reference_equator}});
    return {{"rows", rows}, {"means", means}, {"bulge", bulge}};
}

Json json(const StudyResults& r, const Claim& c) {
    Json j = {{"id", c.id},
              {"source", c.source},
              {"claim", c.claim},
              {"measured", c.measured},
              {"verdict", to_string(c.outcome)}};
    if (!c.condition.empty()) j["condition"] = c.condition;
    j["number"] = c.outcome == Outcome::not_judged ? Json(nullptr) : number(c.number);
    j["threshold"] = c.threshold;
    j["unit"] = c.unit;
    j["command"] = study_command(r, c.study);
    return j;
}

}  // namespace

std::string to_json(const StudyResults& r) {
    const Setting& s = r.setting;
    const Body& body = s.body();
    const Material& m = body.material;
    const Groups groups = dimensionless_groups(body, s.gravity.norm(), s.force_n(s.force_groups.back()));
    Json j;
    j["version"] = version;
    j["study"] = to_string(r.kind);
    j["command"] = study_command(r, to_string(r.kind));
    j["mesh"] = {
        {"name", body.rest.name},   {"vertices", body.vertices()}, {"triangles", body.rest.triangles.size()},
        {"volume_m3", body.volume}, {"radius_m", body.radius},     {"sphere", s.sphere}};
    const Vector& c = body.centre.position;
    j["centre"] = {{"kind", to_string(body.centre.kind)},
                   {"position_m", {c.x(), c.y(), c.z()}},
                   {"reason", body.centre.reason}};
    j["material"] = {{"name", s.material_name},
                     {"mass_kg", m.mass},
                     {"young_pa", m.young},
                     {"surface_n_m", m.surface},
                     {"damping_ratio", m.damping}};
    j["groups"] = {{"weight", groups.weight}, {"surface", groups.surface}, {"force", groups.force}};
    j["gravity_m_s2"] = {s.gravity.x(), s.gravity.y(), s.gravity.z()};
    j["influence_m"] = s.influence_m;
    j["region_m"] = s.region_m;
    j["dt_s"] = s.sampling.dt_s;
    j["duration_s"] = s.sampling.duration_s();
    j["vertices"] = {{"sampled", s.sampled}, {"coarsest", s.coarsest}, {"densest", s.densest}};
    if (r.refinement) {
        j["vertices"]["refused"] = Json::array();
        for (const RefusedVertex& v : s.refused)
            j["vertices"]["refused"].push_back({{"vertex", v.vertex}, {"reason", v.reason}});
    }
    j["cases"] = r.cases;
    j["largest_imbalance"] = r.largest_imbalance;

    // One study: its members beside the head. All: each under its name.
    const auto put = [&](const char* name, Json study) {
        if (r.kind == StudyKind::all)
            j[name] = std::move(study);
        else
            for (auto& [key, value] : study.items()) j[key] = std::move(value);
    };
    if (r.refinement) put("refinement", json(*r.refinement));
    if (r.gravity) put("gravity", json(*r.gravity));
    if (r.force) put("force", json(*r.force));
    if (r.volume) put("volume", json(*r.volume));
    j["claims"] = Json::array();
    for (const Claim& claim : r.claims) j["claims"].push_back(json(r, claim));
    j["warnings"] = r.warnings;
    return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace innerspring
