#include "innerspring/mesh/check.h"

#include <fmt/format.h>

#include <memory>

#include "commands.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/read.h"
#include "innerspring/mesh/repair.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/write.h"
#include "innerspring/record/json.h"
#include "options.h"

using namespace innerspring;

namespace {

struct Arguments {
    MeshOptions mesh;
    OutputOptions output;
    bool fix = false;
    std::string out;
};

std::string_view word(Verdict v) {
    return v == Verdict::fine ? "fine" : v == Verdict::usable ? "usable" : "UNUSABLE";
}

void print(const CheckReport& r, const std::string& name, const std::string& unit) {
    fmt::print("{}: {}\n", name,
               r.verdict == Verdict::fine     ? "fine"
               : r.verdict == Verdict::usable ? "usable, see below"
                                              : "UNUSABLE, see below");
    print_row("vertices, triangles", fmt::format("{}, {}", r.vertices, r.triangles));
    print_row("components, genus",
              fmt::format("{}, {}", r.components, r.genus ? std::to_string(*r.genus) : "-"));
    print_row("volume, area", fmt::format("{:.6g} {}^3, {:.6g} {}^2", r.volume_m3, unit, r.area_m2, unit));
    const Vector size = r.upper - r.lower;
    print_row("size", fmt::format("{:.6g} x {:.6g} x {:.6g} {}", size.x(), size.y(), size.z(), unit));
    print_row("centroid", fmt::format("({:.4g}, {:.4g}, {:.4g}) {}", r.centroid.x(), r.centroid.y(),
                                      r.centroid.z(), unit));
    print_row("edge lengths",
              fmt::format("{:.4g} .. {:.4g} .. {:.4g} {}", r.edge_min_m, r.edge_mean_m, r.edge_max_m, unit));
    print_row("negative tetrahedra",
              fmt::format("{:.1f} % by count, {:.1f} % by volume (about the centroid)",
                          100 * r.negative_tetrahedra_by_count, 100 * r.negative_tetrahedra_by_volume));
    fmt::print("\n");
    for (const Finding& f : r.findings) {
        std::string line = fmt::format("  {:<9} {:<20}", word(f.verdict), f.what);
        if (f.verdict != Verdict::fine) line += fmt::format(" {}: {}; {}", f.count, f.first, f.advice);
        fmt::print("{}\n", line);
    }
}

int run(const Arguments& a) {
    Scene scene;
    scene.mesh = a.mesh.mesh;
    apply(a.mesh, scene);
    if (a.fix && a.out.empty())
        throw InputError("--fix needs -o OUT: the file that was read is never changed");
    if (!a.fix && !a.out.empty()) throw InputError("-o: only with --fix");

    // Coordinates are judged as they stand: a check changes nothing.
    SurfaceMesh mesh = is_shape(scene.mesh) ? make_shape(scene.mesh) : read(scene.mesh);
    std::string name = mesh.name,
                unit = scene.unit.empty() ? (is_shape(scene.mesh) ? "m" : "unit") : scene.unit;
    if (a.fix) {
        Repaired repaired = repair(mesh, {scene.weld});
        write(repaired.mesh, a.out);
        if (!a.output.json) {
            for (const std::string& action : repaired.actions) fmt::print("fixed: {}\n", action);
            fmt::print("{} {}\n\n", repaired.actions.empty() ? "nothing to fix; copied to" : "written to",
                       a.out);
        }
        mesh = std::move(repaired.mesh);
        name = a.out;
    } else {
        Welded welded = weld(mesh, {scene.weld});
        if (welded.merged > 0)
            print_notes(
                {fmt::format("{} of {} vertices merged by position", welded.merged, mesh.positions.size())},
                a.output.quiet);
        if (welded.unused > 0)
            print_notes({fmt::format("{} unused vertices left out", welded.unused)}, a.output.quiet);
        mesh = std::move(welded.mesh);
    }
    if (a.mesh.normalize) normalize(mesh), unit = "m";
    const CheckReport report = check(mesh);
    if (a.output.json)
        fmt::print("{}", to_json(report, name));
    else
        print(report, name, unit);
    return report.verdict == Verdict::unusable ? 1 : 0;
}

}  // namespace

Command add_check(CLI::App& program) {
    CLI::App* app = program.add_subcommand(
        "check", "Is a surface fit to become a body? Says what is wrong, where, and what to do");
    auto a = std::make_shared<Arguments>();
    add_mesh_options(*app, a->mesh, "surface to look at");
    app->add_flag(
        "--fix", a->fix,
        "do what is safe: weld, drop unused, degenerate and duplicate parts, orient, flip; write to -o");
    app->add_option("-o,--output", a->out, "file for the fixed mesh (.obj .stl .ply .off)")->type_name("OUT");
    add_output_options(*app, a->output);
    app->footer("Exit code: 0 fine or usable, 1 unusable, 2 the file cannot be read.");
    return {app, [a] { return run(*a); }};
}
