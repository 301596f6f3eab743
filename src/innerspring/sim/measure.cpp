#include "innerspring/sim/measure.h"

#include "innerspring/sim/forces.h"
#include "innerspring/sim/volume.h"

namespace innerspring {

Measures measure(const Body& body, const Loads& loads, const State& state) {
    Measures now;
    const std::size_t n = body.vertices();
    now.time = state.time;
    now.volume = volume(state.x, body.rest.triangles);
    now.volume_variation_percent = 100 * (now.volume / body.volume - 1);
    Team alone(1);
    const HomeFrame frame = home_frame(body, state.x, alone);
    now.elastic = inner_energy(body, frame, state.x) + surface_energy(body, state.x);
    if (body.material.poisson > 0) {
        now.pressure = pressure(body, loads, state);
        if (body.material.poisson < 0.5)  // P^2 V_0 / (2 kappa)
            now.elastic += now.pressure * now.pressure * body.volume / (2 * bulk_modulus(body.material));
    }
    now.potential =
        gravity_energy(body, loads.gravity, state.x) + load_energy(body, loads, state.time, state.x);
    Vector squares = Vector::Zero();
    for (std::size_t i = 0; i < n; ++i) {
        now.kinetic += body.m[i] * state.v[i].squaredNorm() / 2;
        const Vector u = state.x[i] - body.rest.positions[i];
        now.max_displacement = std::max(now.max_displacement, u.norm());
        now.mean_displacement += u / double(n);
    }
    for (std::size_t i = 0; i < n; ++i)
        squares += (state.x[i] - body.rest.positions[i] - now.mean_displacement).cwiseAbs2() / double(n);
    now.std_displacement = squares.cwiseSqrt();
    now.tool_force.assign(loads.tools.size(), Vector::Zero());
    for (const Force& f : loads.forces)
        now.force.push_back(std::abs(at(f.profile, state.time)) * f.newton.stableNorm());
    return now;
}

}  // namespace innerspring
