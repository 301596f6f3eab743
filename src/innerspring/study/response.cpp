#include "innerspring/study/response.h"

#include <fmt/format.h>

#include <algorithm>
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

}  // namespace innerspring
