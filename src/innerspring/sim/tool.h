#pragma once
#include <algorithm>
#include <memory>
#include <string>

#include "innerspring/mesh/signed_distance.h"

namespace innerspring {

/// Where a rigid thing is: x = rotation * local + position.
struct Pose {
    Vector position = Vector::Zero();                              ///< [m]
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< unit
};

struct PosePoint {
    double time = 0;  ///< [s]
    Pose pose;
};

enum class ToolShape {
    plane,    ///< all below its own z = 0: a floor or a flat punch
    sphere,   ///< of `radius` about its own origin
    capsule,  ///< all within `radius` of an axis of `length` along its own z, its middle at the origin
    mesh      ///< a closed surface
};

/// A rigid thing that pushes the body and is moved from outside; with one pose, an obstacle at rest.
struct Tool {
    std::string name;
    ToolShape shape = ToolShape::sphere;
    double radius = 0;  ///< [m]
    double length = 0;  ///< [m], without the round ends
    std::shared_ptr<const DistanceField> mesh;
    double friction = 0;              ///< Coulomb's coefficient [1]
    std::vector<PosePoint> path{{}};  ///< increasing in time: linear and slerp between, at rest outside
};

Tool plane_tool(const Vector& point, const Vector& normal, double friction = 0);
Tool sphere_tool(double radius, const Vector& position, double friction = 0);
Tool capsule_tool(double radius, double length, const Pose& pose, double friction = 0);
Tool mesh_tool(SurfaceMesh mesh, const Pose& pose, double friction = 0);

Pose pose_at(const Tool& tool, double time);

/// For a mouse or a device: from where the tool is at `time` [s] to `target` within dt [s], then at rest.
/// Forgets the path. Does not allocate, but the first time for a tool of one pose.
void move_to(Tool& tool, double time, double dt, const Pose& target);

/// Signed distance to the tool's surface [m] and the unit normal there, of a point in the tool's own frame;
/// infinite where a mesh is farther than `within` [m].
inline Nearest nearest(const Tool& tool, const Vector& p,
                       double within = std::numeric_limits<double>::infinity()) {
    if (tool.shape == ToolShape::plane) return {p.z(), Vector::UnitZ()};
    if (tool.shape == ToolShape::mesh) return nearest(*tool.mesh, p, within);
    const double half = tool.length / 2;
    const Vector d(p.x(), p.y(), p.z() - std::clamp(p.z(), -half, half));
    const double r = d.norm();
    return {r - tool.radius, r > 0 ? Vector(d / r) : Vector(Vector::UnitX())};
}

/// What the tool touches faces with: balls within it, in its own frame. Where the triangles of the body are
/// large beside the tool it can pass between the vertices, but not its probes.
struct Probes {
    std::vector<Vector> centres;  ///< [m]; none: the vertices of the body are enough (a plane)
    double radius = 0;            ///< [m]
    /// Per probe: against triangles with no longer side [m] it is not needed, as what sticks out of the tool
    /// there goes between vertices by a small part of that side only.
    std::vector<double> fine_side;
};

/// `spacing` [m]: as far apart as probes along the sides of a mesh may be.
Probes probes_of(const Tool& tool, double spacing);

/// How deep the tool as it is at `time` lies in the closed surface, or vertices of that in it [m]; 0 if they
/// do not overlap.
double overlap(const Tool& tool, double time, const SurfaceMesh& surface);

/// Throws InputError naming the tool: numbers not finite or out of range, no mesh, a path without points or
/// not increasing in time.
void require_valid(const Tool& tool);

}  // namespace innerspring
