#include <gtest/gtest.h>

#include "innerspring/sim/stability.h"
#include "support/bodies.h"

// Law 6 of docs/physics.md: a free body keeps both momenta, and its energy does not drift.
namespace innerspring {
namespace {

using namespace support;

Body free_body(double damping, const char* shape = "sphere:vertices=200,irregularity=3") {
    BodyRecipe recipe;
    recipe.free = true;
    recipe.damping = damping;
    return make_body(shape, recipe);
}

/// One symplectic sub-step per step.
StepOptions fine(const Body& body, double share = 0.25) {
    StepOptions options;
    options.integrator = Integrator::symplectic;
    options.dt = share * largest_stable_step(body);
    return options;
}

/// Sum of m |v| [N s], the scale of a momentum.
double momentum_scale(const Body& body, const State& state) {
    double scale = 0;
    for (std::size_t i = 0; i < body.vertices(); ++i) scale += body.m[i] * state.v[i].norm();
    return scale;
}

TEST(Momentum, IsConservedToRoundOffWithoutDampingAndWithIt) {
    for (double damping : {0.0, 1.0})
        for (const char* shape : {"sphere:vertices=200,irregularity=3", "organ:vertices=200"}) {
            const Body body = free_body(damping, shape);
            Workspace workspace(body, fine(body));
            State state = random_state(body, 1, 0.02, 0.5);
            const Vector p = linear_momentum(body, state), l = angular_momentum(body, state);
            const double scale = momentum_scale(body, state);
            for (int n = 0; n < 2000; ++n) {
                ASSERT_EQ(step(body, no_loads(), state, workspace).not_finite, no_index);
                // Each force carries the rounding of its home, K eps |x|: an impulse that may always point
                // the same way.
                const double rounding = 1e-13 * scale + 2e-15 * sum(body.K) * state.time;
                ASSERT_LT((linear_momentum(body, state) - p).norm(), rounding) << shape << " step " << n;
                ASSERT_LT((angular_momentum(body, state) - l).norm(), 4 * rounding) << shape << " step " << n;
            }
        }
}

TEST(Momentum, EnergyDoesNotDriftWithoutDamping) {
    const Body body = free_body(0);
    Workspace workspace(body, fine(body));
    State state = random_state(body, 2, 0.01, 0.1);
    constexpr int steps = 4000;
    double first = 0, last = 0, least = INFINITY, most = 0;
    for (int n = 0; n < steps; ++n) {
        step(body, no_loads(), state, workspace);
        const double energy = internal_energy(body, state);
        least = std::min(least, energy);
        most = std::max(most, energy);
        if (n < steps / 4) first += energy;
        if (n >= 3 * steps / 4) last += energy;
    }
    EXPECT_NEAR(last / first, 1, 0.01);
    EXPECT_LT(most / least, 1.5);
}

TEST(Momentum, DampingTakesEnergyFromDeformationOnly) {
    const Body body = free_body(1);
    Workspace workspace(body, fine(body));
    State state = random_state(body, 3, 0.02, 0.3);
    double before = internal_energy(body, state);
    const double start = before;
    for (int n = 0; n < 20; ++n) {
        for (int k = 0; k < 10; ++k) step(body, no_loads(), state, workspace);
        const double now = internal_energy(body, state);
        ASSERT_LT(now, before * (1 + 1e-9)) << n;
        before = now;
    }
    EXPECT_LT(before, 0.5 * start);
}

TEST(Momentum, RigidRotationIsNotDamped) {
    for (Integrator integrator : {Integrator::symplectic, Integrator::implicit}) {
        const Body body = free_body(1);
        StepOptions options = fine(body, 0.5);
        options.integrator = integrator;
        Workspace workspace(body, options);
        State state = rest_state(body);
        const Vector omega(0.3, 0.5, -0.2), drift(0.1, 0, 0.2);  // slow against the body's own 50 rad/s
        for (std::size_t i = 0; i < body.vertices(); ++i) state.v[i] = drift + omega.cross(state.x[i]);
        const double kinetic = measure(body, no_loads(), state).kinetic;
        const Vector l = angular_momentum(body, state);
        constexpr int steps = 800;
        for (int n = 0; n < steps; ++n) step(body, no_loads(), state, workspace);
        EXPECT_GT(omega.norm() * state.time, 1) << "it is to turn by a good angle";
        // Implicit Euler itself slows a rotation by (omega h)^2 a step; symplectic Euler does not.
        const double turn = omega.norm() * options.dt;
        const double own = integrator == Integrator::implicit ? steps * turn * turn : 0;
        EXPECT_NEAR(measure(body, no_loads(), state).kinetic, kinetic, (0.002 + 2.2 * own) * kinetic)
            << to_string(integrator);
        EXPECT_LT((angular_momentum(body, state) - l).norm(), (1e-9 + 1.1 * own) * l.norm())
            << to_string(integrator);
    }
}

TEST(Momentum, ImplicitEulerKeepsTheLinearMomentum) {
    for (double damping : {0.0, 1.0}) {
        const Body body = free_body(damping);
        StepOptions options;
        options.integrator = Integrator::implicit;
        options.tolerance = 1e-12;
        Workspace workspace(body, options);
        State state = random_state(body, 4, 0.02, 0.5);
        const Vector p = linear_momentum(body, state);
        const double scale = momentum_scale(body, state);
        for (int n = 0; n < 15; ++n) {
            step(body, no_loads(), state, workspace);
            ASSERT_LT((linear_momentum(body, state) - p).norm(), 1e-8 * scale)
                << "damping " << damping << " step " << n;
        }
    }
}

TEST(Momentum, FreeFallIsTheDiscreteParabola) {
    const Vector g(1, -9.81, 0.5);
    for (double damping : {0.0, 1.0})
        for (Integrator integrator : {Integrator::symplectic, Integrator::implicit}) {
            const Body body = free_body(damping);
            StepOptions options;
            options.integrator = integrator;
            Workspace workspace(body, options);
            const double h = options.dt / workspace.substeps();
            State state = rest_state(body);
            for (int n = 1; n <= 100; ++n) {
                step(body, gravity_only(g), state, workspace);
                // v_k = k h g, x_k = x_0 + h^2 g k (k + 1) / 2
                const double k = double(n) * workspace.substeps();
                const Vector fallen = h * h * k * (k + 1) / 2 * g;
                for (std::size_t i = 0; i < body.vertices(); ++i) {
                    ASSERT_LT((state.v[i] - k * h * g).norm(), 1e-9 * (k * h * g.norm() + 1))
                        << to_string(integrator) << " damping " << damping << " step " << n;
                    ASSERT_LT((state.x[i] - body.rest.positions[i] - fallen).norm(),
                              1e-9 * (fallen.norm() + 1));
                }
            }
        }
}

}  // namespace
}  // namespace innerspring
