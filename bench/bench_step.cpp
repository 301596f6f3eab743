// The parts of the library by themselves on spheres of 642 to 1 000 000 vertices, paper's material: steps
// under gravity and a patch load, equilibrium, building a body, refining it, reading it. bench_peers compares
// with others, bench_scale follows time and memory on the way from a file to a body.
//   bench_step --benchmark_out=step.json --benchmark_out_format=json
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <chrono>
#include <map>
#include <tuple>

#include "innerspring/mesh/read.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/weld.h"
#include "innerspring/mesh/write.h"
#include "innerspring/sim/equilibrium.h"
#include "innerspring/sim/measure.h"
#include "innerspring/sim/stability.h"
#include "innerspring/sim/step.h"

using namespace innerspring;

namespace {

const Body& sphere_body(long vertices, bool free, double poisson = 0, int fibres = 0) {
    static std::map<std::tuple<long, bool, double, int>, Body> bodies;
    const std::tuple key(vertices, free, poisson, fibres);
    auto it = bodies.find(key);
    if (it == bodies.end()) {
        BodyOptions options;
        options.free = free;
        Material material;
        material.poisson = poisson;
        if (fibres) {
            material.anisotropy.kind = Anisotropy::Kind::fibres;
            material.anisotropy.along = 20, material.anisotropy.direction = Vector(1, 2, 3);
            if (fibres == 2) material.anisotropy.course = Anisotropy::Course::around;
        }
        const SurfaceMesh mesh = make_shape(fmt::format("icosphere:vertices={}", vertices));
        it = bodies.emplace(key, build_body(mesh, material, options)).first;
    }
    return it->second;
}

Loads press(const Body& body) {
    Loads loads;
    loads.forces.push_back(patch_force(body, 0, 0.4, Vector(0, 0, -0.01)));
    return loads;
}

void per_vertex(benchmark::State& b, const Body& body, double steps) {
    b.counters["per_vertex_step"] =
        benchmark::Counter(double(body.vertices()) * steps,
                           benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// A hundred symplectic Euler steps per iteration, the state read before and written after.
void symplectic(benchmark::State& b, bool free, Precision precision, bool with_volume = false,
                double poisson = 0, int fibres = 0) {
    const Body& body = sphere_body(b.range(0), free, poisson, fibres);
    StepOptions options;
    options.integrator = Integrator::symplectic;
    options.precision = precision;
    options.volume = with_volume;
    options.threads = int(b.range(1));
    options.dt = 0.99 * step_safety * largest_stable_step(body);
    Workspace workspace(body, options);
    State state = rest_state(body);
    const Loads loads = press(body);
    for (auto _ : b) benchmark::DoNotOptimize(step(body, loads, state, workspace, 100));
    per_vertex(b, body, 100);
}

/// One implicit step of 0.01 s per iteration.
void implicit(benchmark::State& b) {
    const Body& body = sphere_body(b.range(0), false);
    StepOptions options;
    options.integrator = Integrator::implicit;
    options.threads = int(b.range(1));
    Workspace workspace(body, options);
    State state = rest_state(body);
    const Loads loads = press(body);
    for (auto _ : b) benchmark::DoNotOptimize(step(body, loads, state, workspace));
    per_vertex(b, body, 1);
}

void equilibrium(benchmark::State& b) {
    const Body& body = sphere_body(b.range(0), false);
    const Loads loads = press(body);
    for (auto _ : b) {
        State state = rest_state(body);
        benchmark::DoNotOptimize(solve_equilibrium(body, loads, state));
    }
}

void build(benchmark::State& b) {
    const SurfaceMesh mesh = make_shape(fmt::format("icosphere:vertices={}", b.range(0)));
    for (auto _ : b) benchmark::DoNotOptimize(build_body(mesh));
    b.counters["per_vertex"] =
        benchmark::Counter(double(mesh.positions.size()),
                           benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// A patch of about 100 triangles refined in place and taken back, each with all that the next step needs:
/// masses and springs, the motion, a patch load, and the stable step. `refine_ms` is the first half alone.
void refine_patch(benchmark::State& b) {
    Body body = sphere_body(b.range(0), false);
    const Index vertex = 1000;
    const double spacing = std::sqrt(4 * 3.14159 / double(body.vertices()));
    Loads loads;
    loads.forces.push_back(patch_force(body, vertex, 5 * spacing, Vector(0, 0, -0.01)));
    State state = rest_state(body);
    Subdivision history(body.rest);
    Workspace workspace(body, {.dt = 1e-4});
    const std::size_t room = 4000;
    reserve(body, room), history.reserve(room), workspace.reserve(room);
    state.x.reserve(state.x.size() + room), state.v.reserve(state.v.size() + room);
    const std::vector<Index> patch = triangles_near(body.rest, body.rest.positions[vertex], 3.2 * spacing);
    double refining = 0;
    auto follow = [&](const Transfer& change) {
        carry_over(loads, body, change);
        workspace.adapt(body, change);
    };
    std::vector<Index> again = patch;
    for (auto _ : b) {
        const auto start = std::chrono::steady_clock::now();
        follow(refine(body, history, state, again));
        refining += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        follow(coarsen(body, history, state, [](auto&&...) { return false; }));
        b.PauseTiming();
        again = triangles_near(body.rest, body.rest.positions[vertex], 3.2 * spacing);
        b.ResumeTiming();
    }
    b.counters["triangles"] = double(patch.size());
    b.counters["refine_ms"] = benchmark::Counter(1e3 * refining, benchmark::Counter::kAvgIterations);
}

/// A binary STL read from memory and welded.
void read_stl(benchmark::State& b) {
    const std::string bytes = to_stl_binary(make_shape(fmt::format("icosphere:vertices={}", b.range(0))));
    for (auto _ : b) benchmark::DoNotOptimize(weld(read_from_memory(bytes, "sphere.stl")));
    b.counters["per_vertex"] = benchmark::Counter(
        double(b.range(0)), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

}  // namespace

BENCHMARK_CAPTURE(symplectic, single, false, Precision::single)
    ->ArgsProduct({{642, 10242, 163842, 1000000}, {1, 2}})
    ->ArgNames({"vertices", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(symplectic, single_with_volume, false, Precision::single, true)
    ->ArgsProduct({{642, 10242, 163842, 1000000}, {1, 2}})
    ->ArgNames({"vertices", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(symplectic, single_poisson, false, Precision::single, false, 0.4)
    ->ArgsProduct({{642, 10242, 163842, 1000000}, {1, 2}})
    ->ArgNames({"vertices", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(symplectic, held, false, Precision::full)
    ->ArgsProduct({{642, 10242, 163842, 1000000}, {1, 2}})
    ->ArgNames({"vertices", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(symplectic, held_poisson, false, Precision::full, false, 0.4)
    ->ArgsProduct({{642, 10242}, {1}})
    ->ArgNames({"vertices", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(symplectic, free, true, Precision::full)
    ->ArgsProduct({{642, 10242, 163842, 1000000}, {1, 2}})
    ->ArgNames({"vertices", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(symplectic, single_fibres, false, Precision::single, false, 0, 1)
    ->ArgsProduct({{642, 10242, 163842}, {1}})
    ->ArgNames({"vertices", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(symplectic, held_fibres, false, Precision::full, false, 0, 1)
    ->ArgsProduct({{642, 10242}, {1}})
    ->ArgNames({"vertices", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(symplectic, free_fibres_around, true, Precision::full, false, 0, 2)
    ->ArgsProduct({{642, 10242}, {1}})
    ->ArgNames({"vertices", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(symplectic, free_fibres, true, Precision::full, false, 0, 1)
    ->ArgsProduct({{642, 10242}, {1}})
    ->ArgNames({"vertices", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(implicit)
    ->ArgsProduct({{642, 10242}, {1, 2}})
    ->ArgNames({"vertices", "threads"})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(equilibrium)->Arg(642)->Arg(2562)->ArgName("vertices")->Unit(benchmark::kMillisecond);
BENCHMARK(build)
    ->Arg(642)
    ->Arg(10242)
    ->Arg(163842)
    ->Arg(1000000)
    ->ArgName("vertices")
    ->Unit(benchmark::kMillisecond);
BENCHMARK(refine_patch)
    ->Arg(2562)
    ->Arg(200000)
    ->Arg(1000000)
    ->ArgName("vertices")
    ->Unit(benchmark::kMillisecond);
BENCHMARK(read_stl)
    ->Arg(642)
    ->Arg(10242)
    ->Arg(163842)
    ->Arg(1000000)
    ->ArgName("vertices")
    ->Unit(benchmark::kMillisecond);

BENCHMARK_MAIN();
