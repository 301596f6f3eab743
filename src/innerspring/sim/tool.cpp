#include "innerspring/sim/tool.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/error.h"

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

Probes probes_of(const Tool& tool, double spacing) {
    Probes probes{{}, tool.radius};
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
            probes.centres = mesh.positions;
            for (const Triangle& t : mesh.triangles)
                for (int k = 0; k < 3; ++k)
                    if (t[k] < t[(k + 1) % 3])
                        along(mesh.positions[t[k]], mesh.positions[t[(k + 1) % 3]], spacing);
            break;
        }
    }
    return probes;
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
