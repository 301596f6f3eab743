#include "innerspring/sim/loads.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

/// Linear between points sorted by time, constant outside.
template <class T>
T interpolate(const std::vector<std::pair<double, T>>& points, double time) {
    auto after = std::upper_bound(points.begin(), points.end(), time,
                                  [](double t, const auto& p) { return t < p.first; });
    if (after == points.begin()) return points.front().second;
    if (after == points.end()) return points.back().second;
    const auto& [t0, a] = *(after - 1);
    const auto& [t1, b] = *after;
    return a + (time - t0) / (t1 - t0) * (b - a);
}

template <class T>
void require_increasing(const std::vector<std::pair<double, T>>& points, const char* what) {
    for (std::size_t n = 0; n < points.size(); ++n)
        if (!std::isfinite(points[n].first) || (n > 0 && !(points[n].first > points[n - 1].first)))
            throw InputError(fmt::format("{}: its times must be finite and increasing; entry {} is {:g} s",
                                         what, n, points[n].first));
}

}  // namespace

double at(const Profile& profile, double time) {
    return profile.points.empty() ? 1.0 : interpolate(profile.points, time);
}

Vector offset_at(const Pin& pin, double time) {
    return pin.path.empty() ? Vector(Vector::Zero()) : interpolate(pin.path, time);
}

Force point_force(Index vertex, const Vector& newton) {
    return {"point", {vertex}, {1.0}, newton, {}, vertex, 0};
}

Force patch_force(const Body& body, Index vertex, double radius, const Vector& newton) {
    if (vertex >= body.vertices())
        throw InputError(
            fmt::format("patch force: vertex {} does not exist; the mesh has {}", vertex, body.vertices()));
    if (!(radius > 0 && std::isfinite(radius)))
        throw InputError(fmt::format("patch force: radius {:g} m must be positive", radius));
    Force force{"patch", {}, {}, newton, {}, vertex, radius};
    const auto& q = body.rest.positions;
    // A_i: each triangle of the vertex is met from two of its edges.
    auto area = [&](Index i) {
        double A = 0;
        for (const Spoke& spoke : body.spokes_of(i))
            for (Index t : body.edge_triangles[spoke.edge])
                A += double_area_vector(q, body.rest.triangles[t]).norm() / 12;
        return A;
    };
    force.vertices = vertices_around(body, vertex, radius);
    double sum = 0;
    for (Index i : force.vertices) {
        const double d2 = (q[i] - q[vertex]).squaredNorm() / (radius * radius);
        force.weights.push_back((1 - d2) * (1 - d2) * area(i));
        sum += force.weights.back();
    }
    for (double& w : force.weights) w /= sum;
    return force;
}

void require_valid(const Body& body, const Loads& loads) {
    if (!loads.gravity.allFinite()) throw InputError("gravity must be finite");
    for (const Force& f : loads.forces) {
        if (!f.newton.allFinite()) throw InputError(fmt::format("force '{}' is not finite", f.name));
        if (f.vertices.size() != f.weights.size() || f.vertices.empty())
            throw InputError(
                fmt::format("force '{}' needs one weight per vertex and at least one vertex", f.name));
        for (double w : f.weights)
            if (!std::isfinite(w))
                throw InputError(fmt::format("force '{}': a weight is not finite", f.name));
        for (Index i : f.vertices)
            if (i >= body.vertices())
                throw InputError(fmt::format("force '{}': vertex {} does not exist; the mesh has {}", f.name,
                                             i, body.vertices()));
        require_increasing(f.profile.points, "force profile");
        for (const auto& [time, factor] : f.profile.points)
            if (!std::isfinite(factor))
                throw InputError(
                    fmt::format("force '{}': its profile is not finite at {:g} s", f.name, time));
    }
    std::vector<bool> pinned(body.vertices(), false);
    for (const Pin& pin : loads.pins) {
        for (Index i : pin.vertices) {
            if (i >= body.vertices())
                throw InputError(
                    fmt::format("pin: vertex {} does not exist; the mesh has {}", i, body.vertices()));
            if (pinned[i]) throw InputError(fmt::format("pin: vertex {} is pinned twice", i));
            pinned[i] = true;
        }
        require_increasing(pin.path, "pin path");
        for (const auto& [time, offset] : pin.path)
            if (!offset.allFinite())
                throw InputError(fmt::format("pin: the path is not finite at {:g} s", time));
    }
    for (const Tool& tool : loads.tools) require_valid(tool);
}

}  // namespace innerspring
