#include "options.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdio>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"

using namespace innerspring;

std::string shape_list() {
    std::string shapes;
    for (std::string_view name : shape_names()) shapes += (shapes.empty() ? "" : ", ") + std::string(name);
    return shapes;
}

void add_mesh_options(CLI::App& app, MeshOptions& o, const std::string& mesh_help) {
    app.add_option("mesh", o.mesh,
                   mesh_help + "; a file (OBJ, STL, PLY, OFF) or a built-in shape: " + shape_list() +
                       ", e.g. sphere:vertices=2000,seed=1,irregularity=3")
        ->required()
        ->type_name("MESH");
    app.add_option("--unit", o.unit,
                   "unit of the file's coordinates; without it a file is scaled to unit volume radius")
        ->type_name("mm|cm|m");
    app.add_flag("--normalize", o.normalize,
                 "scale to unit volume radius (1 m), volume centroid at the origin");
    app.add_option("--weld", o.weld,
                   "merge vertices this near, in the unit of the file (default 0: equal coordinates)")
        ->type_name("TOL");
    app.add_option("--seed", o.seed, "seed of a built-in shape")->type_name("N");
}

void add_body_options(CLI::App& app, BodyArguments& o) {
    std::string names = "paper";
    for (const Tissue& t : tissues()) names += ", " + std::string(t.name);
    app.add_option("--material", o.material, "published tissue values: " + names + " (default paper)")
        ->type_name("NAME");
    app.add_option("--mass", o.mass, "total mass M [kg] (default 0.05)")->type_name("KG");
    app.add_option("--density", o.density, "density [kg/m^3], instead of --mass")->type_name("KG/M3");
    app.add_option("--young", o.young, "modulus E of the inner volume [Pa] (default 10)")->type_name("PA");
    app.add_option("--surface", o.surface, "surface modulus E_s = modulus x thickness [N/m] (default 1)")
        ->type_name("N/M");
    app.add_option("--damping", o.damping,
                   "damping ratio zeta of each inner spring; 1 is critical (default 1)")
        ->type_name("Z");
    app.add_option("--poisson", o.poisson,
                   "Poisson's ratio nu of the body as a whole: 0 (the paper) to 0.5, which keeps the volume "
                   "under any load (default 0)")
        ->type_name("NU");
    app.add_option("--anisotropy", o.anisotropy,
                   "stiffness by direction: 'radial' (E towards the centre, E/(2(1+nu)) across), "
                   "'kind=\"fibres\", along_pa=E_f, across_pa=E_p, direction=[x,y,z]' or around=[x,y,z] "
                   "(through=[x,y,z], pitch_deg=A), outward=[x,y,z] or field=\"FILE\" (VTP or CSV), or "
                   "'kind=\"orthotropic\", moduli_pa=[E1,E2,E3], axes=[[x,y,z],[x,y,z]]'")
        ->type_name("SPEC");
    app.add_option("--scheme", o.scheme,
                   "A: regular; B: irregular masses, regular springs; C: the paper's proposal (default C)")
        ->type_name("A|B|C");
    app.add_option(
           "--centre,--center", o.centre,
           "centre of the virtual tetrahedra: auto, centroid, kernel, local or X,Y,Z [m] (default auto)")
        ->type_name("CENTRE");
}

void add_motion_options(CLI::App& app, MotionArguments& o) {
    app.add_option("--gravity", o.gravity, "acceleration [m/s^2] (default 0,-9.81,0)")->type_name("X,Y,Z");
    app.add_option("--force", o.forces,
                   "a force, as in a scene: 'near=[x,y,z] or vertex=N, inward=F or newton=[x,y,z], "
                   "radius=R, start=T, end=T, ramp=T' [m, N, s]; repeatable")
        ->type_name("SPEC");
    app.add_option("--pin", o.pins,
                   "held or moved vertices: 'near=[x,y,z], radius=R' or 'vertices=[i,j]', "
                   "path=[[t,dx,dy,dz],...]; repeatable")
        ->type_name("SPEC");
    app.add_option("--refine", o.refine,
                   "refine during the run: 'edge_share=S' around each force with a radius while it acts, "
                   "until no edge is longer than S of that radius; or 'tool_share=S' under and around each "
                   "tool, until no "
                   "edge is longer than S of its radius; or 'at=T, near=[x,y,z], radius=R, levels=N' "
                   "[s, m]; repeatable")
        ->type_name("SPEC");
    app.add_option(
           "--tool", o.tools,
           "a rigid thing that touches the body: 'radius=R' (with length=L a capsule), 'mesh=\"FILE\"' or "
           "'normal=[x,y,z]' (a plane), friction=MU, at=[x,y,z] or path=[[t,x,y,z],...]; repeatable")
        ->type_name("SPEC");
    app.add_option("--dt", o.dt, "time step [s], sub-stepped as stability needs (default 0.01)")
        ->type_name("S");
    app.add_option("--integrator", o.integrator, "auto, symplectic or implicit (default auto)")
        ->type_name("NAME");
    app.add_option("--precision", o.precision,
                   "of explicit steps of a held body: single, several times as fast, or double (default "
                   "single)")
        ->type_name("NAME");
    app.add_flag("--linearised", o.linearised,
                 "implicit steps by one Newton step with the true tangent, not to the minimum");
    app.add_flag("--free", o.free, "not held: the home positions follow the body");
    app.add_option("--threads", o.threads,
                   "threads, 0 for all cores; the result does not depend on it (default 1)")
        ->type_name("N");
}

void add_output_options(CLI::App& app, OutputOptions& o) {
    app.add_flag("--json", o.json, "print the result as JSON (docs/formats.md)");
    app.add_flag("--quiet", o.quiet, "no notes and no progress");
}

void apply(const MeshOptions& o, Scene& scene) {
    if (!o.unit.empty()) scene.unit = o.unit;
    if (o.normalize) scene.normalize = true;
    if (o.weld) scene.weld = *o.weld;
    if (o.seed) {
        if (!is_shape(scene.mesh)) throw InputError("--seed: only built-in shapes have one");
        if (scene.mesh.find("seed=") != std::string::npos)
            throw InputError("--seed: the shape already names its seed");
        scene.mesh +=
            fmt::format("{}seed={}", scene.mesh.find(':') == std::string::npos ? ":" : ",", *o.seed);
    }
}

void apply(const BodyArguments& o, Scene& scene) {
    if (o.material) {
        scene.material_name = *o.material;
        const Anisotropy kept = scene.material.anisotropy;
        scene.material = tissue_material(*o.material);
        scene.material.anisotropy = kept;
    }
    if (o.mass && o.density) throw InputError("--mass and --density: give one of them");
    if (o.mass) scene.material.mass = *o.mass, scene.material.density.reset();
    if (o.density) scene.material.density = *o.density;
    if (o.young) scene.material.young = *o.young;
    if (o.surface) scene.material.surface = *o.surface, scene.material.surface_ratio.reset();
    if (o.damping) scene.material.damping = *o.damping;
    if (o.poisson) scene.material.poisson = *o.poisson;
    if (o.anisotropy) scene.material.anisotropy = parse_directions(*o.anisotropy);
    if (o.scheme) scene.scheme = parse_scheme(*o.scheme);
    if (o.centre) scene.centre = parse_centre(*o.centre);
}

void apply(const MotionArguments& o, Scene& scene) {
    if (o.gravity) scene.gravity = parse_vector(*o.gravity, "--gravity");
    for (const std::string& f : o.forces) scene.forces.push_back(parse_force(f));
    for (const std::string& p : o.pins) scene.pins.push_back(parse_pin(p));
    for (const std::string& r : o.refine) scene.refine.push_back(parse_refine(r));
    for (const std::string& t : o.tools) scene.tools.push_back(parse_tool(t));
    if (o.dt) scene.step.dt = *o.dt;
    if (o.integrator) scene.step.integrator = parse_integrator(*o.integrator);
    if (o.precision) scene.step.precision = parse_precision(*o.precision);
    if (o.threads) scene.step.threads = *o.threads;
    scene.step.linearised |= o.linearised;
    scene.free |= o.free;
}

Vector parse_vector(const std::string& text, const char* option) {
    Vector v;
    const char *p = text.data(), *end = p + text.size();
    for (int axis = 0; axis < 3; ++axis) {
        const auto [next, error] = std::from_chars(p, end, v[axis]);
        if (error != std::errc() || !std::isfinite(v[axis]) ||
            (axis < 2 ? next == end || *next != ',' : next != end))
            throw InputError(fmt::format("{} '{}': expected X,Y,Z", option, text));
        p = next + 1;
    }
    return v;
}

std::pair<int, int> parse_size(const std::string& text) {
    int width = 0, height = 0;
    const char *p = text.data(), *end = p + text.size();
    const auto [middle, first] = std::from_chars(p, end, width);
    const bool between = first == std::errc() && middle != end && *middle == 'x';
    const auto [last, second] = std::from_chars(between ? middle + 1 : end, end, height);
    if (!between || second != std::errc() || last != end || width < 64 || height < 64 || width > 8192 ||
        height > 8192)
        throw InputError(fmt::format("--size '{}': expected WIDTHxHEIGHT, each from 64 to 8192", text));
    return {width, height};
}

void print_notes(const std::vector<std::string>& notes, bool quiet) {
    if (quiet) return;
    for (const std::string& note : notes) fmt::print(stderr, "note: {}\n", note);
}

void print_row(std::string_view label, const std::string& value) {
    fmt::print("  {:<24} {}\n", label, value);
}
