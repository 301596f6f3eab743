#include "innerspring/mesh/refine.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "commands.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/read.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/weld.h"
#include "innerspring/mesh/write.h"
#include "options.h"

using namespace innerspring;

namespace {

struct Arguments {
    std::string mesh, out, map;
    std::optional<std::string> near;
    std::optional<Index> vertex;
    std::optional<double> radius, longer_than;
    std::optional<int> rings;
    double weld = 0;
    int levels = 1;
    bool along = false, smooth = false;
    OutputOptions output;
};

std::vector<Index> region(const SurfaceMesh& mesh, const Arguments& a) {
    std::vector<Index> chosen;
    if (a.near || a.vertex) {
        if (a.near && a.vertex) throw InputError("--near and --vertex: give one of them");
        if (a.radius && a.rings) throw InputError("--radius and --rings: give one of them");
        if (!a.radius && !a.rings) throw InputError("say how far: --radius R or --rings N");
        if (a.along && !a.radius) throw InputError("--along: needs --radius");
        if (a.vertex && *a.vertex >= mesh.positions.size())
            throw InputError(fmt::format("--vertex {}: the welded mesh has 0 to {}", *a.vertex,
                                         mesh.positions.size() - 1));
        const Vector point = a.near ? parse_vector(*a.near, "--near") : mesh.positions[*a.vertex];
        if (a.radius && !a.along) {
            chosen = triangles_near(mesh, point, *a.radius);
        } else {
            const Index vertex = a.vertex ? *a.vertex : nearest_vertex(mesh.positions, point);
            const Topology topology = build_topology(mesh.positions.size(), mesh.triangles);
            chosen = a.rings ? triangles_in_ring(mesh, topology, vertex, *a.rings)
                             : triangles_along(mesh, topology, vertex, *a.radius);
        }
    } else {
        if (a.radius || a.rings || a.along) throw InputError("say where: --near X,Y,Z or --vertex N");
        if (!a.longer_than)
            throw InputError(
                "say what: --near X,Y,Z or --vertex N with --radius R or --rings N; or "
                "--longer-than L");
        chosen.resize(mesh.triangles.size());
        for (std::size_t t = 0; t < chosen.size(); ++t) chosen[t] = Index(t);
    }
    if (a.longer_than)
        std::erase_if(chosen, [&](Index t) {
            for (int k = 0; k < 3; ++k)
                if ((mesh.positions[mesh.triangles[t][k]] - mesh.positions[mesh.triangles[t][(k + 1) % 3]])
                        .norm() > *a.longer_than)
                    return false;
            return true;
        });
    return chosen;
}

/// [degree]
double least_angle(const SurfaceMesh& mesh) {
    double least = std::numbers::pi;
    for (const Triangle& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) {
            const Vector u = mesh.positions[t[(k + 1) % 3]] - mesh.positions[t[k]],
                         v = mesh.positions[t[(k + 2) % 3]] - mesh.positions[t[k]];
            least = std::min(least, std::atan2(u.cross(v).norm(), u.dot(v)));
        }
    return least * 180 / std::numbers::pi;
}

int run(const Arguments& a) {
    SurfaceMesh mesh = is_shape(a.mesh) ? make_shape(a.mesh) : read(a.mesh);
    Welded welded = weld(mesh, {a.weld});
    if (welded.merged > 0)
        print_notes(
            {fmt::format("{} of {} vertices merged by position", welded.merged, mesh.positions.size())},
            a.output.quiet);
    mesh = std::move(welded.mesh);
    const std::vector<Index> chosen = region(mesh, a);
    if (chosen.empty()) {
        std::string place;
        if (a.near) {
            const Vector point = parse_vector(*a.near, "--near");
            const Vector& q = mesh.positions[nearest_vertex(mesh.positions, point)];
            place = fmt::format("; the nearest vertex is at {:.6g},{:.6g},{:.6g}, {:.4g} away", q.x(), q.y(),
                                q.z(), (q - point).norm());
        }
        throw InputError(fmt::format("{}: no triangle is in the region{}", a.mesh, place));
    }
    const RefinedMesh fine = refine(mesh, chosen, {a.levels, a.smooth ? Placement::pn : Placement::in_plane});
    write(fine.mesh, a.out);
    if (!a.map.empty()) {
        std::string text = "new_vertex,end_a,end_b\n";
        for (std::size_t n = 0; n < fine.halves.size(); ++n)
            text += fmt::format("{},{},{}\n", fine.old_vertices + n, fine.halves[n].a, fine.halves[n].b);
        write_whole(a.map, text);
    }
    const double V = volume(mesh), before = least_angle(mesh), after = least_angle(fine.mesh);
    if (a.output.json) {
        nlohmann::ordered_json j;
        j["mesh"] = {
            {"name", mesh.name}, {"vertices", mesh.positions.size()}, {"triangles", mesh.triangles.size()}};
        j["refined"] = {{"file", a.out},
                        {"vertices", fine.mesh.positions.size()},
                        {"triangles", fine.mesh.triangles.size()}};
        j["chosen_triangles"] = chosen.size();
        j["levels"] = a.levels;
        j["least_angle_degree"] = {{"before", before}, {"after", after}};
        j["volume_change_percent"] = 100 * fine.volume_change_m3 / V;
        fmt::print("{}\n", j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
        return 0;
    }
    fmt::print("{}: {} of {} triangles refined, {} level{}\n", mesh.name, chosen.size(),
               mesh.triangles.size(), a.levels, a.levels == 1 ? "" : "s");
    print_row("vertices", fmt::format("{} -> {}", mesh.positions.size(), fine.mesh.positions.size()));
    print_row("triangles", fmt::format("{} -> {}", mesh.triangles.size(), fine.mesh.triangles.size()));
    print_row("least angle", fmt::format("{:.3g} -> {:.3g} degrees", before, after));
    print_row("volume", a.smooth ? fmt::format("{:+.4g} %", 100 * fine.volume_change_m3 / V)
                                 : std::string("unchanged (new vertices lie in their triangles)"));
    print_row("written to", a.out);
    return 0;
}

}  // namespace

Command add_refine(CLI::App& program) {
    CLI::App* app = program.add_subcommand(
        "refine",
        "Cuts triangles of a region into four, and those beside them so that the surface stays closed");
    auto a = std::make_shared<Arguments>();
    app->add_option("mesh", a->mesh,
                    "surface to refine; a file (OBJ, STL, PLY, OFF) or a built-in shape: " + shape_list())
        ->required()
        ->type_name("MESH");
    app->add_option("-o,--output", a->out, "file for the refined surface (.obj .stl .ply .off)")
        ->required()
        ->type_name("OUT");
    app->add_option("--near", a->near, "place, in the file's coordinates")->type_name("X,Y,Z");
    app->add_option("--vertex", a->vertex, "place: a vertex of the welded mesh")->type_name("N");
    app->add_option("--radius", a->radius, "triangles within this distance, straight, in the file's unit")
        ->type_name("R");
    app->add_flag("--along", a->along, "measure the radius along the surface, from the nearest vertex");
    app->add_option("--rings", a->rings, "triangles within so many edges of the vertex")->type_name("N");
    app->add_option("--longer-than", a->longer_than,
                    "only triangles with a side longer than this; without a place, all of those")
        ->type_name("L");
    app->add_option("--levels", a->levels, "times to refine, 1 to 10 (default 1)")->type_name("N");
    app->add_flag("--smooth", a->smooth,
                  "put new vertices on a smooth surface (PN triangles) instead of the middle of their edge");
    app->add_option("--map", a->map, "write which edge each new vertex halves (CSV)")->type_name("FILE");
    app->add_option("--weld", a->weld,
                    "merge vertices this near, in the unit of the file (default 0: equal coordinates)")
        ->type_name("TOL");
    add_output_options(*app, a->output);
    app->footer("Old vertices keep their index and place; coordinates stay in the file's unit.");
    return {app, [a] { return run(*a); }};
}
