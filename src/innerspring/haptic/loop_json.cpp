#include <nlohmann/json.hpp>

#include "innerspring/haptic/loop.h"
#include "innerspring/version.h"

namespace innerspring {

namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Histogram& h) {
    return {{"p50", h.quantile_ms(0.5)},
            {"p99", h.quantile_ms(0.99)},
            {"p99_9", h.quantile_ms(0.999)},
            {"max", h.max_ms()}};
}

Json to_json(const Vector& v) {
    return {v.x(), v.y(), v.z()};
}

}  // namespace

std::string to_json(const LoopReport& r) {
    const ServoStatistics& s = r.servo;
    Json json{
        {"version", version},
        {"device",
         {{"name", r.device.name},
          {"max_force_n", r.device.max_force},
          {"max_continuous_force_n", r.device.max_continuous_force},
          {"max_stiffness_n_m", r.device.max_stiffness},
          {"workspace_m",
           {{"lower", to_json(r.device.workspace.lower)}, {"upper", to_json(r.device.workspace.upper)}}}}},
        {"coupling", {{"stiffness_n_m", r.gains.stiffness}, {"damping_n_s_m", r.gains.damping}}},
        {"scale", {{"scene_m_per_hand_m", r.mapping.metres}, {"hand_n_per_body_n", r.mapping.newtons}}},
        {"seconds", r.seconds},
        {"ticks", s.ticks},
        {"rate_hz", r.rate_hz},
        {"period_error_ms", to_json(s.period_error)},
        {"work_ms", to_json(s.work)},
        {"missed", s.missed},
        {"missed_by_us", s.missed_by_us},
        {"clamped", s.clamped},
        {"braked", s.braked},
        {"observer_energy_min_j", s.observer_least},
        {"observer_energy_j", s.observer_total},
        {"observer_lent_j", s.observer_lent},
        {"force_max_n", s.force_max},
        {"stiffness_max_n_m", s.stiffness_max},
        {"faults", s.faults},
        {"stalls", s.stalls},
        {"reopened", r.reopened},
        {"body_steps", r.body_steps},
        {"body_steps_per_second", r.body_steps_per_second},
        {"body_time_s", r.body_time},
        {"body_work_ms", to_json(r.body_work)},
        {"body_resets", r.body_resets},
        {"vertices", r.vertices},
        {"refinements", r.refinements},
        {"lost_samples", r.lost_samples},
        {"notes", r.notes}};
    if (r.has_empty) json["missed_empty_loop"] = r.missed_empty;
    if (!r.failure.empty()) json["failure"] = r.failure;
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace innerspring
