#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "commands.h"
#include "innerspring/mesh/check.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/team.h"
#include "innerspring/mesh/write.h"
#include "innerspring/sim/measure.h"
#include "innerspring/sim/packed.h"
#include "innerspring/sim/stability.h"
#include "innerspring/sim/step.h"
#include "innerspring/version.h"
#include "options.h"

using namespace innerspring;

namespace {

struct Arguments {
    MeshOptions mesh;
    BodyArguments body;
    OutputOptions output;
    double seconds = 1;
};

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Explicit steps of one sub-step each.
struct Stepping {
    std::string kernel;  ///< a vector kernel, or "double"
    int threads = 1;
    double ns_per_vertex = 0;                    ///< steps_at_a_time together, median
    double p50_us = 0, p99_us = 0, p999_us = 0;  ///< a step alone, the state read and written
    double bandwidth_gb_s = 0;                   ///< what the machine streams over as many bytes
    double memory_ns = 0, compute_ns = 0;        ///< per vertex and step, if that were all there is
};

/// Many, so that reading and writing the state does not count; fewer where they take long.
int steps_at_a_time(const Body& body) {
    return std::clamp(int(5e7 / double(body.vertices())), 10, 100);
}

struct Phase {
    std::string_view name;
    double seconds;
};

/// Bytes that one step moves per vertex, each array once (sim/packed.h).
double bytes_per_vertex(const Body& body) {
    const double spokes = 2 * double(body.edges.size()) / double(body.vertices());
    return 2 * sizeof(PackedRow) + 2 * 12 + 12 + 8 * spokes;
}

/// The shortest of repeated calls [s]: what the machine can do when nothing disturbs it.
template <class Action>
double shortest(double budget_s, Action&& action) {
    double least = INFINITY;
    for (const auto start = Clock::now(); seconds_since(start) < budget_s;) {
        const auto before = Clock::now();
        action();
        least = std::min(least, seconds_since(before));
    }
    return least;
}

/// Bytes a second [GB/s] of a = b + 2 c over arrays of `bytes` in all: whichever cache or memory holds them.
double triad(double bytes, int threads) {
    const std::size_t n = std::max<std::size_t>(4096, std::size_t(bytes / 24)), parts = std::size_t(threads);
    std::vector<double> a(n), b(n, 1.0), c(n, 2.0);
    Team team(threads);
    const double s = shortest(0.2, [&] {
        team.run(parts, [&](std::size_t part) {
            for (std::size_t i = n * part / parts; i < n * (part + 1) / parts; ++i) a[i] = b[i] + 2 * c[i];
        });
        std::swap(a, b);
    });
    return 24e-9 * double(n) / s;
}

double quantile(const std::vector<double>& sorted, double q) {
    return sorted[std::min(sorted.size() - 1, std::size_t(q * double(sorted.size())))];
}

Stepping time_steps(const Body& body, StepOptions options, double seconds) {
    options.integrator = Integrator::symplectic;
    options.dt = 0.99 * step_safety * largest_stable_step(body);
    Workspace workspace(body, options);
    State state = rest_state(body);
    Loads loads;
    const Vector inward = -vertex_normals(body.rest.positions, body.rest.triangles)[0];
    loads.forces.push_back(patch_force(body, 0, 0.4 * body.radius,
                                       1e-3 * body.material.young * body.radius * body.radius * inward));
    const auto sample = [&](int count, double budget_s) {
        std::vector<double> times;
        const auto start = Clock::now();
        for (auto before = start; times.size() < 5 || seconds_since(start) < budget_s;) {
            step(body, loads, state, workspace, count);
            const auto now = Clock::now();
            times.push_back(std::chrono::duration<double>(now - before).count() / count);
            before = now;
        }
        std::sort(times.begin(), times.end());
        return times;
    };
    const int together = steps_at_a_time(body);
    sample(together, 0.1 * seconds);  // warm
    Stepping s{workspace.precision() == Precision::single
                   ? options.kernel ? options.kernel->name : vector_kernels().front()->name
                   : "double",
               options.threads};
    s.ns_per_vertex = 1e9 * quantile(sample(together, seconds / 2), 0.5) / double(body.vertices());
    const std::vector<double> alone = sample(1, seconds / 2);
    s.p50_us = 1e6 * quantile(alone, 0.5);
    s.p99_us = 1e6 * quantile(alone, 0.99);
    s.p999_us = 1e6 * quantile(alone, 0.999);
    return s;
}

/// The kernel's own pace [ns per vertex]: a body so small that all lies in the first cache.
double compute_pace(const Material& material) {
    const Body small = build_body(make_shape("icosphere:vertices=162"), material);
    Packed packed = pack(small);
    Team alone(1);
    const double h = 0.5 * largest_stable_step(small);
    return 1e9 / double(small.vertices()) *
           shortest(0.1, [&] { advance(packed, *vector_kernels().front(), h, Vector::Zero(), alone); });
}

std::string processor() {
    std::ifstream in("/proc/cpuinfo");
    for (std::string line; std::getline(in, line);)
        if (line.starts_with("model name")) return line.substr(std::min(line.size(), line.find(':') + 2));
    return "unknown processor";
}

std::string_view bound(const Stepping& s) {
    return s.memory_ns > s.compute_ns ? "memory" : "compute";
}

int run(const Arguments& a) {
    if (!(a.seconds > 0 && a.seconds <= 3600)) throw InputError("--seconds: from above 0 to 3600");
    Scene scene;
    scene.mesh = a.mesh.mesh.empty() ? "icosphere:vertices=10242" : a.mesh.mesh;
    apply(a.mesh, scene);
    apply(a.body, scene);

    std::vector<Phase> phases;
    auto timed = [&](std::string_view name, auto&& action) {
        const auto start = Clock::now();
        auto result = action();
        phases.push_back({name, seconds_since(start)});
        return result;
    };
    LoadedMesh loaded = timed("read or make, weld",
                              [&] { return load_mesh(scene.mesh, scene.unit, scene.normalize, scene.weld); });
    print_notes(loaded.notes, a.output.quiet);
    timed("check", [&] { return check(loaded.mesh).vertices; });
    const Body body = timed("build the body", [&] {
        return build_body(std::move(loaded.mesh), scene.material, {scene.scheme, scene.centre, false});
    });
    timed("stable step", [&] { return largest_stable_step(body); });
    timed("volume (Eq. 4)", [&] { return volume(body.rest); });
    timed("all measures", [&] { return measure(body, {}, rest_state(body)).volume; });

    const double pace = compute_pace(body.material);
    std::vector<Stepping> steps, kernels;
    for (int threads : {1, 2}) {
        StepOptions options;
        options.threads = threads;
        Stepping& s = steps.emplace_back(time_steps(body, options, a.seconds));
        s.bandwidth_gb_s = triad(double(body.vertices()) * bytes_per_vertex(body), threads);
        s.memory_ns = bytes_per_vertex(body) / s.bandwidth_gb_s;
        s.compute_ns = pace / threads;
    }
    for (const VectorKernels* kernel : vector_kernels())
        kernels.push_back(time_steps(body, {.kernel = kernel}, a.seconds / 4));
    kernels.push_back(time_steps(body, {.precision = Precision::full}, a.seconds / 4));
    const Stepping& best = steps[0].ns_per_vertex < steps[1].ns_per_vertex ? steps[0] : steps[1];
    const auto sustained = [&](double hz) { return std::size_t(1e9 / hz / best.ns_per_vertex); };

    if (a.output.json) {
        nlohmann::ordered_json j;
        j["version"] = version;
        j["machine"] = {{"processor", processor()}, {"threads", std::thread::hardware_concurrency()}};
        j["mesh"] = {{"name", body.rest.name},
                     {"vertices", body.vertices()},
                     {"triangles", body.rest.triangles.size()}};
        j["bytes_per_vertex_step"] = bytes_per_vertex(body);
        for (const Stepping& s : steps) {
            const std::string key = fmt::format("threads_{}", s.threads);
            j["ns_per_vertex_step"][key] = s.ns_per_vertex;
            j["step_us"][key] = {{"p50", s.p50_us}, {"p99", s.p99_us}, {"p99_9", s.p999_us}};
            j["bounds_ns_per_vertex_step"][key] = {{"memory", s.memory_ns},
                                                   {"compute", s.compute_ns},
                                                   {"applies", bound(s)},
                                                   {"bandwidth_gb_s", s.bandwidth_gb_s}};
        }
        for (const Stepping& s : kernels) j["kernels_ns_per_vertex_step"][s.kernel] = s.ns_per_vertex;
        j["vertices_sustained"] = {{"at_1000_hz", sustained(1000)}, {"at_60_hz", sustained(60)}};
        for (const Phase& p : phases) j["phases_s"][std::string(p.name)] = p.seconds;
        fmt::print("{}\n", j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
        return 0;
    }
    fmt::print("{}: {} vertices, {} triangles; {}\n\n", body.rest.name, body.vertices(),
               body.rest.triangles.size(), processor());
    for (const Stepping& s : steps) {
        fmt::print("  {} thread{}, kernel {}\n", s.threads, s.threads == 1 ? "" : "s", s.kernel);
        print_row("  per vertex and step", fmt::format("{:.3g} ns ({} steps at a time, the median)",
                                                       s.ns_per_vertex, steps_at_a_time(body)));
        print_row("  a step alone",
                  fmt::format("{:.4g} us (median), {:.4g} (p99), {:.4g} (p99.9), state read and written",
                              s.p50_us, s.p99_us, s.p999_us));
        print_row("  bounds",
                  fmt::format("memory {:.3g} ns ({:.0f} B at {:.0f} GB/s), compute {:.3g} ns "
                              "(all in the first cache): {} comes first",
                              s.memory_ns, bytes_per_vertex(body), s.bandwidth_gb_s, s.compute_ns, bound(s)));
    }
    std::string each;
    for (const Stepping& s : kernels)
        each += fmt::format("{}{} {:.3g} ns", each.empty() ? "" : ", ", s.kernel, s.ns_per_vertex);
    print_row("kernels, one thread", each);
    fmt::print("\n");
    print_row("vertices at 1 kHz", fmt::format("{} (one explicit step each)", sustained(1000)));
    print_row("vertices at 60 Hz", fmt::format("{}", sustained(60)));
    fmt::print("\n");
    for (const Phase& p : phases)
        print_row(p.name, fmt::format("{:.4g} ms, {:.4g} ns per vertex", 1e3 * p.seconds,
                                      1e9 * p.seconds / double(body.vertices())));
    return 0;
}

}  // namespace

Command add_bench(CLI::App& program) {
    CLI::App* app = program.add_subcommand(
        "bench", "How fast is this machine on a mesh: time of a step, vertices at 1 kHz, what bounds it");
    auto a = std::make_shared<Arguments>();
    add_mesh_options(*app, a->mesh, "closed surface (default icosphere:vertices=10242)");
    app->get_option("mesh")->required(false);
    add_body_options(*app, a->body);
    app->add_option("--seconds", a->seconds, "time to step for, on one thread and on two [s] (default 1)")
        ->type_name("S");
    add_output_options(*app, a->output);
    app->footer("Explicit steps of a held body under gravity and a patch load.");
    return {app, [a] { return run(*a); }};
}
