#include "innerspring/body/estimate.h"

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/team.h"

namespace innerspring {

Quartiles quartiles(std::vector<double> values) {
    if (values.empty()) return {};
    // Linear interpolation between the two nearest ranks. What lies below a rank once found stays below it.
    auto sorted = values.begin();
    auto ranked = [&](std::size_t rank) {
        const auto place = values.begin() + std::ptrdiff_t(rank);
        if (place >= sorted) {
            std::nth_element(sorted, place, values.end());
            sorted = place + 1;
        }
        return *place;
    };
    auto at = [&](double share) {
        const double rank = share * double(values.size() - 1);
        const std::size_t below = std::size_t(rank), above = std::min(below + 1, values.size() - 1);
        const double low = ranked(below);
        return low + (rank - double(below)) * (ranked(above) - low);
    };
    const auto [least, largest] = std::ranges::minmax(values);
    const double lower = at(0.25), median = at(0.5), upper = at(0.75);
    return {least, lower, median, upper, largest};
}

Groups dimensionless_groups(const Body& body, double gravity_m_s2, double force_n) {
    const double E = mean_modulus(body.material), R = body.radius;
    return {body.material.mass * gravity_m_s2 / (E * R * R), body.material.surface / (E * R),
            force_n / (E * R * R)};
}

Estimate estimate(const Body& body, double gravity_m_s2) {
    Estimate e;
    const double E = mean_modulus(body.material);
    // Of parts that cost about the same; waking others is not worth it for a few vertices.
    std::vector<double> A;
    Vector centroid;
    Team team(body.vertices() < 8000 ? 1 : 0);
    team.run(4, [&](std::size_t part) {
        if (part == 0) e.m = quartiles(body.m), e.K = quartiles(body.K);
        if (part == 1) e.L = quartiles(body.L), A = vertex_areas(body.rest.positions, body.rest.triangles);
        if (part == 2) e.k = quartiles(body.k);
        if (part == 3) centroid = volume_centroid(body.rest.positions, body.rest.triangles);
    });
    Vector moment = Vector::Zero();
    for (std::size_t i = 0; i < body.vertices(); ++i) {
        e.mass_sum += body.m[i];
        e.stiffness_sum += body.K[i];
        e.stiffness_theory += E * A[i] / body.L[i];
        moment += body.m[i] * body.rest.positions[i];
    }
    e.mass_shift = moment / e.mass_sum - centroid;
    e.sag = body.material.mass * gravity_m_s2 * body.radius * body.radius / (3 * body.volume * E);
    return e;
}

}  // namespace innerspring
