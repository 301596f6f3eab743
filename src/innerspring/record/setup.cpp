#include "innerspring/record/setup.h"

#include <fmt/format.h>

#include <cmath>

#include "innerspring/mesh/check.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/nearest_name.h"
#include "innerspring/mesh/read.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/weld.h"
#include "innerspring/record/fibres.h"

namespace innerspring {

namespace {

double metres_per(const std::string& unit) {
    if (unit == "m") return 1;
    if (unit == "cm") return 1e-2;
    if (unit == "mm") return 1e-3;
    throw InputError(fmt::format("unit '{}': expected mm, cm or m", unit));
}

Index existing_vertex(std::int64_t vertex, const Body& body, std::string_view what) {
    if (vertex < 0 || std::size_t(vertex) >= body.vertices())
        throw InputError(fmt::format("{}: vertex {} does not exist; the welded mesh has 0 to {}", what,
                                     vertex, body.vertices() - 1));
    return Index(vertex);
}

}  // namespace

LoadedMesh load_mesh(const std::string& mesh, const std::string& unit, std::optional<bool> normalize_asked,
                     double weld_tolerance) {
    LoadedMesh loaded;
    if (is_shape(mesh)) {
        if (!unit.empty())
            throw InputError(fmt::format("{}: built-in shapes are in metres; leave the unit out", mesh));
        loaded.mesh = make_shape(mesh);
    } else {
        if (const std::string shape = nearest_name(mesh.substr(0, mesh.find(':')), shape_names());
            !shape.empty() && !std::filesystem::exists(mesh))
            throw InputError(
                fmt::format("{}: no such file or built-in shape; did you mean {}?", mesh, shape));
        const SurfaceMesh file = read(mesh);
        Welded welded = weld(file, {weld_tolerance});
        loaded.mesh = std::move(welded.mesh);
        if (welded.merged > 0)
            loaded.notes.push_back(
                fmt::format("{} of {} vertices merged by position", welded.merged, file.positions.size()));
        if (welded.unused > 0)
            loaded.notes.push_back(fmt::format("{} unused vertices dropped", welded.unused));
    }
    const bool from_file = !is_shape(mesh);
    if (normalize_asked.value_or(from_file && unit.empty())) {
        require_usable(loaded.mesh);
        const double factor = normalize(loaded.mesh);
        loaded.notes.push_back(
            fmt::format("{}scaled by {:.6g} to unit volume radius, centroid at the origin",
                        normalize_asked ? "" : "no unit given (--unit mm|cm|m): ", factor));
    } else if (from_file) {
        const double factor = metres_per(unit.empty() ? "m" : unit);
        for (Vector& p : loaded.mesh.positions) p *= factor;
    }
    return loaded;
}

Force to_force(const SceneForce& f, const Body& body) {
    const std::string what = f.name.empty() ? "force" : "force '" + f.name + "'";
    if (!f.vertex && !f.near) throw InputError(what + ": say where: vertex or near");
    const Index vertex =
        f.vertex ? existing_vertex(*f.vertex, body, what) : nearest_vertex(body.rest.positions, *f.near);
    Vector newton;
    if (f.newton)
        newton = *f.newton;
    else if (f.inward)
        newton = -*f.inward * vertex_normals(body.rest.positions, body.rest.triangles)[vertex];
    else
        throw InputError(what + ": say how much: newton or inward");
    Force force = f.radius > 0 ? patch_force(body, vertex, f.radius, newton) : point_force(vertex, newton);
    if (!f.name.empty()) force.name = f.name;

    force.profile.points = f.profile;
    if (f.profile.empty() && (f.start > 0 || f.ramp > 0 || f.end)) {
        // On from start, in full after ramp; off at end, over ramp again. A jump takes the smallest time
        // there is.
        auto& points = force.profile.points;
        const double full = f.ramp > 0 ? f.start + f.ramp : std::nextafter(f.start, INFINITY);
        points = {{f.start, 0.0}, {full, 1.0}};
        if (f.end) {
            if (!(*f.end > full))
                throw InputError(fmt::format("{}: it ends at {:g} s, before it is on in full at {:g} s", what,
                                             *f.end, full));
            points.push_back({*f.end, 1.0});
            points.push_back({f.ramp > 0 ? *f.end + f.ramp : std::nextafter(*f.end, INFINITY), 0.0});
        }
    }
    return force;
}

Pin to_pin(const ScenePin& p, const Body& body) {
    Pin pin;
    for (std::int64_t v : p.vertices) pin.vertices.push_back(existing_vertex(v, body, "pin"));
    if (p.near) {
        const Index nearest = nearest_vertex(body.rest.positions, *p.near);
        for (Index i = 0; i < body.vertices(); ++i)
            if (i == nearest || (body.rest.positions[i] - *p.near).norm() <= p.radius)
                pin.vertices.push_back(i);
    }
    if (pin.vertices.empty()) throw InputError("pin: say where: vertices or near");
    pin.path = p.path;
    return pin;
}

Tool to_tool(const SceneTool& t) {
    Tool tool;
    tool.name = t.name;
    tool.friction = t.friction;
    Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();
    if (const auto& z = t.normal ? t.normal : t.axis)
        turned = Eigen::Quaterniond::FromTwoVectors(Vector(Vector::UnitZ()), z->stableNormalized());
    if (t.normal) {
        tool.shape = ToolShape::plane;
    } else if (!t.mesh.empty()) {
        tool.shape = ToolShape::mesh;
        SurfaceMesh mesh = weld(is_shape(t.mesh) ? make_shape(t.mesh) : read(t.mesh)).mesh;
        for (Vector& x : mesh.positions) x *= t.scale;
        tool.mesh = std::make_shared<const DistanceField>(build_distance_field(std::move(mesh)));
    } else {
        tool.shape = t.length > 0 ? ToolShape::capsule : ToolShape::sphere;
        tool.radius = t.radius.value_or(0), tool.length = t.length;
    }
    tool.path.clear();
    if (t.at) tool.path.push_back({0, {*t.at, turned}});
    for (const auto& [time, x, y, z, w, i, j, k] : t.path) {
        const Eigen::Vector4d q = Eigen::Vector4d(w, i, j, k).stableNormalized();
        tool.path.push_back({time, {{x, y, z}, Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * turned}});
    }
    return tool;
}

Setup set_up(const Scene& scene) {
    LoadedMesh loaded = load_mesh(scene.mesh, scene.unit, scene.normalize, scene.weld);
    Material material = scene.material;
    if (Anisotropy& a = material.anisotropy; a.course == Anisotropy::Course::field && !a.field)
        a.field = nearest_fibre(read_fibres(a.file));
    Setup setup{build_body(std::move(loaded.mesh), material, {scene.scheme, scene.centre, scene.free}),
                {},
                {},
                std::move(loaded.notes)};
    setup.loads.gravity = scene.gravity;
    for (const SceneForce& f : scene.forces) {
        setup.loads.forces.push_back(to_force(f, setup.body));
        if (f.name.empty())
            setup.loads.forces.back().name = fmt::format("force{}", setup.loads.forces.size());
    }
    for (const ScenePin& p : scene.pins) setup.loads.pins.push_back(to_pin(p, setup.body));
    for (const SceneTool& t : scene.tools) {
        setup.loads.tools.push_back(to_tool(t));
        if (t.name.empty()) setup.loads.tools.back().name = fmt::format("tool{}", setup.loads.tools.size());
    }
    for (const SceneRefine& r : scene.refine) {
        RefineRule rule{r.at,     Vector::Zero(),          r.radius, r.edge_share.value_or(0),
                        r.levels, r.tool_share.value_or(0)};
        if (r.vertex)
            rule.place = setup.body.rest.positions[existing_vertex(*r.vertex, setup.body, "refine")];
        if (r.near)
            rule.place = setup.body.rest.positions[nearest_vertex(setup.body.rest.positions, *r.near)];
        setup.refine.push_back(rule);
    }
    require_valid(setup.body, setup.loads);
    return setup;
}

Subject describe(const Scene& scene, const Setup& setup) {
    const Body& body = setup.body;
    double force = 0;
    for (const Force& f : setup.loads.forces) force = std::max(force, f.newton.stableNorm());
    return {
        body.rest.name,      body.vertices(), body.rest.triangles.size(),
        body.volume,         body.scheme,     body.centre,
        scene.material_name, body.material,   dimensionless_groups(body, setup.loads.gravity.norm(), force)};
}

}  // namespace innerspring
