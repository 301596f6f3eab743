#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "innerspring/mesh/shapes.h"
#include "innerspring/record/scene.h"
#include "innerspring/record/scene_table.h"

namespace innerspring {

namespace {

using namespace scene_text;

constexpr double most_steps = 1e9;

void read_material(const Table& t, Scene& scene) {
    t.read("name", scene.material_name);
    t.read_word("name", scene.material, tissue_material);
    Material& m = scene.material;
    if (t.find("mass_kg") && t.find("density_kg_m3"))
        t.refuse("mass_kg", "and density_kg_m3 exclude each other");
    if (t.find("surface_n_m") && t.find("surface_ratio"))
        t.refuse("surface_n_m", "and surface_ratio exclude each other");
    if (t.find("mass_kg")) m.density.reset();
    if (t.find("surface_n_m")) m.surface_ratio.reset();
    t.read("mass_kg", m.mass, Range::positive);
    t.read("density_kg_m3", m.density, Range::positive);
    t.read("young_pa", m.young, Range::positive);
    t.read("surface_n_m", m.surface, Range::not_negative);
    t.read("surface_ratio", m.surface_ratio, Range::not_negative);
    t.read("damping_ratio", m.damping, Range::not_negative);
    t.read("poisson", m.poisson, Range::not_negative);
    if (m.poisson > 0.5) t.refuse("poisson", fmt::format("is {:g}; it must be from 0 to 0.5", m.poisson));
}

Anisotropy read_anisotropy(const Table& t) {
    using Kind = Anisotropy::Kind;
    using Course = Anisotropy::Course;
    Anisotropy a;
    if (!t.find("kind")) t.refuse("needs kind: isotropic, radial, fibres or orthotropic");
    t.read_word("kind", a.kind, parse_anisotropy);
    for (const char* key :
         {"along_pa", "across_pa", "direction", "around", "through", "pitch_deg", "outward", "field"})
        if (t.find(key) && a.kind != Kind::fibres) t.refuse(key, "goes with kind = \"fibres\"");
    for (const char* key : {"moduli_pa", "axes"})
        if (t.find(key) && a.kind != Kind::orthotropic) t.refuse(key, "goes with kind = \"orthotropic\"");
    if (a.kind == Kind::fibres) {
        if (!t.find("along_pa")) t.refuse("needs along_pa, the modulus along the fibres");
        if (bool(t.find("direction")) + bool(t.find("around")) + bool(t.find("outward")) +
                bool(t.find("field")) !=
            1)
            t.refuse("needs exactly one of direction, around, outward and field");
        for (const char* key : {"through", "pitch_deg"})
            if (t.find(key) && !t.find("around")) t.refuse(key, "goes with around");
        t.read("along_pa", a.along, Range::positive);
        t.read("across_pa", a.across, Range::positive);
        t.read("direction", a.direction);
        t.read("around", a.direction);
        t.read("through", a.through);
        t.read("outward", a.through);
        a.pitch_deg = 0;
        t.read("pitch_deg", a.pitch_deg, Range::finite);
        t.read("field", a.file);
        a.course = t.find("around")    ? Course::around
                   : t.find("outward") ? Course::outward
                   : t.find("field")   ? Course::field
                                       : Course::straight;
        for (const char* key : {"direction", "around"})
            if (t.find(key) && !(a.direction.stableNorm() > 0)) t.refuse(key, "must not be zero");
        if (t.find("field") && (a.file.empty() || a.file.find('\0') != std::string::npos))
            t.refuse("field", "must name a file");
    }
    if (a.kind == Kind::orthotropic) {
        if (!t.find("moduli_pa")) t.refuse("needs moduli_pa, the three moduli");
        t.read("moduli_pa", a.moduli);
        if (!(a.moduli.minCoeff() > 0)) t.refuse("moduli_pa", "must be three positive numbers");
        Vector first = Vector::UnitX(), second = Vector::UnitY();
        t.read_two("axes", first, second);
        if (!(std::abs(first.stableNormalized().dot(second.stableNormalized())) < 1e-6) ||
            !(first.stableNorm() > 0 && second.stableNorm() > 0))
            t.refuse("axes", "must be two directions at right angles; the third is across both");
        first.stableNormalize(), second.stableNormalize();
        a.axes << first, second, first.cross(second);
    }
    return a;
}

void read_body(const Table& t, Scene& scene) {
    t.read_word("scheme", scene.scheme, parse_scheme);
    if (const toml::node* node = t.find("centre"); node && node->is_array()) {
        scene.centre.kind = CentreKind::given;
        t.read("centre", scene.centre.position);
    } else {
        t.read_word("centre", scene.centre, parse_centre);
    }
    t.read("free", scene.free);
}

void read_simulation(const Table& t, Scene& scene) {
    constexpr int most = std::numeric_limits<int>::max();
    t.read("gravity_m_s2", scene.gravity);
    t.read("duration_s", scene.duration, Range::not_negative);
    t.read("dt_s", scene.step.dt, Range::positive);
    if (!(scene.duration / scene.step.dt <= most_steps))
        t.refuse(t.find("dt_s") ? "dt_s" : "duration_s",
                 fmt::format("asks for {:.3g} steps; at most {:g} are allowed",
                             scene.duration / scene.step.dt, most_steps));
    t.read_word("integrator", scene.step.integrator, parse_integrator);
    t.read_word("precision", scene.step.precision, parse_precision);
    t.read("threads", scene.step.threads, 0, 1024);
    t.read("max_substeps", scene.step.max_substeps, 1, most);
    t.read("tolerance", scene.step.tolerance, Range::positive);
    t.read("max_iterations", scene.step.max_iterations, 1, most);
    t.read("linearised", scene.step.linearised);
    t.read("equilibrium", scene.equilibrium);
    t.read("residual_n", scene.residual_n, Range::not_negative);
    t.read("every", scene.every, 0, most);
}

SceneForce read_force(const Table& t) {
    SceneForce f;
    if (!t.find("vertex") == !t.find("near")) t.refuse("needs exactly one of vertex and near");
    if (!t.find("newton") == !t.find("inward")) t.refuse("needs exactly one of newton and inward");
    if (t.find("profile"))
        for (const char* key : {"start", "end", "ramp"})
            if (t.find(key)) t.refuse(key, "and profile exclude each other");
    t.read("name", f.name);
    if (t.find("vertex")) t.read("vertex", f.vertex.emplace(), 0, largest_vertex);
    t.read("near", f.near);
    t.read("newton", f.newton);
    t.read("inward", f.inward, Range::finite);
    t.read("radius", f.radius, Range::not_negative);
    t.read("start", f.start, Range::finite);
    t.read("end", f.end, Range::finite);
    if (f.end && !(*f.end > f.start))
        t.refuse("end", fmt::format("is {}; it must come after start, {}", *f.end, f.start));
    t.read("ramp", f.ramp, Range::not_negative);
    const auto rows = t.read_rows<2>("profile", "[time_s, factor], two finite numbers each");
    f.profile.reserve(rows.size());
    for (const auto& row : rows) f.profile.emplace_back(row[0], row[1]);
    return f;
}

ScenePin read_pin(const Table& t) {
    ScenePin p;
    if (!t.find("vertices") == !t.find("near")) t.refuse("needs exactly one of vertices and near");
    if (t.find("vertices") && t.find("radius")) t.refuse("radius", "goes with near, not with vertices");
    p.vertices = t.read_vertices("vertices");
    t.read("near", p.near);
    t.read("radius", p.radius, Range::not_negative);
    const auto rows = t.read_rows<4>("path", "[time_s, dx, dy, dz], four finite numbers each");
    p.path.reserve(rows.size());
    for (const auto& row : rows) p.path.emplace_back(row[0], Vector(row[1], row[2], row[3]));
    return p;
}

SceneRefine read_refine(const Table& t) {
    SceneRefine r;
    if (bool(t.find("at")) + bool(t.find("edge_share")) + bool(t.find("tool_share")) != 1)
        t.refuse("needs exactly one of at, edge_share and tool_share");
    if (t.find("at") && !t.find("vertex") == !t.find("near"))
        t.refuse("with at needs exactly one of vertex and near");
    for (const char* key : {"vertex", "near", "radius"})
        if (t.find(key) && !t.find("at"))
            t.refuse(key, "goes with at; edge_share follows the forces, tool_share the tools");
    if (t.find("at")) t.read("at", r.at, Range::not_negative);
    if (t.find("vertex")) t.read("vertex", r.vertex.emplace(), 0, largest_vertex);
    t.read("near", r.near);
    t.read("radius", r.radius, Range::not_negative);
    t.read("edge_share", r.edge_share, Range::positive);
    t.read("tool_share", r.tool_share, Range::positive);
    if (!r.at) r.levels = 3;
    t.read("levels", r.levels, 1, most_levels);
    return r;
}

SceneTool read_tool(const Table& t) {
    SceneTool tool;
    if (bool(t.find("radius")) + bool(t.find("mesh")) + bool(t.find("normal")) != 1)
        t.refuse("needs exactly one of radius (sphere or capsule), mesh and normal (plane)");
    if (!t.find("at") == !t.find("path")) t.refuse("needs exactly one of at and path");
    if (t.find("length") && !t.find("radius")) t.refuse("length", "goes with radius, for a capsule");
    if (t.find("scale") && !t.find("mesh")) t.refuse("scale", "goes with mesh");
    if (t.find("axis") && t.find("normal")) t.refuse("axis", "and normal exclude each other");
    t.read("name", tool.name);
    t.read("radius", tool.radius, Range::positive);
    t.read("length", tool.length, Range::not_negative);
    t.read("mesh", tool.mesh);
    if (t.find("mesh") && (tool.mesh.empty() || tool.mesh.find('\0') != std::string::npos))
        t.refuse("mesh", "must name a file or a built-in shape");
    t.read("scale", tool.scale, Range::positive);
    t.read("normal", tool.normal);
    t.read("axis", tool.axis);
    for (const auto& [key, direction] : {std::pair("normal", tool.normal), std::pair("axis", tool.axis)})
        if (direction && !(direction->stableNorm() > 0)) t.refuse(key, "must not be zero");
    t.read("friction", tool.friction, Range::not_negative);
    t.read("at", tool.at);
    if (t.row_length("path") == 8) {
        tool.path = t.read_rows<8>("path", "[time_s, x, y, z, w, i, j, k], eight finite numbers each");
        for (const auto& row : tool.path)
            if (!(Eigen::Vector4d(row[4], row[5], row[6], row[7]).stableNorm() > 0))
                t.refuse("path", "has a rotation of all zeros; 1, 0, 0, 0 is none");
    } else {
        for (const auto& row :
             t.read_rows<4>("path", "[time_s, x, y, z], four finite numbers each, or eight"))
            tool.path.push_back({row[0], row[1], row[2], row[3], 1, 0, 0, 0});
    }
    return tool;
}

SceneHaptic read_haptic(const Table& t) {
    SceneHaptic h;
    t.read("device", h.device);
    constexpr std::string_view devices[] = {"simulated", "openhaptics", "forcedimension", "spacenavigator",
                                            "mouse"};
    if (std::ranges::find(devices, h.device) == std::end(devices) &&
        !(h.device.starts_with("replay:") && h.device.size() > 7 && h.device.find('\0') == std::string::npos))
        t.refuse("device", fmt::format("is '{}'; it must be simulated, openhaptics, forcedimension, "
                                       "spacenavigator, mouse or replay:FILE",
                                       shown(h.device)));
    t.read("rate_hz", h.rate, Range::positive);
    if (!(h.rate >= 30 && h.rate <= 4000))
        t.refuse("rate_hz", fmt::format("is {}; it must be 30 to 4000", h.rate));
    t.read("body_rate_hz", h.body_rate, Range::positive);
    if (!(h.body_rate >= 10 && h.body_rate <= 4000))
        t.refuse("body_rate_hz", fmt::format("is {}; it must be 10 to 4000", h.body_rate));
    t.read("workspace_scale", h.metres, Range::not_negative);
    t.read("force_scale", h.newtons, Range::not_negative);
    t.read("coupling_n_m", h.stiffness, Range::not_negative);
    t.read("controller", h.controller);
    return h;
}

Scene read_top(const Table& t) {
    Scene scene;
    t.read("mesh", scene.mesh);
    if (scene.mesh.empty() || scene.mesh.find('\0') != std::string::npos)
        t.refuse("mesh", "must name a file or a built-in shape");
    t.read("unit", scene.unit);
    if (t.find("unit") && scene.unit != "mm" && scene.unit != "cm" && scene.unit != "m")
        t.refuse("unit", fmt::format("is '{}'; it must be \"mm\", \"cm\" or \"m\"", shown(scene.unit)));
    if (t.find("normalize")) t.read("normalize", scene.normalize.emplace());
    t.read("weld", scene.weld, Range::not_negative);
    if (const auto table = t.table("material", material)) read_material(*table, scene);
    if (const auto table = t.table("anisotropy", anisotropy))
        scene.material.anisotropy = read_anisotropy(*table);
    if (const auto table = t.table("body", body)) read_body(*table, scene);
    if (const auto table = t.table("simulation", simulation)) read_simulation(*table, scene);
    if (const auto table = t.table("haptic", haptic)) scene.haptic = read_haptic(*table);
    const std::vector<Table> forces = t.tables("force", force), pins = t.tables("pin", pin),
                             refinements = t.tables("refine", refinement), tools = t.tables("tool", tool);
    scene.forces.reserve(forces.size());
    for (const Table& table : forces) scene.forces.push_back(read_force(table));
    scene.pins.reserve(pins.size());
    for (const Table& table : pins) scene.pins.push_back(read_pin(table));
    for (const Table& table : refinements) scene.refine.push_back(read_refine(table));
    for (const Table& table : tools) scene.tools.push_back(read_tool(table));
    return scene;
}

/// Parses the inside of an inline table given on the command line and hands it to `read`.
template <class T>
T parse_option(std::string_view option, std::string_view text, SectionIndex section,
               T (*read)(const Table&)) {
    const Source source{std::string(option), false};
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; };
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && blank(text.back())) text.remove_suffix(1);
    if (text.size() >= 2 && text.front() == '{' && text.back() == '}') text = text.substr(1, text.size() - 2);
    const toml::table root = parse(source, fmt::format("x = {{{}}}", text));
    const toml::node* inside = root.get("x");
    if (root.size() != 1 || !inside || !inside->is_table()) fail(source, 0, "a '}' too many");
    return read(Table(source, *inside->as_table(), section));
}

}  // namespace

Scene scene_from_text(std::string_view text, std::string_view name) {
    const Source source{std::string(name), true};
    const toml::table root = parse(source, text);
    return read_top(Table(source, root, top));
}

Scene read_scene(const std::filesystem::path& file) {
    std::error_code error;
    std::ifstream in(file, std::ios::binary);
    if (!in || std::filesystem::is_directory(file, error))
        throw InputError(fmt::format("{}: cannot be read; is it there, and a file?", file.string()));
    std::string text(largest_file + 1, '\0');  // one byte more shows that it is too large
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (in.bad()) throw InputError(fmt::format("{}: cannot be read to its end", file.string()));
    text.resize(static_cast<std::size_t>(in.gcount()));
    Scene scene = scene_from_text(text, file.string());
    rename_files(scene, [&](const std::string& name) {
        return (file.parent_path() / name).string();  // an absolute one stays
    });
    return scene;
}

void rename_files(Scene& scene, const std::function<std::string(const std::string&)>& renamed) {
    constexpr std::string_view replay = "replay:";
    const auto rename = [&](std::string& name) {
        if (!name.empty() && !is_shape(name)) name = renamed(name);
    };
    rename(scene.mesh);
    for (SceneTool& tool : scene.tools) rename(tool.mesh);
    std::string& field = scene.material.anisotropy.file;
    if (!field.empty()) field = renamed(field);
    std::string& device = scene.haptic.device;
    if (device.starts_with(replay)) device = std::string(replay) + renamed(device.substr(replay.size()));
}

SceneForce parse_force(std::string_view text) {
    return parse_option("--force", text, force, read_force);
}

ScenePin parse_pin(std::string_view text) {
    return parse_option("--pin", text, pin, read_pin);
}

SceneTool parse_tool(std::string_view text) {
    return parse_option("--tool", text, tool, read_tool);
}

Anisotropy parse_directions(std::string_view text) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    const bool word = !text.empty() && text.find_first_not_of("abcdefghijklmnopqrstuvwxyz") == text.npos;
    return parse_option("--anisotropy", word ? fmt::format("kind = \"{}\"", text) : std::string(text),
                        anisotropy, read_anisotropy);
}

SceneRefine parse_refine(std::string_view text) {
    return parse_option("--refine", text, refinement, read_refine);
}

}  // namespace innerspring
