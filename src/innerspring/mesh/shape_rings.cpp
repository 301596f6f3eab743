#include <algorithm>
#include <cmath>
#include <numbers>

#include "innerspring/mesh/geometry.h"
#include "innerspring/mesh/random.h"
#include "innerspring/mesh/self_intersection.h"
#include "innerspring/mesh/shape_mesher.h"

namespace innerspring {

namespace {

constexpr double two_pi = 2 * std::numbers::pi;
const double row_height = std::sqrt(3.0) / 2;  // of equilateral triangles of side 1

/// Lengths below are in units of the local spacing: multiplied by sqrt(density).
double local_length(const ShapeSurface& s, const Vector& a, const Vector& b) {
    const double length = (b - a).norm();
    return s.density ? length * std::sqrt(s.density((a + b) / 2)) : length;
}

/// Cumulative length round the ring at u, sampled at equal steps of phi.
std::vector<double> ring_lengths(const ShapeSurface& s, double u, int samples) {
    std::vector<double> lengths{0.0};
    const Vector start = s.place(u, 0);
    Vector last = start;
    for (int j = 1; j <= samples; ++j) {
        const Vector next = j == samples ? start : s.place(u, two_pi * j / samples);
        lengths.push_back(lengths.back() + local_length(s, last, next));
        last = next;
    }
    return lengths;
}

/// Where the increasing table reaches `value`, as a fraction of its index range.
double inverse(const std::vector<double>& table, double value) {
    const auto above = std::upper_bound(table.begin() + 1, table.end() - 1, value);
    const double low = *(above - 1), width = *above - low;
    const double part = width > 0 ? std::clamp((value - low) / width, 0.0, 1.0) : 0.0;
    return (double(above - table.begin()) - 1 + part) / double(table.size() - 1);
}

/// Rows of rings: where they are (u) and how many vertices each has; poles apart.
struct Plan {
    std::vector<double> u;
    std::vector<Index> count;
};

Plan plan_rings(const ShapeSurface& s, Index vertices) {
    constexpr int steps = 256, around = 32;
    std::vector<double> along{0.0}, round(steps);
    double area = 0;
    for (int i = 0; i < steps; ++i) {
        double step = 0;
        for (int j = 0; j < around; ++j) {
            const double phi = two_pi * j / around;
            step += local_length(s, s.place(double(i) / steps, phi), s.place(double(i + 1) / steps, phi)) /
                    around;
        }
        round[i] = ring_lengths(s, (i + 0.5) / steps, around).back();
        area += step * round[i];
        along.push_back(along.back() + step);
    }

    const Index poles = s.cyclic ? 0 : 2, free = vertices - poles;
    const double spacing = std::sqrt(area / (vertices * row_height));
    const double rows = along.back() / (spacing * row_height) - (s.cyclic ? 0 : 1);
    const Index least = s.cyclic ? 3 : 1;
    const Index rings = std::clamp(Index(std::lround(std::max(rows, 1.0))), least, free / 3);

    Plan plan;
    std::vector<double> share{0.0};
    for (Index k = 0; k < rings; ++k) {
        const double part = s.cyclic ? double(k) / rings : double(k + 1) / (rings + 1);
        plan.u.push_back(inverse(along, part * along.back()));
        share.push_back(share.back() + ring_lengths(s, plan.u.back(), around).back());
    }
    Index given = 0;
    for (Index k = 0; k < rings; ++k) {
        const Index upto = Index(std::lround(share[k + 1] / share.back() * free));
        plan.count.push_back(upto - given);
        given = upto;
    }
    for (Index& count : plan.count)
        for (; count < 3; ++count) --*std::max_element(plan.count.begin(), plan.count.end());
    return plan;
}

struct Ring {
    Index first, count;
    double phase;  // of the first vertex, in units of the spacing along the ring
    Index vertex(Index i) const { return first + i % count; }
    double position(Index i) const { return (i + phase) / count; }
};

void zip(const Ring& a, const Ring& b, std::vector<Triangle>& triangles) {
    for (Index i = 0, j = 0; i < a.count || j < b.count;) {
        const bool along_a = j == b.count || (i < a.count && a.position(i + 1) <= b.position(j + 1));
        if (along_a) {
            triangles.push_back({a.vertex(i), a.vertex(i + 1), b.vertex(j)});
            ++i;
        } else {
            triangles.push_back({a.vertex(i), b.vertex(j + 1), b.vertex(j)});
            ++j;
        }
    }
}

}  // namespace

SurfaceMesh ring_mesh(const ShapeSurface& s, Index vertices, std::uint64_t seed) {
    constexpr int samples = 128;
    const Plan plan = plan_rings(s, vertices);
    Random random(seed);
    SurfaceMesh mesh;
    mesh.positions.reserve(vertices);
    mesh.triangles.reserve(2 * std::size_t(vertices));

    std::vector<Ring> rings;
    if (!s.cyclic) mesh.positions.push_back(s.place(0, 0));
    for (std::size_t k = 0; k < plan.u.size(); ++k) {
        const Ring ring{Index(mesh.positions.size()), plan.count[k], random.uniform()};
        const std::vector<double> lengths = ring_lengths(s, plan.u[k], samples);
        for (Index i = 0; i < ring.count; ++i)
            mesh.positions.push_back(
                s.place(plan.u[k], two_pi * inverse(lengths, ring.position(i) * lengths.back())));
        rings.push_back(ring);
    }
    if (!s.cyclic) mesh.positions.push_back(s.place(1, 0));

    for (std::size_t k = 0; k + 1 < rings.size(); ++k) zip(rings[k], rings[k + 1], mesh.triangles);
    if (s.cyclic) {
        zip(rings.back(), rings.front(), mesh.triangles);
    } else {
        const Ring &top = rings.front(), &bottom = rings.back();
        for (Index i = 0; i < top.count; ++i) mesh.triangles.push_back({0, top.vertex(i + 1), top.vertex(i)});
        for (Index i = 0; i < bottom.count; ++i)
            mesh.triangles.push_back({bottom.vertex(i), bottom.vertex(i + 1), vertices - 1});
    }
    if (volume(mesh) < 0)
        for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return mesh;
}

SurfaceMesh mesh_shape(const ShapeSurface& surface, Index vertices, std::uint64_t seed) {
    SurfaceMesh rings = ring_mesh(surface, vertices, seed);
    ShapeSurface on_the_way = surface;
    for (const auto& projector : surface.approach) {
        on_the_way.project = projector;
        settle(on_the_way, rings);
    }
    for (Vector& p : rings.positions) p = surface.project(p);
    SurfaceMesh mesh = rings;
    scatter_and_relax(surface, seed + 1, mesh);
    // A few triangles on a thin shape may cut through each other once scattered. The rings do not.
    constexpr Index few = 500;
    return vertices < few && !self_intersections(mesh, 1).empty() ? rings : mesh;
}

std::function<Vector(const Vector&)> implicit_projector(std::function<double(const Vector&)> f, double step) {
    return [f = std::move(f), step](const Vector& start) {
        Vector x = start;
        for (int iteration = 0; iteration < 4; ++iteration) {
            const double value = f(x);
            if (std::abs(value) < 1e-14) break;
            Vector gradient;
            for (int axis = 0; axis < 3; ++axis) {
                const Vector d = step * Vector::Unit(axis);
                gradient[axis] = (f(x + d) - f(x - d)) / (2 * step);
            }
            const double square = gradient.squaredNorm();
            if (!(square > 0)) break;
            x -= value / square * gradient;
        }
        return x;
    };
}

}  // namespace innerspring
