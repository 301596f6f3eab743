#include "innerspring/study/study.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>

#include "commands.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/study/truth.h"
#include "options.h"

#ifdef INNERSPRING_VIEWER
#include "painter.h"
#endif

using namespace innerspring;

namespace {

struct Arguments {
    CLI::App* app = nullptr;
    std::string study;
    MeshOptions mesh;
    BodyArguments body;
    OutputOptions output;
    std::string directory;
    std::optional<int> vertices, forces, levels, threads, tetrahedra;
    std::optional<double> radius;
    std::vector<double> nu;
    bool quick = false, resume = false;
};

std::atomic<bool> interrupted{false};

void show(const StudyProgress& p) {
    fmt::print(stderr, "\r{:3.0f} %  {} of {} cases  {:.0f} s left ", 100 * p.share, p.done, p.cases,
               p.seconds_left);
    std::fflush(stderr);
}

/// As a shell takes it for one word.
std::string quoted(const std::string& word) {
    const bool plain = std::all_of(word.begin(), word.end(), [](unsigned char c) {
        return std::isalnum(c) || std::strchr("_-+.,:=/%@", c);
    });
    if (plain && !word.empty()) return word;
    std::string text = "'";
    for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

/// Mesh and options as given, but for where the results go and how they are made.
std::string arguments(const Arguments& a, const std::string& mesh) {
    std::string text = mesh.empty() ? "" : quoted(mesh);
    for (const CLI::Option* option : a.app->get_options()) {
        if (option->count() == 0 || option->get_positional()) continue;
        const std::string name = option->get_lnames().front();
        if (name == "output" || name == "threads" || name == "resume" || name == "json" || name == "quiet")
            continue;
        text += (text.empty() ? "--" : " --") + name;
        if (option->get_items_expected() > 0)
            text += " " + quoted(fmt::format("{}", fmt::join(option->results(), ",")));
    }
    return text;
}

void print(const StudyResults& r, const std::string& directory) {
    const Body& body = r.setting.body();
    fmt::print("{}: {} vertices, {} triangles, centre {}; {} cases{}\n\n", body.rest.name, body.vertices(),
               body.rest.triangles.size(), to_string(body.centre.kind), r.cases,
               r.kind == StudyKind::volume
                   ? ", each a series of equilibria"
                   : fmt::format(", simulated for {:.3g} s", r.setting.sampling.duration_s()));
    for (const Claim& c : r.claims) {
        fmt::print("{:<13} {}: {}\n", to_string(c.outcome), c.source, c.claim);
        if (!c.measured.empty()) fmt::print("{:<13} {}\n", "", c.measured);
        if (!c.condition.empty()) fmt::print("{:<13} {}: {}\n", "", to_string(c.outcome), c.condition);
    }
    fmt::print("\nreport {0}/report.html, numbers {0}/summary.json\n", directory);
}

void print(const TruthResults& r, const std::string& directory) {
    for (const TruthSubjectInfo& s : r.subjects) {
        fmt::print("{}: {} vertices, {} held; by {}, nu = {:g}\n", s.name, s.vertices, s.held, s.reference,
                   s.poisson);
        fmt::print("  {:<18} {:<9} {:>8} {:>10} {:>6} {:>6} {:>7}\n", "load", "model", "L2 error",
                   "peak error", "peak", "work", "volume");
        for (const TruthRow& row : r.rows)
            if (row.subject == s.name)
                fmt::print("  {:<18} {:<9} {:8.3f} {:10.3f} {:6.3f} {:6.3f} {:+7.3f}\n", row.load, row.model,
                           row.l2_error, row.peak_error, row.peak_ratio, row.work_ratio, row.swept_share);
    }
    fmt::print(
        "\npeak, work: over the reference's; 1 is right, 2 twice as soft. volume: gained or lost, of what "
        "the reference "
        "sweeps\nreport {0}/report.html, numbers {0}/summary.json\n",
        directory);
}

/// What every study takes alike; says whether progress goes to a terminal.
template <class Run>
bool take_common(const Arguments& a, Run& study) {
    study.directory = a.directory;
    study.resume = a.resume;
    study.stop = &interrupted;
#ifdef INNERSPRING_VIEWER
    study.paint = viewer::best_painter();
#endif
    if (a.threads) study.threads = *a.threads;
    const bool terminal = !a.output.quiet && isatty(STDERR_FILENO) == 1;
    if (terminal) study.progress = show;
    return terminal;
}

int run_truth(const Arguments& a) {
    if (a.forces || a.levels)
        throw InputError("study truth: --forces and --levels belong to the other studies");
    TruthRun study;
    Scene scene;
    study.default_mesh = a.mesh.mesh.empty();
    study.options.series = study.default_mesh;
    if (!study.default_mesh) scene.mesh = a.mesh.mesh;
    study.arguments = arguments(a, study.default_mesh ? "" : scene.mesh);
    apply(a.mesh, scene);
    apply(a.body, scene);
    if (a.quick)
        study.options.patches = 1, study.default_vertices = 350, study.options.check_vertices = 362,
        study.options.sphere_vertices = 2562;
    if (a.vertices) study.options.patches = *a.vertices;
    if (a.radius) study.options.patch_share = *a.radius;
    if (a.tetrahedra) study.options.tetrahedra = *a.tetrahedra;
    if (a.nu.size() > 1) throw InputError("study truth: --nu is one Poisson's ratio");
    if (!a.nu.empty()) study.options.sphere_poisson = study.options.element_poisson = a.nu.front();
    scene = scene_from_text(to_toml(scene), "command line");
    const bool terminal = take_common(a, study);
    const TruthResults results = run_truth(scene, study);
    if (terminal) fmt::print(stderr, "\r{:60}\r", "");
    print_notes(results.warnings, a.output.quiet);
    if (results.stopped) {
        fmt::print(stderr, "innerspring: interrupted; go on with --resume\n");
        return 1;
    }
    if (a.output.json)
        fmt::print("{}", to_json(results));
    else
        print(results, a.directory);
    return 0;
}

int run(const Arguments& a) {
    std::signal(SIGINT, [](int) { interrupted = true; });
    std::signal(SIGTERM, [](int) { interrupted = true; });
    if (a.body.poisson)
        throw InputError(a.study == "truth"
                             ? "study truth: --nu is the reference's Poisson's ratio, and the "
                               "models take theirs from it; leave --poisson out"
                             : "the paper's experiments are about poisson = 0; leave --poisson "
                               "out (study volume compares other values, --nu chooses them)");
    if (a.body.anisotropy)
        throw InputError(
            "the studies are of isotropic bodies, but for the models that study truth knows of; "
            "leave --anisotropy out (simulate, estimate, view and haptic take it)");
    if (a.study == "truth") return run_truth(a);
    StudyRun study;
    study.kind = parse_study(a.study);
    if (a.tetrahedra) throw InputError("--tetrahedra belongs to study truth");
    if (!a.nu.empty() && study.kind != StudyKind::volume && study.kind != StudyKind::all)
        throw InputError("--nu belongs to the studies volume, all and truth");
    Scene scene;
    scene.mesh = !a.mesh.mesh.empty() ? a.mesh.mesh
                 : a.quick            ? "sphere:vertices=350"
                                      : "sphere:vertices=1000";
    study.arguments = arguments(a, scene.mesh);
    apply(a.mesh, scene);
    apply(a.body, scene);
    if (a.quick) study.options.vertices = 4, study.options.forces = 4, study.options.levels = 1;
    if (a.vertices) study.options.vertices = *a.vertices;
    if (a.forces) study.options.forces = *a.forces;
    if (a.levels) study.options.levels = *a.levels;
    if (a.radius) study.options.influence_share = *a.radius;
    if (!a.nu.empty()) study.options.poisson = a.nu;
    std::sort(study.options.poisson.begin(), study.options.poisson.end());
    study.options.region_share = std::max(study.options.region_share, 1.25 * study.options.influence_share);
    // What the options say must hold as much as what a file says.
    scene = scene_from_text(to_toml(scene), "command line");

    const bool terminal = take_common(a, study);
    const StudyResults results = run_study(scene, study);
    if (terminal) fmt::print(stderr, "\r{:60}\r", "");

    print_notes(results.warnings, a.output.quiet);
    if (results.stopped) {
        fmt::print(stderr, "innerspring: interrupted after {} cases; go on with --resume\n", results.cases);
        return 1;
    }
    if (a.output.json)
        fmt::print("{}", to_json(results));
    else
        print(results, a.directory);
    return 0;
}

}  // namespace

Command add_study(CLI::App& program) {
    CLI::App* app = program.add_subcommand("study", "The paper's experiments, and which of its claims hold");
    auto a = std::make_shared<Arguments>();
    a->app = app;
    app->add_option(
           "study", a->study,
           "refinement: the same force before and after (Fig. 6); gravity: Figs. 7 and 8; force: volume over "
           "force (Fig. 9); volume: Fig. 9 with Poisson's ratio; all: these four; truth: against linear "
           "elasticity (needs tetgen)")
        ->required()
        ->type_name("refinement|gravity|force|volume|all|truth");
    add_mesh_options(*app, a->mesh,
                     "closed surface (default sphere:vertices=1000; truth: sphere, ellipsoid and capsule, "
                     "and the sphere's series)");
    app->get_option("mesh")->required(false);
    app->add_option("-o,--output", a->directory, "folder for the results")->required()->type_name("DIR");
    add_body_options(*app, a->body);
    app->remove_option(app->get_option("--scheme"));  // a study compares them
    app->add_option("--vertices", a->vertices,
                    "loaded vertices, spread over the surface (default 12; truth 3)")
        ->type_name("N");
    app->add_option("--forces", a->forces, "forces, F/(E R^2) from 1e-4 to 1e-1 (default 8)")->type_name("N");
    app->add_option("--levels", a->levels, "levels of refinement, each alone (default 2)")->type_name("N");
    app->add_option("--radius", a->radius,
                    "radius of influence of a patch load, as a share of R (default 0.4)")
        ->type_name("SHARE");
    app->add_option("--nu", a->nu,
                    "Poisson's ratios: volume: those compared, 0 to 0.5 (default 0,0.3,0.45,0.49,0.5); "
                    "truth: that of the "
                    "linear solid, 0 to 0.495 (default 0.5 for the sphere's series, 0.49 for the elements)")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->type_name("NU[,NU...]");
    app->add_option("--tetrahedra", a->tetrahedra,
                    "truth: about so many elements in each mesh, 0.9 to 3 times (default: as few as "
                    "keep their shape)")
        ->type_name("N");
    app->add_flag(
        "--quick", a->quick,
        "4 vertices (truth: 1), 4 forces, 1 level, and shapes of 350 vertices unless MESH is given");
    app->add_option("--threads", a->threads,
                    "threads, 0 for all cores; the results do not depend on it (default 0)")
        ->type_name("N");
    app->add_flag("--resume", a->resume,
                  "go on with a study that was stopped: the cases finished in DIR are kept");
    add_output_options(*app, a->output);
    app->footer(
        "Writes report.html (open it in a browser), summary.json, and for each figure a CSV, SVG and PNG "
        "(docs/formats.md).");
    return {app, [a] { return run(*a); }};
}
