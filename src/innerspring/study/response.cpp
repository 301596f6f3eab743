#include "innerspring/study/response.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "innerspring/mesh/error.h"
#include "innerspring/sim/equilibrium.h"
#include "innerspring/sim/measure.h"

namespace innerspring {

Sampling sampling_until_rest(std::span<const Body* const> bodies) {
    double slowest = 0;
    for (const Body* body : bodies)
        for (std::size_t i = 0; i < body->vertices(); ++i)
            slowest = std::max(slowest, std::sqrt(body->m[i] / body->K[i]));
    const double duration = 15 * slowest, dt = std::clamp(0.01, duration / 100, duration / 25);
    return {dt, int(std::ceil(duration / dt))};
}

double load_displacement(const Body& body, const Loads& loads, const State& state) {
    const auto u = [&](Index i) -> Vector { return state.x[i] - body.rest.positions[i]; };
    double sum = 0;
    if (loads.forces.empty()) {
        const Vector along = loads.gravity.normalized();
        for (Index i = 0; i < body.vertices(); ++i) sum += body.m[i] / body.material.mass * u(i).dot(along);
        return sum;
    }
    const Force& force = loads.forces.front();
    const Vector along = force.newton.normalized();
    for (std::size_t n = 0; n < force.vertices.size(); ++n)
        sum += force.weights[n] * u(force.vertices[n]).dot(along);
    return sum;
}

Response respond(const Body& body, const Loads& loads, Index watched, const Sampling& sampling,
                 Workspace& workspace, State& state) {
    Response response;
    state = rest_state(body);
    for (int sample = 0; sample <= sampling.samples; ++sample) {
        if (sample > 0 && step(body, loads, state, workspace).not_finite != no_index)
            throw RunError(fmt::format("{}, scheme {}: blew up at t = {:g} s", body.rest.name,
                                       to_string(body.scheme), state.time));
        if (watched != no_index)
            response.vertex_m.push_back((state.x[watched] - body.rest.positions[watched]).norm());
        response.load_m.push_back(load_displacement(body, loads, state));
        response.volume_percent.push_back(100 * (volume(state.x, body.rest.triangles) / body.volume - 1));
    }
    response.std_m = measure(body, loads, state).std_displacement.norm();
    response.imbalance = largest_imbalance(body, loads, state) / load_sum(body, loads, state.time);
    return response;
}

Response press(const Body& body, const Force& unit, Index watched, std::span<const double> forces_n,
               double depth_m) {
    Loads loads{Vector::Zero(), {unit}, {}};
    Response found{{0}, {0}, {0}, 0, 0, {0}, {0}};
    const auto balance = [&](double force_n) {
        loads.forces.front().newton = force_n * unit.newton;
        State state = rest_state(body);
        const EquilibriumReport report = solve_equilibrium(body, loads, state);
        const double depth = (state.x[watched] - body.rest.positions[watched]).norm();
        found.std_m = measure(body, loads, state).std_displacement.norm();
        found.imbalance = std::max(found.imbalance, report.residual_n / force_n);
        return std::array{depth, load_displacement(body, loads, state),
                          100 * (volume(state.x, body.rest.triangles) / body.volume - 1), report.pressure};
    };
    const auto keep = [&](double force_n, const std::array<double, 4>& at) {
        found.force_n.push_back(force_n);
        found.vertex_m.push_back(at[0]), found.load_m.push_back(at[1]), found.volume_percent.push_back(at[2]);
        found.pressure_pa.push_back(at[3]);
    };
    // low is the largest force known not to reach the depth, high the least known to.
    double low = 0, low_m = 0, high = INFINITY, high_m = 0;
    std::array<double, 4> deep{};
    const auto note = [&](double force_n, const std::array<double, 4>& at) {
        if (at[0] < depth_m && force_n < high && force_n > low) low = force_n, low_m = at[0];
        if (at[0] >= depth_m && force_n < high) high = force_n, high_m = at[0], deep = at;
    };
    for (const double force_n : forces_n) {
        keep(force_n, balance(force_n));
        note(force_n, {found.vertex_m.back(), found.load_m.back(), found.volume_percent.back(),
                       found.pressure_pa.back()});
    }
    constexpr int most = 40;
    for (int n = 0; n < most && !(high_m >= depth_m && high_m <= 1.01 * depth_m); ++n) {
        // Depth over force as a line; in halves where that does not close in.
        const double share = (1.005 * depth_m - low_m) / (high_m - low_m);
        const double force_n = high == INFINITY ? low * std::clamp(1.005 * depth_m / low_m, 1.01, 2.0)
                                                : low + (high - low) * (n < 8 ? share : 0.5);
        note(force_n, balance(force_n));
    }
    if (high == INFINITY)
        throw RunError(fmt::format("{}: no force up to {:.3g} N presses vertex {} in by {:.3g} m",
                                   body.rest.name, low, watched, depth_m));
    keep(high, deep);
    return found;
}

}  // namespace innerspring
