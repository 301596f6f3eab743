#include "innerspring/sim/tool.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/topology.h"

namespace innerspring {

Tool plane_tool(const Vector& point, const Vector& normal, double friction) {
    Tool tool{"plane", ToolShape::plane, 0, 0, {}, friction};
    tool.path[0].pose = {point, Eigen::Quaterniond::FromTwoVectors(Vector(Vector::UnitZ()), normal)};
    return tool;
}

Tool sphere_tool(double radius, const Vector& position, double friction) {
    Tool tool{"sphere", ToolShape::sphere, radius, 0, {}, friction};
    tool.path[0].pose.position = position;
    return tool;
}

Tool capsule_tool(double radius, double length, const Pose& pose, double friction) {
    return {"capsule", ToolShape::capsule, radius, length, {}, friction, {{0, pose}}};
}

Tool mesh_tool(SurfaceMesh mesh, const Pose& pose, double friction) {
    auto field = std::make_shared<const DistanceField>(build_distance_field(std::move(mesh)));
    return {"mesh", ToolShape::mesh, 0, 0, std::move(field), friction, {{0, pose}}};
}

Pose pose_at(const Tool& tool, double time) {
    const auto& path = tool.path;
    const auto after = std::upper_bound(path.begin(), path.end(), time,
                                        [](double t, const PosePoint& p) { return t < p.time; });
    if (after == path.begin()) return path.front().pose;
    if (after == path.end()) return path.back().pose;
    const PosePoint &a = *(after - 1), &b = *after;
    const double s = (time - a.time) / (b.time - a.time);
    return {a.pose.position + s * (b.pose.position - a.pose.position),
            a.pose.rotation.slerp(s, b.pose.rotation)};
}

void move_to(Tool& tool, double time, double dt, const Pose& target) {
    const Pose now = pose_at(tool, time);
    tool.path.resize(2);
    tool.path[0] = {time, now};
    tool.path[1] = {time + dt, target};
}

namespace {

/// A sphere passes between vertices half a side s apart by s^2 / (8 r): with s up to this share of its radius
/// that is at most 1 % of it.
constexpr double fine_share = 0.25;

/// Steeper than this (a sine) a corner or side of a mesh is sharp: it has to be met at itself.
constexpr double sharp = 0.125;

/// The same for a point of a mesh with the normal n from which the surface falls to its neighbours as a
/// sphere of radius L^2 / (2 drop) would, L their distance.
double fine_side_at(const Vector& x, const Vector& n, std::span<const Vector> neighbours) {
    double least = std::numeric_limits<double>::infinity();
    for (const Vector& w : neighbours) {
        const double L = (w - x).norm(), drop = -n.dot(w - x);
        if (drop > sharp * L) return 0;
        if (drop > 0) least = std::min(least, fine_share * L * L / (2 * drop));
    }
    return least;
}

}  // namespace

Probes probes_of(const Tool& tool, double spacing) {
    Probes probes{{}, tool.radius, {}};
    const auto along = [&](const Vector& a, const Vector& b, double step) {  // between the ends
        const double pieces = std::clamp(std::ceil((b - a).norm() / step), 1.0, 1000.0);
        for (double n = 1; n < pieces; ++n) probes.centres.push_back(a + n / pieces * (b - a));
    };
    switch (tool.shape) {
        case ToolShape::plane:
            break;
        case ToolShape::sphere:
            probes.centres = {Vector::Zero()};
            break;
        case ToolShape::capsule: {
            // Half a radius apart they leave out 3 % of it.
            const Vector end(0, 0, tool.length / 2);
            probes.centres = {-end, end};
            along(-end, end, tool.radius / 2);
            break;
        }
        case ToolShape::mesh: {
            const SurfaceMesh& mesh = tool.mesh->mesh;
            probes.radius = 0;
            const auto& x = mesh.positions;
            probes.centres = x;
            const Topology topology = build_topology(x.size(), mesh.triangles);
            std::vector<std::vector<Vector>> around(x.size());
            for (const Edge& e : topology.edges) around[e.a].push_back(x[e.b]), around[e.b].push_back(x[e.a]);
            for (std::size_t i = 0; i < x.size(); ++i)
                probes.fine_side.push_back(
                    fine_side_at(x[i], tool.mesh->corner_normals[i].stableNormalized(), around[i]));
            for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
                for (int k = 0; k < 3; ++k) {
                    const Triangle& c = mesh.triangles[t];
                    const Vector &a = x[c[k]], &b = x[c[(k + 1) % 3]];
                    if (c[k] > c[(k + 1) % 3]) continue;
                    along(a, b, spacing);
                    std::vector<Vector> beside;
                    const Vector along_side = (b - a).stableNormalized();
                    for (Index other : topology.edge_triangles[topology.triangle_edges[t][k]])
                        for (Index i : mesh.triangles[other])
                            if (i != c[k] && i != c[(k + 1) % 3])  // straight across the side
                                beside.push_back(x[i] - along_side.dot(x[i] - a) * along_side);
                    probes.fine_side.resize(
                        probes.centres.size(),
                        fine_side_at(a, tool.mesh->normals[t][k].stableNormalized(), beside));
                }
            return probes;
        }
    }
    probes.fine_side.assign(probes.centres.size(), fine_share * probes.radius);
    return probes;
}

double overlap(const Tool& tool, double time, const SurfaceMesh& surface) {
    const Pose pose = pose_at(tool, time);
    const Eigen::Matrix3d R = pose.rotation.normalized().toRotationMatrix();
    const double bound = tool.shape == ToolShape::plane  ? std::numeric_limits<double>::infinity()
                         : tool.shape == ToolShape::mesh ? tool.mesh->radius
                                                         : tool.radius + tool.length / 2;
    double depth = 0;
    Box box{surface.positions[0], surface.positions[0]};
    for (const Vector& x : surface.positions) {
        box.lower = box.lower.cwiseMin(x), box.upper = box.upper.cwiseMax(x);
        const Vector local = R.transpose() * (x - pose.position);
        if (local.norm() < bound) depth = std::max(depth, -nearest(tool, local).distance);
    }
    Probes probes = probes_of(tool, bound / 16);
    std::erase_if(probes.centres, [&](Vector& c) {
        c = R * c + pose.position;
        return !overlap(box, {c - Vector::Constant(probes.radius), c + Vector::Constant(probes.radius)});
    });
    if (probes.centres.empty()) return depth;
    const DistanceField field = build_distance_field(surface);
    for (const Vector& c : probes.centres)
        depth = std::max(depth, probes.radius - nearest(field, c).distance);
    return depth;
}

void require_valid(const Tool& tool) {
    const auto refuse = [&tool](const std::string& what) {
        throw InputError(fmt::format("tool '{}': {}", tool.name, what));
    };
    const auto check_length = [&](double value, const char* what, bool zero) {
        if (!(std::isfinite(value) && (value > 0 || (zero && value == 0))))
            refuse(fmt::format("{} is {:g} m; it must be {}", what, value,
                               zero ? "finite and not negative" : "positive and finite"));
    };
    if (tool.shape == ToolShape::sphere || tool.shape == ToolShape::capsule)
        check_length(tool.radius, "radius", false);
    if (tool.shape == ToolShape::sphere && tool.length != 0) refuse("a sphere has no length");
    if (tool.shape == ToolShape::capsule) check_length(tool.length, "length", true);
    if (tool.shape == ToolShape::mesh && !tool.mesh) refuse("has no mesh");
    if (!(tool.friction >= 0 && std::isfinite(tool.friction)))
        refuse(fmt::format("friction is {:g}; it must be finite and not negative", tool.friction));
    if (tool.path.empty()) refuse("its path is empty; say where it is");
    for (std::size_t n = 0; n < tool.path.size(); ++n) {
        const PosePoint& p = tool.path[n];
        if (!std::isfinite(p.time) || (n > 0 && !(p.time > tool.path[n - 1].time)))
            refuse(fmt::format("the times of its path must be finite and increasing; entry {} is {:g} s", n,
                               p.time));
        if (!p.pose.position.allFinite() || !(std::abs(p.pose.rotation.norm() - 1) < 1e-6))
            refuse(
                fmt::format("its pose at {:g} s needs a finite position and a rotation of norm 1", p.time));
    }
}

}  // namespace innerspring
