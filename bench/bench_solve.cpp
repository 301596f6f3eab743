// Implicit steps and equilibria, and the factor behind them: sphere, paper's material but for the surface
// modulus, gravity and a patch load.
//   bench_solve --benchmark_out=solve.json --benchmark_out_format=json
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <chrono>

#include "innerspring/mesh/shapes.h"
#include "innerspring/sim/equilibrium.h"
#include "innerspring/sim/factor.h"
#include "innerspring/sim/step.h"

using namespace innerspring;

namespace {

Body sphere(long vertices, double surface = 1) {
    Material material;
    material.surface = surface;
    return build_body(make_shape(fmt::format("icosphere:vertices={}", vertices)), material);
}

Loads press(const Body& body, const Vector& newton = {0, 0, -0.01}) {
    Loads loads;
    loads.forces.push_back(patch_force(body, 0, 0.4, newton));
    return loads;
}

/// The first 200 steps of 1 ms from rest, over and over: the implicit step and the sub-steps it replaces.
void millisecond(benchmark::State& b, Integrator integrator) {
    const Body body = sphere(b.range(0), double(b.range(1)));
    const Loads loads = press(body);
    StepOptions options{.dt = 1e-3, .integrator = integrator};
    options.threads = int(b.range(2));
    Workspace workspace(body, options);
    State state = rest_state(body);
    double iterations = 0, unconverged = 0;
    for (auto _ : b) {
        if (state.steps == 200) state = rest_state(body);
        const StepReport report = step(body, loads, state, workspace);
        iterations += report.iterations, unconverged += !report.converged;
    }
    b.counters["substeps"] = workspace.substeps();
    b.counters["iterations"] = benchmark::Counter(iterations, benchmark::Counter::kAvgIterations);
    b.counters["unconverged"] = unconverged;
}

void balance(benchmark::State& b, double pull) {
    const Body body = sphere(b.range(0));
    const Vector outward = body.rest.positions[0].normalized();
    const Loads loads = press(body, pull != 0 ? Vector(pull * outward) : Vector(0, 0, -0.01));
    EquilibriumReport report;
    for (auto _ : b) {
        State state = rest_state(body);
        report = solve_equilibrium(body, loads, state, {.threads = int(b.range(1))});
    }
    b.counters["reached"] = report.reached;
    b.counters["iterations"] = report.iterations;
    b.counters["products"] = report.products;
    b.counters["residual_over_load"] = report.residual_n / load_sum(body, loads, 0);
}

/// The matrix of an implicit step of 1 ms.
std::vector<double> diagonal(const Body& body) {
    std::vector<double> d(body.vertices());
    for (std::size_t i = 0; i < d.size(); ++i) d[i] = body.m[i] * 1e6 + body.c[i] * 1e3 + body.K[i];
    return d;
}

void order(benchmark::State& b) {
    const Body body = sphere(b.range(0), 100);
    for (auto _ : b) benchmark::DoNotOptimize(dissect(body));
}

void factorize(benchmark::State& b) {
    const Body body = sphere(b.range(0), 100);
    Factor factor(body);
    const auto d = diagonal(body);
    const std::vector<bool> pinned(body.vertices(), false);
    for (auto _ : b) factor.factorize(body, d, pinned);
    b.counters["kept_per_vertex"] = double(factor.entries()) / double(body.vertices());
}

void solve(benchmark::State& b) {
    const Body body = sphere(b.range(0), 100);
    Factor factor(body);
    factor.factorize(body, diagonal(body), std::vector<bool>(body.vertices(), false));
    std::vector<Vector> x(body.vertices());
    for (auto _ : b) {
        factor.solve(body.rest.positions.data(), x.data());
        benchmark::DoNotOptimize(x.data());
    }
}

/// About 100 triangles refined and taken back; `adapt_ms` is the factor's part of the first half.
void adapt(benchmark::State& b) {
    Body body = sphere(b.range(0), 100);
    const Index vertex = 1000;
    const double spacing = std::sqrt(4 * 3.14159 / double(body.vertices()));
    State state = rest_state(body);
    Subdivision history(body.rest);
    Factor factor(body);
    factor.factorize(body, diagonal(body), std::vector<bool>(body.vertices(), false));
    double adapting = 0, nodes = 0;
    for (auto _ : b) {
        const auto patch = triangles_near(body.rest, body.rest.positions[vertex], 3.2 * spacing);
        const Transfer there = refine(body, history, state, patch);
        const auto d = diagonal(body);
        const std::vector<bool> pinned(body.vertices(), false);
        const auto start = std::chrono::steady_clock::now();
        factor.adapt(body, d, pinned, there.surface, there.body);
        adapting += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        nodes += factor.nodes_made();
        const Transfer back = coarsen(body, history, state, [](auto&&...) { return false; });
        factor.adapt(body, diagonal(body), std::vector<bool>(body.vertices(), false), back.surface,
                     back.body);
    }
    b.counters["adapt_ms"] = benchmark::Counter(1e3 * adapting, benchmark::Counter::kAvgIterations);
    b.counters["nodes"] = benchmark::Counter(nodes, benchmark::Counter::kAvgIterations);
    b.counters["of_nodes"] = double(factor.tree().nodes.size());
}

}  // namespace

BENCHMARK_CAPTURE(millisecond, implicit, Integrator::implicit)
    ->ArgsProduct({{642, 10242}, {1, 10, 100, 1000, 10000}, {1}})
    ->Args({10242, 100, 2})
    ->ArgNames({"vertices", "E_s", "threads"})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(millisecond, symplectic, Integrator::symplectic)
    ->ArgsProduct({{642, 10242}, {1, 10, 100, 1000, 10000}, {1}})
    ->ArgNames({"vertices", "E_s", "threads"})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(balance, push, 0.0)
    ->ArgsProduct({{642, 2562, 10242, 40962, 163842}, {1}})
    ->Args({163842, 2})
    ->ArgNames({"vertices", "threads"})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(balance, press, -0.01)
    ->ArgsProduct({{642, 2562, 10242, 40962, 163842}, {1}})
    ->Args({163842, 2})
    ->ArgNames({"vertices", "threads"})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(balance, light_press, -1e-4)
    ->ArgsProduct({{642, 2562, 10242, 40962, 163842}, {1}})
    ->ArgNames({"vertices", "threads"})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(balance, pull, 0.01)
    ->ArgsProduct({{642, 2562, 10242, 163842}, {1}})
    ->ArgNames({"vertices", "threads"})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(balance, light_pull, 1e-4)
    ->ArgsProduct({{642, 2562, 10242, 163842}, {1}})
    ->ArgNames({"vertices", "threads"})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(order)->Arg(642)->Arg(10242)->Arg(163842)->ArgName("vertices")->Unit(benchmark::kMillisecond);
BENCHMARK(factorize)->Arg(642)->Arg(10242)->Arg(163842)->ArgName("vertices")->Unit(benchmark::kMillisecond);
BENCHMARK(solve)->Arg(642)->Arg(10242)->Arg(163842)->ArgName("vertices")->Unit(benchmark::kMillisecond);
BENCHMARK(adapt)->Arg(2562)->Arg(10242)->Arg(163842)->ArgName("vertices")->Unit(benchmark::kMillisecond);

BENCHMARK_MAIN();
