#include "innerspring/study/truth_loads.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

/// Six points, exact for polynomials of degree 4 (Dunavant 1985): a load that is linear, times quadratic
/// shapes, needs 3.
template <class Use>
void for_each_point(Use use) {
    constexpr std::array<std::array<double, 2>, 2> rule = {
        {{0.445948490915965, 0.223381589678011}, {0.091576213509771, 0.109951743655322}}};
    for (const auto& [a, weight] : rule)
        for (int k = 0; k < 3; ++k) {
            Vector at = Vector::Constant(a);
            at[k] = 1 - 2 * a;
            use(at, weight);
        }
}

/// The middles of the n^2 triangles that a triangle is cut into: for loads with an edge.
template <class Use>
void for_each_part(int n, Use use) {
    const double cell = 1.0 / n;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n - i; ++j) {
            const double a = (i + 1.0 / 3) * cell, b = (j + 1.0 / 3) * cell;
            use(Vector(a, b, 1 - a - b), cell * cell);
            if (j == n - i - 1) continue;
            const double c = (i + 2.0 / 3) * cell, d = (j + 2.0 / 3) * cell;
            use(Vector(c, d, 1 - c - d), cell * cell);
        }
}

double area_of(const SurfaceMesh& mesh, Index t) {
    return double_area_vector(mesh.positions, mesh.triangles[t]).norm() / 2;
}

template <class T>
T mix(const std::vector<T>& values, const Triangle& t, const Vector& at) {
    return at[0] * values[t[0]] + at[1] * values[t[1]] + at[2] * values[t[2]];
}

std::vector<Vector> at_vertices(const SphereSolution& solution, const SurfaceMesh& mesh) {
    std::vector<Vector> u;
    for (const Vector& x : mesh.positions) u.push_back(solution.at(x));
    return u;
}

}  // namespace

TruthLoad mode_load(const TruthSubject& s, int n) {
    TruthLoad load{fmt::format("mode {}", n), TruthLoad::Kind::mode, {}, Vector::Zero(), 0};
    for (Index t = 0; t < s.mesh.triangles.size(); ++t) {
        const double area = area_of(s.mesh, t);
        for_each_point([&](const Vector& at, double weight) {
            const Vector outward = mix(s.mesh.positions, s.mesh.triangles[t], at).normalized();
            const double P = std::legendre(unsigned(n), std::clamp(outward.dot(s.axis), -1.0, 1.0));
            load.surface.push_back({t, at, s.material.young * P * weight * area * outward});
        });
    }
    return load;
}

TruthLoad squeeze_load(const TruthSubject& s, double alpha) {
    const double F = s.material.young * s.radius * s.radius;
    TruthLoad load{fmt::format("squeeze {:g}", alpha), TruthLoad::Kind::squeeze, {}, Vector::Zero(), F};
    double sum = 0;  // of the components along the axis, of both caps
    for (Index t = 0; t < s.mesh.triangles.size(); ++t) {
        const double area = area_of(s.mesh, t);
        for_each_part(12, [&](const Vector& at, double weight) {
            const Vector outward = mix(s.mesh.positions, s.mesh.triangles[t], at).normalized();
            const double c = outward.dot(s.axis);
            if (std::abs(c) <= std::cos(alpha)) return;
            load.surface.push_back({t, at, -weight * area * outward});
            sum += weight * area * std::abs(c);
        });
    }
    if (load.surface.empty()) throw InputError(fmt::format("squeeze {:g}: no triangle lies under it", alpha));
    for (SurfaceForce& f : load.surface) f.force *= 2 * F / sum;
    return load;
}

std::vector<Vector> mode_answer(const TruthSubject& s, int n) {
    const double E = s.material.young;
    return at_vertices({s.radius, s.poisson, s.axis, {sphere_mode(n, E, E, s.poisson)}}, s.mesh);
}

std::vector<Vector> squeeze_answer(const TruthSubject& s, double alpha) {
    const double E = s.material.young;
    return at_vertices(squeezed_sphere(alpha, E * s.radius * s.radius, s.radius, E, s.poisson, s.axis),
                       s.mesh);
}

TruthSubject make_subject(SurfaceMesh mesh, const Material& material, const CentreOption& centre,
                          double poisson) {
    const Body body = build_body(mesh, material, {Scheme::C, centre, false});
    TruthSubject s;
    s.name = body.rest.name;
    s.mesh = std::move(mesh);
    s.volume = body.volume;
    s.radius = body.radius;
    s.material = body.material;
    s.centre = centre;
    s.mass = body.m;
    s.poisson = poisson;
    return s;
}

void hold_base(TruthSubject& s, const Vector& gravity, double share) {
    const Vector up = -gravity.normalized();
    double low = INFINITY, high = -INFINITY;
    for (const Vector& x : s.mesh.positions) low = std::min(low, x.dot(up)), high = std::max(high, x.dot(up));
    std::vector<bool> held;
    for (const Vector& x : s.mesh.positions) held.push_back(x.dot(up) <= low + share * (high - low));
    const bool whole = std::any_of(s.mesh.triangles.begin(), s.mesh.triangles.end(),
                                   [&](const Triangle& t) { return held[t[0]] && held[t[1]] && held[t[2]]; });
    if (!whole)
        throw InputError(
            fmt::format("'{}': no whole triangle lies in the lowest {:g} of its height, where it "
                        "would be held; use a finer mesh",
                        s.name, share));
    for (Index i = 0; i < held.size(); ++i)
        if (held[i]) s.held.push_back(i);
}

void add_loads_of(TruthSubject& s, const Vector& gravity, int count, double radius) {
    s.loads.push_back({"gravity", TruthLoad::Kind::gravity, {}, gravity.normalized(), 0});
    const Body body = build_body(s.mesh, s.material, {Scheme::C, s.centre, false});
    const Vector up = -gravity.normalized();
    double base = -INFINITY;
    for (const Index i : s.held) base = std::max(base, s.mesh.positions[i].dot(up));
    std::vector<Index> away;
    Index top = 0;
    for (Index i = 0; i < s.mesh.positions.size(); ++i) {
        if (s.mesh.positions[i].dot(up) > base + radius) away.push_back(i);
        if (s.mesh.positions[i].dot(up) > s.mesh.positions[top].dot(up)) top = i;
    }
    std::vector<Index> places{top};
    for (const Index i : spread_vertices(s.mesh, away, std::size_t(count)))
        if (i != top && places.size() < std::size_t(count)) places.push_back(i);

    const std::vector<Vector> normals = vertex_normals(s.mesh.positions, s.mesh.triangles);
    for (std::size_t n = 0; n < places.size(); ++n)
        for (const double r : {radius, radius / 2}) {
            const Vector middle = s.mesh.positions[places[n]];
            std::vector<Vector> pressure(s.mesh.positions.size(), Vector::Zero());
            std::vector<bool> touched(pressure.size(), false);
            for (const Index i : vertices_around(body, places[n], r)) {
                const double d2 = (s.mesh.positions[i] - middle).squaredNorm() / (r * r);
                pressure[i] = -(1 - d2) * (1 - d2) * normals[places[n]];
                touched[i] = true;
            }
            TruthLoad load{fmt::format("patch {} of {:.2g} R", n + 1, r / s.radius),
                           TruthLoad::Kind::patch,
                           {},
                           Vector::Zero(),
                           1};
            double sum = 0;
            for (Index t = 0; t < s.mesh.triangles.size(); ++t) {
                const Triangle& corner = s.mesh.triangles[t];
                if (!touched[corner[0]] && !touched[corner[1]] && !touched[corner[2]]) continue;
                const double area = area_of(s.mesh, t);
                for_each_point([&](const Vector& at, double weight) {
                    load.surface.push_back({t, at, weight * area * mix(pressure, corner, at)});
                    sum += load.surface.back().force.norm();
                });
            }
            for (SurfaceForce& f : load.surface) f.force /= sum;
            s.loads.push_back(std::move(load));
        }
}

void scale(TruthLoad& load, double factor) {
    for (SurfaceForce& f : load.surface) f.force *= factor;
    load.gravity *= factor;
    load.force_n *= factor;
}

}  // namespace innerspring
