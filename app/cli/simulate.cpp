#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <memory>

#include "commands.h"
#include "innerspring/mesh/error.h"
#include "innerspring/record/json.h"
#include "innerspring/record/run.h"
#include "options.h"

using namespace innerspring;

namespace {

struct Arguments {
    MeshOptions mesh;
    BodyArguments body;
    OutputOptions output;
    std::string directory;
    MotionArguments motion;
    std::optional<double> duration, residual;
    std::optional<int> every;
    bool equilibrium = false, resume = false;
};

std::atomic<bool> interrupted{false};

void show(const Progress& p) {
    fmt::print(stderr, "\r{:3.0f} %  volume {:+.4f} %  {:.0f} s left ", 100 * p.share,
               p.volume_variation_percent, p.seconds_left);
    std::fflush(stderr);
}

void print(const Summary& s, const std::string& directory) {
    fmt::print("{}: {} vertices, {} triangles, scheme {}, {:.6g} m^3\n", s.subject.mesh_name,
               s.subject.vertices, s.subject.triangles, to_string(s.subject.scheme), s.subject.volume_m3);
    print_row("centre", fmt::format("{}: {}", to_string(s.subject.centre.kind), s.subject.centre.reason));
    print_row("material", fmt::format("{}: M {:.4g} kg, E {:.4g} Pa, E_s {:.4g} N/m, zeta {:.3g}, nu {:g}",
                                      s.subject.material_name, s.subject.material.mass,
                                      s.subject.material.young, s.subject.material.surface,
                                      s.subject.material.damping, s.subject.material.poisson));
    print_row("M g/ER^2, E_s/ER, F/ER^2", fmt::format("{:.4g}, {:.4g}, {:.4g}", s.subject.groups.weight,
                                                      s.subject.groups.surface, s.subject.groups.force));
    print_row("time",
              fmt::format("{:.6g} s in {} steps of {:g} s ({}, {} sub-steps, {} precision)", s.duration_s,
                          s.steps, s.dt_s, to_string(s.integrator), s.substeps, to_string(s.precision)));
    print_row(
        "volume variation",
        fmt::format("final {:+.5f} %, largest {:.5f} %, mean {:.5f} %", s.volume_variation_percent.final,
                    s.volume_variation_percent.max, s.volume_variation_percent.mean));
    if (s.subject.material.poisson > 0) print_row("pressure", fmt::format("{:.4g} Pa", s.last.pressure));
    const Vector &mean = s.last.mean_displacement, &spread = s.last.std_displacement;
    print_row("displacement, mean", fmt::format("({:.4g}, {:.4g}, {:.4g}) m", mean.x(), mean.y(), mean.z()));
    print_row("displacement, spread", fmt::format("({:.4g}, {:.4g}, {:.4g}) m, largest {:.4g} m", spread.x(),
                                                  spread.y(), spread.z(), s.last.max_displacement));
    for (const Vector& f : s.last.tool_force)
        print_row("force on tool", fmt::format("({:.4g}, {:.4g}, {:.4g}) N", f.x(), f.y(), f.z()));
    if (s.refinements > 0)
        print_row("refinement",
                  fmt::format("{} changes; {} vertices at the end", s.refinements, s.vertices_last));
    print_row("equilibrium", fmt::format("{} (largest force left {:.3g} N)",
                                         s.equilibrium_reached ? "reached" : "not reached", s.residual_n));
    print_row("speed",
              fmt::format("{:.3g} s, {:.3g} ns per vertex and step", s.seconds, s.ns_per_vertex_step));
    print_row("written to", directory);
}

int run(const Arguments& a) {
    Scene scene;
    if (a.mesh.mesh.ends_with(".toml"))
        scene = read_scene(a.mesh.mesh);
    else
        scene.mesh = a.mesh.mesh;
    apply(a.mesh, scene);
    apply(a.body, scene);
    apply(a.motion, scene);
    if (a.duration) scene.duration = *a.duration;
    if (a.residual) scene.residual_n = *a.residual;
    if (a.every) scene.every = *a.every;
    scene.equilibrium |= a.equilibrium;
    // What the options say must hold as much as what a file says.
    scene = scene_from_text(to_toml(scene), "command line");

    std::signal(SIGINT, [](int) { interrupted = true; });
    std::signal(SIGTERM, [](int) { interrupted = true; });
    RunOptions options{a.directory, a.resume, {}, &interrupted};
    const bool terminal = !a.output.quiet && isatty(STDERR_FILENO) == 1;
    if (terminal) options.progress = show;
    const Summary summary = innerspring::run(scene, options);
    if (terminal) fmt::print(stderr, "\r{:60}\r", "");

    print_notes(summary.warnings, a.output.quiet);
    if (a.output.json)
        fmt::print("{}", to_json(summary));
    else
        print(summary, a.directory);
    if (summary.stopped) {
        fmt::print(stderr, "innerspring: interrupted at t = {:g} s; go on with --resume\n",
                   summary.duration_s);
        return 1;
    }
    if (!summary.failure.empty()) {
        fmt::print(stderr, "innerspring: {}\n", summary.failure);
        return 1;
    }
    return 0;
}

}  // namespace

Command add_simulate(CLI::App& program) {
    CLI::App* app = program.add_subcommand("simulate", "Gravity and forces on a soft body; volume over time");
    auto a = std::make_shared<Arguments>();
    add_mesh_options(*app, a->mesh, "surface, or a scene file (.toml, docs/formats.md)");
    app->add_option("-o,--output", a->directory, "folder for the results")->required()->type_name("DIR");
    add_body_options(*app, a->body);
    add_motion_options(*app, a->motion);
    app->add_option("--duration", a->duration, "time to simulate [s] (default 2)")->type_name("S");
    app->add_flag("--equilibrium", a->equilibrium, "solve for the balance of forces instead of stepping");
    app->add_option("--residual", a->residual,
                    "largest force left in equilibrium [N] (default 1e-9 of the loads)")
        ->type_name("N");
    app->add_option("--every", a->every,
                    "write a frame each so many steps; 0: first and last only (default 10)")
        ->type_name("N");
    app->add_flag("--resume", a->resume,
                  "go on from the state saved in DIR, to a longer --duration if given");
    add_output_options(*app, a->output);
    app->footer(
        "Writes summary.json, series.csv, frames.pvd with frames/*.vtp (open in ParaView), volume.svg (not "
        "with --equilibrium), picture.png and scene.resolved.toml.");
    return {app, [a] { return run(*a); }};
}
