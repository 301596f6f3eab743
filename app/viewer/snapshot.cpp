#include "snapshot.h"

#include <algorithm>
#include <cmath>

#include "innerspring/haptic/body_side.h"
#include "innerspring/mesh/topology.h"
#include "rig.h"

namespace innerspring::viewer {

Surface surface_of(const SurfaceMesh& rest) {
    Surface s;
    s.name = rest.name.substr(rest.name.find_last_of('/') + 1);  // of a file without its folder
    s.rest = rest.positions;
    s.triangles = rest.triangles;
    s.edges = build_topology(rest.positions.size(), rest.triangles).edges;
    s.area = vertex_areas(rest.positions, rest.triangles);
    s.spacing.assign(s.rest.size(), 0);
    std::vector<int> count(s.rest.size(), 0);
    for (const Edge& e : s.edges) {
        const double length = (s.rest[e.a] - s.rest[e.b]).norm();
        for (Index i : {e.a, e.b}) s.spacing[i] += length, ++count[i];
    }
    for (std::size_t i = 0; i < count.size(); ++i) s.spacing[i] /= std::max(1, count[i]);
    if (!s.rest.empty()) std::tie(s.lower, s.upper) = bounding_box(s.rest);
    s.radius = volume_radius(volume(s.rest, s.triangles));
    return s;
}

namespace {

/// A body at one moment, whoever steps it.
struct Seen {
    const Body& body;
    const State& state;
    const Loads& loads;
    const Workspace& workspace;
    const ContactReport* contact;  ///< null: none with these tools on this mesh
    const Force* hand_force;
    const Tool* hand_tool;
    std::uint64_t mesh_version;
};

Seen seen(const Simulation& s) {
    return {s.body(),    s.state(),      s.loads(),     s.workspace(),
            s.contact(), s.hand_force(), s.hand_tool(), s.mesh_version()};
}

std::shared_ptr<const Surface> surface_now(const Seen& from, const Surface* before) {
    const Body& body = from.body;
    Surface s;
    if (before && before->mesh_version == from.mesh_version)
        s = *before;  // other masses and springs only
    else
        s = surface_of(body.rest);
    s.m = body.m, s.K = body.K, s.L = body.L, s.N = body.N;
    s.fibre.clear();
    for (Index i = 0; i < body.N.size(); ++i) s.fibre.push_back(fibre_direction(body, i));
    s.centre = body.centre;
    s.mesh_version = from.mesh_version;
    return std::make_shared<const Surface>(std::move(s));
}

/// Where the line along which a tool is pressed comes out of it. With the torque r x F about the tool's own
/// origin the line's nearest point to that is F x (r x F) / F^2.
Vector way_out(const Tool& tool, const Pose& pose, const ToolContact& felt) {
    const double squared = felt.force.squaredNorm();
    if (!(squared > 0)) return pose.position;
    const Eigen::Quaterniond back = pose.rotation.conjugate();
    const Vector from = back * (felt.force.cross(felt.torque) / squared),
                 along = back * (-felt.force / std::sqrt(squared));
    double s = 0;
    if (tool.shape == ToolShape::plane) {
        if (along.z() > 1e-3) s = -from.z() / along.z();
    } else {
        double size = tool.radius + tool.length / 2;
        if (tool.mesh)
            for (const Vector& x : tool.mesh->mesh.positions) size = std::max(size, x.norm());
        // From outside inwards, by as much as is free each time.
        const double outside = size + from.norm();
        s = outside;
        for (int n = 0; n < 64 && s > -outside; ++n) {
            const double free = nearest(tool, from + s * along).distance;
            if (free <= 1e-3 * size) break;
            s -= free;
        }
        if (s <= -outside) s = 0;  // the line passes the tool
    }
    return pose.position + pose.rotation * (from + s * along);
}

void capture_tools(const Seen& from, BodySnapshot& to) {
    to.tools.clear();
    for (const Tool& tool : from.loads.tools) {
        to.tools.push_back(tool_at(tool, from.state.time));
        to.tools.back().hand = &tool == from.hand_tool;
    }
    to.pressed.clear();
    const ContactReport* report = from.contact;
    if (!report) return;
    for (std::size_t n = 0; n < to.tools.size(); ++n) {
        TouchingTool& tool = to.tools[n];
        tool.newton = -report->tools[n].force;
        tool.place = way_out(tool.tool, tool.pose(), report->tools[n]);
    }
    for (const VertexContact& vertex : report->vertices)
        to.pressed.emplace_back(vertex.vertex, pressure(from.body, vertex));
}

void capture_body(const Seen& from, BodySnapshot& to) {
    const Body& body = from.body;
    const State& state = from.state;
    const auto& q = body.rest.positions;
    to.u.resize(q.size());
    for (std::size_t i = 0; i < q.size(); ++i)
        for (int k = 0; k < 3; ++k) to.u[i][k] = float(state.x[i][k] - q[i][k]);
    Team alone(1);
    to.frame = home_frame(body, state.x, alone);
    to.scheme = body.scheme;
    to.material = body.material;
    to.integrator = to_string(from.workspace.integrator());
    to.precision = to_string(from.workspace.precision());
    to.substeps = from.workspace.substeps();
    const Measures now = measure(body, from.loads, state);
    to.volume_variation_percent = now.volume_variation_percent;
    to.pressure = now.pressure;
    to.kinetic = now.kinetic, to.elastic = now.elastic, to.potential = now.potential;
    to.max_displacement = now.max_displacement;
    to.pulls.clear();
    for (const Force& force : from.loads.forces)
        to.pulls.push_back({at(force.profile, state.time) * force.newton, mean_place(force, state),
                            force.radius, &force == from.hand_force});
    capture_tools(from, to);
    to.pinned.clear();
    for (const Pin& pin : from.loads.pins)
        to.pinned.insert(to.pinned.end(), pin.vertices.begin(), pin.vertices.end());
}

}  // namespace

double force_sum(const BodySnapshot& body) {
    double sum = 0;
    for (const Pull& pull : body.pulls) sum += pull.newton.norm();
    return sum;
}

double tool_force_sum(const BodySnapshot& body) {
    double sum = 0;
    for (const TouchingTool& tool : body.tools) sum += tool.newton.norm();
    return sum;
}

double most_pressure(const BodySnapshot& body) {
    double most = 0;
    for (const auto& [vertex, pascal] : body.pressed) most = std::max(most, pascal);
    return most;
}

double arrow_length(const BodySnapshot& body, double newton) {
    const double R = body.surface->radius, E = body.material.young;
    return std::min(0.15 + 1.5 * std::sqrt(newton / (E * R * R)), 2.0) * R;
}

TouchingTool tool_at(const Tool& tool, double time) {
    const Pose pose = pose_at(tool, time);
    TouchingTool now;
    now.tool = {tool.name, tool.shape, tool.radius, tool.length, tool.mesh, tool.friction, {{time, pose}}};
    now.place = pose.position;
    return now;
}

void Capture::operator()(const Rig& rig, Snapshot& into) {
    known_.resize(rig.size());
    into.bodies.resize(rig.size());
    for (std::size_t n = 0; n < rig.size(); ++n) {
        if (!known_[n].surface || known_[n].version != rig[n].body_version())
            known_[n] = {surface_now(seen(rig[n]), known_[n].surface.get()), rig[n].body_version()};
        into.bodies[n].surface = known_[n].surface;
        capture_body(seen(rig[n]), into.bodies[n]);
    }
    into.time = rig[0].state().time;
    into.dt = rig[0].dt();
    into.ticks = rig.ticks();
    into.gravity = rig[0].loads().gravity;
    into.replaying = rig.replaying();
    for (std::size_t n = 0; n < rig.size(); ++n)
        if (!rig[n].failure().empty()) into.message = rig[n].failure();
}

void Capture::operator()(const BodySide& side, std::size_t tool, Snapshot& into) {
    const auto& contact = side.workspace().contact();
    const bool met = contact.tools.size() == side.loads().tools.size();  // not before the first step
    const Seen from{side.body(),
                    side.state(),
                    side.loads(),
                    side.workspace(),
                    met ? &contact : nullptr,
                    nullptr,
                    &side.loads().tools[tool],
                    side.mesh_version()};
    known_.resize(1);
    into.bodies.resize(1);
    if (!known_[0].surface || known_[0].version != side.mesh_version())
        known_[0] = {surface_now(from, nullptr), side.mesh_version()};
    into.bodies[0].surface = known_[0].surface;
    capture_body(from, into.bodies[0]);
    into.time = side.state().time;
    into.gravity = side.loads().gravity;
}

}  // namespace innerspring::viewer
