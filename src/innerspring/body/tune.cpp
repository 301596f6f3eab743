#include "innerspring/body/tune.h"

#include <fmt/format.h>

#include <cmath>

#include "innerspring/body/distribution.h"
#include "innerspring/mesh/error.h"

namespace innerspring {

void tune(Body& body, const Material& material, Scheme scheme) {
    const Material resolved = resolve(material, body.volume);
    require_directions(body, resolved);
    const std::size_t n = body.vertices();
    std::vector<double> m(n, 0.0), K(n, 0.0);
    for (const Triangle& t : body.rest.triangles) {
        const double V_t = virtual_tetrahedron(body.centre, body.rest.positions, body.L, t);
        const double L_t = body.L[t[0]] + body.L[t[1]] + body.L[t[2]];
        for (Index i : t) {
            m[i] += share(L_t, body.L[i]) * V_t / body.volume;  // Eqs. 1 and 2, M = 1
            K[i] += V_t / (body.L[i] * body.L[i]);              // Eq. 3, E = 1
        }
    }
    double sum = 0;
    for (double& K_i : K) sum += (K_i *= mean_modulus(resolved));
    if (!std::isfinite(3 * sum))
        throw InputError(fmt::format(
            "{}: young (E) of {:g} Pa: the springs' sum is beyond the numbers; check the material",
            body.rest.name, mean_modulus(resolved)));
    for (std::size_t i = 0; i < n; ++i) {
        m[i] = resolved.mass * (scheme == Scheme::A ? 1 / double(n) : m[i]);
        if (scheme != Scheme::C) K[i] = sum / double(n);
        if (!std::isnormal(m[i]) || !std::isnormal(K[i]) || !(m[i] > 0 && K[i] > 0))
            throw InputError(
                fmt::format("{}: vertex {} would get mass {:g} kg and stiffness {:g} N/m; check the material",
                            body.rest.name, i, m[i], K[i]));
    }

    body.material = resolved;
    body.scheme = scheme;
    body.stiffness_sum = sum;
    body.m = std::move(m);
    body.K = std::move(K);
    for (std::size_t i = 0; i < n; ++i) body.c[i] = damping(resolved, body.m[i], body.K[i]);
    set_deviations(body);
    for (Index e = 0; e < body.edges.size(); ++e) set_surface_spring(body, e);
    for (std::size_t i = 0; i < n; ++i)
        for (Index s = body.rows[i].first; s < body.rows[i].first + body.rows[i].count; ++s)
            body.spokes[s].k = body.k[body.spokes[s].edge];
}

}  // namespace innerspring
