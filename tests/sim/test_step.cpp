#include "innerspring/sim/step.h"

#include <gtest/gtest.h>

#include "innerspring/mesh/error.h"
#include "innerspring/sim/equilibrium.h"
#include "innerspring/sim/stability.h"
#include "sim/allocations.h"
#include "support/bodies.h"

namespace innerspring {
namespace {

using namespace support;

constexpr Integrator integrators[] = {Integrator::symplectic, Integrator::implicit};

StepOptions with(Integrator integrator, double dt = 0.01, int threads = 1) {
    StepOptions options;
    options.integrator = integrator;
    options.dt = dt;
    options.threads = threads;
    return options;
}

/// Gravity and a force that comes and goes.
Loads busy_loads(const Body& body) {
    Loads loads = gravity_only({1, -9.81, 0.5});
    loads.forces = {patch_force(body, densest_vertex(body), 0.4, {0.2, 0.1, -0.4}),
                    point_force(3, {0.01, 0, 0})};
    loads.forces[0].profile.points = {{0, 0}, {0.05, 1}, {0.1, 0.5}};
    return loads;
}

void run(const Body& body, const Loads& loads, const StepOptions& options, int steps, State& state) {
    Workspace workspace(body, options);
    for (int n = 0; n < steps; ++n) {
        const StepReport report = step(body, loads, state, workspace);
        ASSERT_EQ(report.not_finite, no_index);
        ASSERT_TRUE(report.converged) << "residual " << report.residual;
    }
}

TEST(Step, SameBitsForAnyNumberOfThreadsAndOverRuns) {
    for (bool free : {false, true})
        for (Integrator integrator : integrators) {
            BodyRecipe recipe;
            recipe.free = free;
            const Body body = make_body("sphere:vertices=1100,irregularity=3", recipe);
            const Loads loads = busy_loads(body);
            std::uint64_t first = 0;
            for (int threads : {1, 1, 2, 4}) {
                State state = random_state(body, 1, 1e-3, 0.1);
                run(body, loads, with(integrator, 0.01, threads), 5, state);
                if (first == 0) first = state_hash(state);
                EXPECT_EQ(state_hash(state), first)
                    << threads << " threads, free " << free << " " << to_string(integrator);
            }
        }
}

TEST(Step, GoingOnFromACopyIsNotStopping) {
    for (bool free : {false, true})
        for (Integrator integrator : integrators) {
            BodyRecipe recipe;
            recipe.free = free;
            const Body body = make_body("sphere:vertices=300,irregularity=3", recipe);
            const Loads loads = busy_loads(body);
            State whole = rest_state(body), part = whole;
            run(body, loads, with(integrator), 20, whole);
            run(body, loads, with(integrator), 7, part);
            State copy = part;
            run(body, loads, with(integrator), 13, copy);
            EXPECT_EQ(state_hash(copy), state_hash(whole)) << "free " << free << " " << to_string(integrator);
            EXPECT_EQ(whole.steps, 20u);
        }
}

TEST(Step, AWorkspaceRemembersNothingOfEarlierLoads) {
    const Body body = make_body("sphere:vertices=300");
    Loads first = one_force(point_force(5, {0, 0, 0.01})), second = one_force(point_force(6, {0, 0.01, 0}));
    first.pins = {{{10, 11}, {}}};
    second.pins = {{{12}, {}}};
    for (Integrator integrator : integrators) {
        Workspace workspace(body, with(integrator));
        State state = rest_state(body);
        step(body, first, state, workspace);
        State fresh_state = state;
        Workspace fresh(body, with(integrator));
        for (const Loads& loads : {second, no_loads(), first}) {
            step(body, loads, state, workspace);
            step(body, loads, fresh_state, fresh);
            fresh = Workspace(body, with(integrator));
            ASSERT_EQ(state_hash(state), state_hash(fresh_state)) << to_string(integrator);
        }
    }
}

void expect_implicit_tends_to_symplectic(bool linearised) {
    for (bool free : {false, true}) {
        BodyRecipe recipe;
        recipe.free = free;
        recipe.damping = 0.2;
        const Body body = make_body("sphere:vertices=100", recipe);
        const Loads loads = one_force(patch_force(body, 4, 0.6, {0.05, -0.2, 0.1}));
        constexpr double end = 0.08;
        auto arrive = [&](Integrator integrator, int steps) {
            State state = rest_state(body);
            StepOptions options = with(integrator, end / steps);
            options.tolerance = 1e-10;
            options.linearised = linearised;
            run(body, loads, options, steps, state);
            return state;
        };
        const State truth = arrive(Integrator::symplectic, 6000);
        double before = 0;
        for (int steps : {40, 80, 160}) {
            const double error = distance(arrive(Integrator::implicit, steps), truth);
            if (before > 0) {
                EXPECT_NEAR(before / error, 2, 0.35) << "free " << free << " " << steps;
            }
            before = error;
        }
        EXPECT_LT(before, 0.05 * distance(truth, rest_state(body)));
    }
}

TEST(Step, ImplicitTendsToSymplecticAtFirstOrder) {
    expect_implicit_tends_to_symplectic(false);
}

// One Newton step is another step, of the same order.
TEST(Step, LinearisedImplicitTendsToSymplecticAtFirstOrder) {
    expect_implicit_tends_to_symplectic(true);
}

// No more than that: under a large load the residual of one linear solve is left over.
TEST(Step, LinearisedTakesOneNewtonStep) {
    const Body body = make_body("sphere:vertices=300", {.surface = 30});
    const Loads loads = one_force(patch_force(body, 8, 0.5, {0, -0.3, 0.1}));
    StepOptions options = with(Integrator::implicit, 0.02);
    options.tolerance = 1e-8;
    const auto first = [&](bool linearised) {
        options.linearised = linearised;
        Workspace workspace(body, options);
        State state = rest_state(body);
        const StepReport report = step(body, loads, state, workspace);
        EXPECT_TRUE(report.converged);
        return report;
    };
    const StepReport one = first(true), all = first(false);
    EXPECT_GT(one.residual, 100 * all.residual);
    EXPECT_LT(one.residual, 0.1 * 0.32) << "of the load, which one exact solve takes up nearly";
}

TEST(Step, ComesToRestInEquilibrium) {
    for (bool free : {false, true})
        for (Integrator integrator : integrators) {
            if (free && INNERSPRING_SANITIZED) continue;  // swings for long
            BodyRecipe recipe;
            recipe.free = free;
            const Body body = make_body("sphere:vertices=120,irregularity=3", recipe);
            Loads loads = gravity_only();
            loads.forces = {patch_force(body, 8, 0.5, {0.1, 0.1, 0})};
            // A free body hangs from its upper cap.
            if (free) {
                loads.pins.emplace_back();
                for (Index i = 0; i < body.vertices(); ++i)
                    if (body.rest.positions[i].y() > 0.6) loads.pins[0].vertices.push_back(i);
            }
            State still = rest_state(body), state = rest_state(body);
            ASSERT_TRUE(solve_equilibrium(body, loads, still).reached);
            StepOptions options = with(integrator);
            options.tolerance = 1e-9;
            // What hangs from its pins swings long: its homes swing along, and rigid motion is not damped.
            run(body, loads, options, free ? 1250 : 200, state);
            EXPECT_LT(distance(state, still), 1e-5 * distance(still, rest_state(body)))
                << "free " << free << " " << to_string(integrator);
        }
}

TEST(Step, ImplicitHoldsWithHugeStepsAndStiffness) {
    BodyRecipe recipe;
    recipe.surface = 1e4;
    const Body body = make_body("sphere:vertices=400,irregularity=3", recipe);
    Loads loads = gravity_only();
    loads.forces = {patch_force(body, 8, 0.5, {0, 0, -1})};
    Workspace workspace(body, with(Integrator::implicit, 0.1));
    State state = rest_state(body), still = state;
    for (int n = 0; n < 30; ++n) {
        const StepReport report = step(body, loads, state, workspace);
        ASSERT_EQ(report.not_finite, no_index);
        ASSERT_TRUE(report.converged)
            << "step " << n << " residual " << report.residual << " after " << report.iterations;
        const Measures now = measure(body, loads, state);
        ASSERT_LE(now.kinetic + now.elastic, 1.01 * -now.potential + 1e-12) << n;
    }
    ASSERT_TRUE(solve_equilibrium(body, loads, still).reached);
    EXPECT_LT(distance(state, still), 1e-3 * distance(still, rest_state(body)));
}

// Stable and solved at any stiffness and step, and never with more energy than the loads have put in.
TEST(Step, ImplicitHoldsFromSoftToHardSurfaces) {
    for (double surface : {1e2, 1e4, 1e6})
        for (double dt : {1e-3, 1e-2, 1.0}) {
            const Body body = make_body("icosphere:vertices=642", {.surface = surface});
            Loads loads = gravity_only();
            loads.forces = {patch_force(body, 8, 0.5, {0, 0, -0.1})};
            Workspace workspace(body, with(Integrator::implicit, dt));
            State state = rest_state(body);
            for (int n = 0; n < 5; ++n) {
                const StepReport report = step(body, loads, state, workspace);
                ASSERT_TRUE(report.converged) << surface << " " << dt << " residual " << report.residual;
                const Measures now = measure(body, loads, state);
                ASSERT_LE(now.kinetic + now.elastic, 1.01 * -now.potential + 1e-12) << surface << " " << dt;
            }
        }
}

// The default tolerance leaves less error than the step itself makes.
TEST(Step, ImplicitToleranceIsFinerThanTheStep) {
    const Body body = make_body("icosphere:vertices=642", {.surface = 30});
    const Loads loads = one_force(patch_force(body, 0, 0.4, {0, 0, -0.01}));
    auto arrive = [&](Integrator integrator, double tolerance) {
        StepOptions options = with(integrator, 1e-3);
        if (tolerance > 0) options.tolerance = tolerance;
        State state = rest_state(body);
        run(body, loads, options, 60, state);
        return state;
    };
    const State exact = arrive(Integrator::implicit, 1e-10), truth = arrive(Integrator::symplectic, 0);
    EXPECT_LT(distance(arrive(Integrator::implicit, 0), exact), 0.2 * distance(exact, truth));
}

TEST(Step, PinsAndPrescribedMotionAreExact) {
    for (bool free : {false, true})
        for (Integrator integrator : integrators) {
            BodyRecipe recipe;
            recipe.free = free;
            const Body body = make_body("sphere:vertices=200", recipe);
            Loads loads = busy_loads(body);
            loads.pins = {
                {{1, 2, 3}, {}},
                {{50, 51}, {{0, Vector::Zero()}, {0.1, Vector(0, 0.2, 0)}, {0.15, Vector(0.1, 0.2, 0)}}}};
            ASSERT_NO_THROW(require_valid(body, loads));
            Workspace workspace(body, with(integrator));
            State state = rest_state(body);
            for (int n = 1; n <= 25; ++n) {
                step(body, loads, state, workspace);
                for (const Pin& pin : loads.pins)
                    for (Index i : pin.vertices) {
                        // The time of the last sub-step and that of the step may differ in the last bit.
                        ASSERT_LT((state.x[i] - body.rest.positions[i] - offset_at(pin, state.time)).norm(),
                                  1e-14)
                            << n;
                        if (n > 1 && n < 10 && i >= 50) {
                            ASSERT_LT((state.v[i] - Vector(0, 2, 0)).norm(), 1e-9) << n;
                        }
                        if (i < 4) {
                            ASSERT_LT(state.v[i].norm(), 1e-12);
                        }
                    }
            }
            EXPECT_GT((state.x[52] - body.rest.positions[52]).norm(), 1e-4) << "the others are not pinned";
        }
}

TEST(Step, AHugeForceIsSeenAndTheLastGoodStateKept) {
    for (bool free : {false, true})
        for (Integrator integrator : integrators)
            for (double newton : {1e150, 1e300}) {
                BodyRecipe recipe;
                recipe.free = free;
                const Body body = make_body("sphere:vertices=200", recipe);
                Loads loads = busy_loads(body);
                loads.forces.push_back(point_force(17, {0, 0, newton}));
                loads.forces.back().profile.points = {{0.045, 0}, {0.0451, 1}};
                Workspace workspace(body, with(integrator));
                State state = rest_state(body);
                StepReport report;
                int steps = 0;
                for (; steps < 20 && report.not_finite == no_index; ++steps)
                    report = step(body, loads, state, workspace);
                EXPECT_NE(report.not_finite, no_index) << to_string(integrator) << " " << newton;
                EXPECT_LE(steps, 6);
                EXPECT_LT(state.time, 0.06);
                for (std::size_t i = 0; i < body.vertices(); ++i) {
                    ASSERT_LT((state.x[i] - body.rest.positions[i]).norm(), 1e100);
                    ASSERT_LT(state.v[i].norm(), 1e100);
                }
                EXPECT_EQ(state.steps, std::uint64_t(steps - 1));
            }
}

TEST(Step, AllocatesNothingForAHeldBody) {
    if (INNERSPRING_SANITIZED) GTEST_SKIP() << "a sanitizer has its own operator new";
    const Body body = make_body("sphere:vertices=1200");
    Loads loads = busy_loads(body);
    loads.pins = {{{1, 2, 3}, {{0, Vector::Zero()}, {1, Vector(0, 0.1, 0)}}}};
    for (Integrator integrator : integrators)
        for (int threads : {1, 2}) {
            Workspace workspace(body, with(integrator, 0.01, threads));
            State state = rest_state(body);
            step(body, loads, state, workspace);
            const long before = allocations();
            for (int n = 0; n < 10; ++n) step(body, loads, state, workspace);
            EXPECT_EQ(allocations(), before) << to_string(integrator);
        }
    const long before = allocations();
    { const std::vector<double> v(10); }
    EXPECT_GT(allocations(), before) << "the counter counts";
}

TEST(Step, ReportsWhatItDid) {
    const Body body = make_body("sphere:vertices=200");
    Workspace explicit_one(body, with(Integrator::symplectic)),
        implicit_one(body, with(Integrator::implicit));
    State state = rest_state(body);
    StepReport report = step(body, gravity_only(), state, explicit_one);
    EXPECT_EQ(report.substeps, explicit_one.substeps());
    EXPECT_LE(0.01 / report.substeps, step_safety * largest_stable_step(body));
    EXPECT_EQ(report.iterations, 0);
    report = step(body, gravity_only(), state, implicit_one);
    EXPECT_EQ(report.substeps, 0);
    EXPECT_GT(report.iterations, 0);
    EXPECT_EQ(implicit_one.substeps(), 1);
    EXPECT_DOUBLE_EQ(state.time, 0.02);
    EXPECT_EQ(state.steps, 2u);
}

TEST(Step, NothingHappensWithoutLoads) {
    for (bool free : {false, true})
        for (Integrator integrator : integrators) {
            BodyRecipe recipe;
            recipe.free = free;
            const Body body = make_body("organ:vertices=200", recipe);
            State state = rest_state(body);
            run(body, no_loads(), with(integrator), 10, state);
            EXPECT_LT(distance(state, rest_state(body)), 1e-12) << to_string(integrator);
        }
}

TEST(Step, HashSeesEveryBit) {
    const Body body = make_body("icosphere:vertices=42");
    const State rest = rest_state(body);
    EXPECT_EQ(state_hash(rest), state_hash(rest_state(body)));
    auto differs = [&](auto change) {
        State other = rest;
        change(other);
        EXPECT_NE(state_hash(other), state_hash(rest));
    };
    differs([](State& s) { s.time = 1e-300; });
    differs([](State& s) { ++s.steps; });
    differs([](State& s) { s.x[7].z() = std::nextafter(s.x[7].z(), 9); });
    differs([](State& s) { s.v[41].x() = -0.0; });
}

TEST(Step, IntegratorParsing) {
    for (Integrator i : {Integrator::automatic, Integrator::symplectic, Integrator::implicit})
        EXPECT_EQ(parse_integrator(to_string(i)), i);
    EXPECT_THROW(parse_integrator("euler"), InputError);
}

}  // namespace
}  // namespace innerspring
