// What contact adds to a step: a sphere of 40 962 vertices, paper's material, in steps of 1 ms one at a time
// as a device would ask for them, with no tool and with tools that hold it pressed or are moved through it.
//   bench_contact --benchmark_repetitions=5 --benchmark_enable_random_interleaving=true
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>

#include "innerspring/mesh/shapes.h"
#include "innerspring/sim/refiner.h"
#include "innerspring/sim/step.h"

using namespace innerspring;

namespace {

const Body& body() {
    static const Body sphere = build_body(make_shape("icosphere:vertices=40962"));
    return sphere;
}

void steps(benchmark::State& b, const std::optional<Tool>& tool, double drawn = 0) {
    StepOptions options;
    options.dt = 1e-3;
    Workspace workspace(body(), options);
    State state = rest_state(body());
    Loads loads{Vector::Zero(), {}, {}};
    if (tool) loads.tools.push_back(*tool);
    for (int n = 0; n < 300; ++n) step(body(), loads, state, workspace);
    int n = 0;
    for (auto _ : b) {
        if (drawn > 0) {  // there and back
            Pose pose = tool->path[0].pose;
            pose.position.x() += drawn * std::sin(0.02 * ++n);
            move_to(loads.tools[0], state.time, options.dt, pose);
        }
        benchmark::DoNotOptimize(step(body(), loads, state, workspace));
    }
    b.counters["substeps"] = workspace.substeps();
    if (tool) {
        b.counters["touched"] = double(workspace.contact().vertices.size());
        b.counters["force_n"] = workspace.contact().tools[0].force.norm();
    }
}

Tool ball(double radius, double depth, double friction = 0.3) {
    return sphere_tool(radius, {0, 0, 1 + radius - depth}, friction);
}

Tool faceted() {
    SurfaceMesh mesh = make_shape("icosphere:vertices=2562");
    for (Vector& x : mesh.positions) x *= 0.3;
    return mesh_tool(mesh, {{0, 0, 1.25}}, 0.3);
}

double median(std::vector<double> times) {
    if (times.empty()) return 0;
    std::nth_element(times.begin(), times.begin() + std::ptrdiff_t(times.size() / 2), times.end());
    return times[times.size() / 2];
}

/// All in turns, twelve steps each, for a machine that others use too: what each adds to the step without a
/// tool [%], in the lower quintile of the steps, which were disturbed the least.
void in_turns(benchmark::State& b) {
    struct Case {
        std::string name;
        std::optional<Tool> tool;
        double drawn = 0;
        std::unique_ptr<Workspace> workspace;
        State state;
        std::vector<double> times;
    };
    StepOptions options;
    options.dt = 1e-3;
    std::vector<Case> cases;
    const auto add = [&](const char* name, std::optional<Tool> tool, double drawn = 0) {
        cases.push_back({name,
                         std::move(tool),
                         drawn,
                         std::make_unique<Workspace>(body(), options),
                         rest_state(body()),
                         {}});
    };
    add("none", {}), add("near", ball(0.3, -0.01)), add("ball", ball(0.3, 0.05));
    add("drawn", ball(0.3, 0.05), 0.2), add("small_ball", ball(0.02, 0.02)), add("mesh", faceted());
    add("floor", plane_tool({0, 0, -0.97}, {0, 0, 1}, 0.3));
    int n = 0;
    const auto run = [&](Case& c, int steps, int counted) {
        Loads loads{Vector::Zero(), {}, {}};
        if (c.tool) loads.tools.push_back(*c.tool);
        for (int k = 0; k < steps; ++k) {
            if (c.drawn > 0) {
                Pose pose = c.tool->path[0].pose;
                pose.position.x() += c.drawn * std::sin(0.02 * ++n);
                move_to(loads.tools[0], c.state.time, options.dt, pose);
            }
            const auto start = std::chrono::steady_clock::now();
            step(body(), loads, c.state, *c.workspace);
            const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - start;
            if (k >= steps - counted) c.times.push_back(time.count());
        }
    };
    for (Case& c : cases) run(c, 300, 0);
    std::size_t round = 0;
    for (auto _ : b) {
        ++round;
        for (std::size_t k = 0; k < cases.size(); ++k)  // seven is prime: each once, in another order
            run(cases[(k * (1 + round % 6) + round) % cases.size()], 12, 10);
    }
    const auto quintile = [](std::vector<double> times) {
        std::sort(times.begin(), times.end());
        return times.empty() ? 0 : times[times.size() / 5];
    };
    for (const Case& c : cases)
        b.counters[c.name] =
            &c == &cases[0] ? quintile(c.times) : 100 * (quintile(c.times) / quintile(cases[0].times) - 1);
}

/// The mesh follows a ball of 0.1 m that is pressed in and out at 1.5 m/s: medians of a change, and of the
/// step after one and of others [ms].
void refined(benchmark::State& b) {
    const auto shape = fmt::format("icosphere:vertices={}", b.range(0));
    std::vector<double> change, after, other;
    for (auto _ : b) {
        Body body = build_body(make_shape(shape));
        StepOptions options;
        options.dt = 1e-3;
        Workspace workspace(body, options);
        State state = rest_state(body);
        Tool tool = sphere_tool(0.1, {0, 0, 1.25}, 0.3);
        tool.path = {{0, {{0, 0, 1.25}}}, {0.2, {{0.05, 0, 0.95}}}, {0.4, {{0, 0, 1.25}}}};
        Loads loads{Vector::Zero(), {}, {}, {tool}};
        RefineRule rule;
        rule.tool_share = 0.1, rule.levels = 3;
        Refiner refiner(body, {rule});
        step(body, loads, state, workspace);  // builds the trees
        for (int n = 1; n < 400; ++n) {
            const auto milliseconds = [](auto&& work) {
                const auto start = std::chrono::steady_clock::now();
                work();
                return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
                    .count();
            };
            const int before = refiner.changes();
            const double refine = milliseconds([&] {
                refiner.before_step(state.time, options.dt, body, loads, state,
                                    [&](const Transfer& t) { workspace.adapt(body, t); });
            });
            const double step_ms = milliseconds([&] { step(body, loads, state, workspace); });
            const bool changed = refiner.changes() > before;
            if (changed) change.push_back(refine);
            (changed ? after : other).push_back(step_ms);
        }
    }
    b.counters["changes"] = double(change.size()) / double(b.iterations());
    b.counters["change_ms"] = median(change), b.counters["step_after_ms"] = median(after);
    b.counters["other_step_ms"] = median(other);
}

}  // namespace

BENCHMARK_CAPTURE(steps, no_tool, {})->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(steps, near_not_touching, ball(0.3, -0.01))->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(steps, ball_1_percent, ball(0.3, 0.05))->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(steps, ball_drawn, ball(0.3, 0.05), 0.2)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(steps, small_ball, ball(0.02, 0.02))->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(steps, mesh_of_5120_triangles, faceted())->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(steps, floor, plane_tool({0, 0, -0.97}, {0, 0, 1}, 0.3))->Unit(benchmark::kMicrosecond);
BENCHMARK(in_turns)->Unit(benchmark::kMillisecond)->Iterations(40);
BENCHMARK(refined)->Arg(10242)->Arg(40962)->Unit(benchmark::kMillisecond)->Iterations(3);

BENCHMARK_MAIN();
