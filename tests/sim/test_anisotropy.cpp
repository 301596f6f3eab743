#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "innerspring/sim/equilibrium.h"
#include "innerspring/sim/frame_motion.h"
#include "innerspring/sim/measure.h"
#include "innerspring/sim/refine.h"
#include "innerspring/sim/stability.h"
#include "innerspring/sim/step.h"
#include "innerspring/sim/vector_kernels.h"
#include "support/anisotropies.h"
#include "support/sanitized.h"

// Bodies whose inner springs are matrices.
namespace innerspring {
namespace {

using namespace support;

Body anisotropic(const Anisotropy& a, std::string_view shape, bool free = false, double poisson = 0,
                 double surface = 1, double damping = 1) {
    BodyRecipe recipe;
    recipe.anisotropy = a, recipe.free = free, recipe.poisson = poisson;
    recipe.surface = surface, recipe.damping = damping;
    return make_body(shape, recipe);
}

// Law 1 with a matrix: gravity moves the sphere as a whole by (M R^2 / 3V) D^-1 g, where fibres are straight,
// in equilibrium and by every way of stepping there.
TEST(Anisotropy, GravityTranslatesTheSphere) {
    const Vector g(3, -9.81, 2);
    for (const auto& [name, a] : anisotropies()) {
        if (name != "straight fibres" && name != "orthotropic") continue;
        for (double poisson : {0.0, 0.3}) {
            if (INNERSPRING_SANITIZED && poisson == 0) continue;
            BodyRecipe recipe;
            recipe.anisotropy = a, recipe.poisson = poisson;
            const Body body = make_sphere("sphere:vertices=600,irregularity=3,seed=1", recipe);
            const Vector u = body.material.mass / (3 * body.volume) * modulus_at(body, a, 0).llt().solve(g);
            const auto expect = [&, name = name](const State& state, double within, const char* how) {
                double worst = 0;
                for (std::size_t i = 0; i < body.vertices(); ++i)
                    worst = std::max(worst, (state.x[i] - body.rest.positions[i] - u).norm());
                EXPECT_LT(worst, within * u.norm()) << name << ' ' << how << ' ' << poisson;
                EXPECT_LT(std::abs(relative_volume_change(body, state)), within * u.norm())
                    << name << ' ' << how;
            };
            State still = rest_state(body);
            ASSERT_TRUE(solve_equilibrium(body, gravity_only(g), still).reached);
            expect(still, 1e-10, "equilibrium");
            for (Integrator integrator : {Integrator::symplectic, Integrator::implicit})
                for (Precision precision : {Precision::single, Precision::full}) {
                    if (integrator == Integrator::implicit && precision == Precision::single) continue;
                    StepOptions options;
                    options.integrator = integrator, options.precision = precision;
                    options.tolerance = 1e-9;
                    Workspace workspace(body, options);
                    State state = rest_state(body);
                    for (int n = 0; n < 400; ++n) step(body, gravity_only(g), state, workspace);
                    expect(state, precision == Precision::single ? 1e-5 : 1e-8, "steps");
                }
        }
    }
}

// Every force is minus the gradient of its energy (law 7), the frame of a free body moving along.
TEST(Anisotropy, ForcesAreGradients) {
    Team team(1);
    for (const auto& [name, a] : anisotropies())
        for (bool free : {false, true}) {
            const Body body = anisotropic(a, "breast:vertices=120", free);
            State state = random_state(body, 3, 0.1);
            const Eigen::Matrix3d turn =
                Eigen::AngleAxisd(1.1, Vector(1, 2, -1).normalized()).toRotationMatrix();
            if (free)
                for (Vector& x : state.x) x = turn * x + Vector(1, -2, 0.5);
            std::vector<Vector> f(body.vertices(), Vector::Zero());
            add_inner_forces(body, home_frame(body, state.x, team), state.x, f);
            double largest = 0;
            for (const Vector& v : f) largest = std::max(largest, v.norm());
            for (Index i : {Index(0), Index(17), Index(80)})
                for (int axis = 0; axis < 3; ++axis) {
                    const double h = 1e-5;
                    double energy[2];
                    for (int side = 0; side < 2; ++side) {
                        State moved = state;
                        moved.x[i][axis] += side == 0 ? -h : h;
                        energy[side] = inner_energy(body, home_frame(body, moved.x, team), moved.x);
                    }
                    ASSERT_NEAR((energy[0] - energy[1]) / (2 * h), f[i][axis], 1e-6 * largest)
                        << name << free;
                }
        }
}

// The springs of a free body exert neither force nor torque, however it is deformed; and they turn with it.
TEST(Anisotropy, FreeBodiesFeelNothingAsAWholeAndTurnTheirDirections) {
    Team team(1);
    for (const auto& [name, a] : anisotropies()) {
        const Body body = anisotropic(a, "organ:vertices=500", true);
        const State state = random_state(body, 5, 0.15);
        Random random(9);
        const Eigen::Matrix3d turn = random_rotation(random);
        std::vector<Vector> x = state.x;
        for (Vector& p : x) p = turn * p + Vector(3, 1, -2);
        std::vector<Vector> f(x.size(), Vector::Zero()), turned = f;
        add_inner_forces(body, home_frame(body, state.x, team), state.x, f);
        add_inner_forces(body, home_frame(body, x, team), x, turned);
        Vector force = Vector::Zero(), torque = Vector::Zero();
        double all = 0, apart = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            force += f[i], torque += state.x[i].cross(f[i]), all += f[i].norm();
            apart = std::max(apart, (turned[i] - turn * f[i]).norm());
        }
        EXPECT_LT(force.norm(), 1e-13 * all) << name;
        EXPECT_LT(torque.norm(), 1e-13 * all) << name;
        EXPECT_LT(apart, 1e-12 * all) << name;
        // The frame is where the energy is least.
        const HomeFrame frame = home_frame(body, state.x, team);
        const double least = inner_energy(body, frame, state.x);
        for (int n = 0; n < 20; ++n) {
            HomeFrame other = frame;
            other.R =
                Eigen::AngleAxisd(0.01, random_vector(random).normalized()).toRotationMatrix() * frame.R;
            other.t += 0.01 * random_vector(random);
            EXPECT_GT(inner_energy(body, other, state.x), least) << name;
        }
    }
}

// B S^-1 B^T is what the frame's motion takes from the Hessian: the change of the gradient is H p.
TEST(Anisotropy, TheHessianOfAFreeBodyFollowsItsFrame) {
    Team team(1);
    for (const auto& [name, a] : anisotropies()) {
        const Body body = anisotropic(a, "breast:vertices=150", true);
        const State state = random_state(body, 8, 0.1), direction = random_state(body, 11, 1);
        const std::vector<bool> none(body.vertices(), false);
        std::vector<Vector> p(body.vertices()), q(body.vertices());
        for (std::size_t i = 0; i < p.size(); ++i) {
            p[i] = direction.x[i] - body.rest.positions[i];
            q[i] = body.K[i] * p[i];
        }
        const HomeFrame frame = home_frame(body, state.x, team);
        multiply_deviation(body, frame, p, none, q, team);
        FrameMotion(body, frame, state.x).add_to(p, none, q);
        std::vector<Vector> plus(p.size(), Vector::Zero()), minus = plus;
        const double h = 1e-5;
        for (int side : {-1, 1}) {
            std::vector<Vector> x = state.x;
            for (std::size_t i = 0; i < x.size(); ++i) x[i] += side * h * p[i];
            add_inner_forces(body, home_frame(body, x, team), x, side < 0 ? minus : plus);
        }
        double worst = 0, size = 0;
        for (std::size_t i = 0; i < p.size(); ++i) {
            worst = std::max(worst, ((minus[i] - plus[i]) / (2 * h) - q[i]).norm());
            size = std::max(size, q[i].norm());
        }
        EXPECT_LT(worst, 1e-7 * size) << name;
    }
}

// Law 6.
TEST(Anisotropy, AFreeBodyKeepsItsMomenta) {
    for (const auto& [name, a] : anisotropies())
        for (double damping : {0.0, 1.0}) {
            const Body body = anisotropic(a, "breast:vertices=300", true, 0, 1, damping);
            State state = random_state(body, 4, 0.03, 0.1);
            for (std::size_t i = 0; i < body.vertices(); ++i)
                state.v[i] += Vector(0.5, 0, -0.2) + Vector(0, 0, 3).cross(state.x[i]);
            const Vector p = linear_momentum(body, state), l = angular_momentum(body, state);
            StepOptions options;
            options.integrator = Integrator::symplectic;
            Workspace workspace(body, options);
            const double energy = internal_energy(body, state);
            for (int n = 0; n < (INNERSPRING_SANITIZED ? 30 : 200); ++n) {
                ASSERT_EQ(step(body, no_loads(), state, workspace).not_finite, no_index);
                ASSERT_LT(internal_energy(body, state), 1.3 * energy) << name;
            }
            EXPECT_LT((linear_momentum(body, state) - p).norm(), 1e-11 * p.norm()) << name;
            EXPECT_LT((angular_momentum(body, state) - l).norm(), 1e-10 * l.norm()) << name;
            EXPECT_GT(state.x[0].norm(), 0.1);
        }
}

// Single precision against double, and every kernel and number of threads to the bit.
TEST(Anisotropy, KernelsAgree) {
    for (const auto& [name, a] : anisotropies())
        for (double poisson : {0.0, 0.4}) {
            const Body body = anisotropic(a, "breast:vertices=1000", false, poisson);
            Loads loads = gravity_only();
            loads.forces.push_back(patch_force(body, 5, 0.4, {0.02, -0.03, 0.01}));
            const int steps = INNERSPRING_SANITIZED ? 5 : 40;
            const auto run = [&](const VectorKernels* kernel, Precision precision, int threads) {
                StepOptions options;
                options.integrator = Integrator::symplectic;
                options.kernel = kernel, options.precision = precision, options.threads = threads;
                Workspace workspace(body, options);
                EXPECT_EQ(workspace.precision(), precision);
                State state = rest_state(body);
                for (int n = 0; n < steps; ++n) step(body, loads, state, workspace);
                return state;
            };
            const State fine = run(nullptr, Precision::full, 1), fast = run(nullptr, Precision::single, 1);
            // Single precision knows the volume to some 1e-7/sqrt(N).
            EXPECT_LT(distance(fine, fast), (poisson > 0 ? 1e-4 : 1e-5) * distance(fine, rest_state(body)))
                << name << ' ' << poisson;
            EXPECT_EQ(run(nullptr, Precision::full, 2).x, fine.x) << name;
            if (name != "orthotropic") continue;
            for (const VectorKernels* kernel : vector_kernels())
                EXPECT_EQ(run(kernel, Precision::single, 2).x, fast.x) << name << ' ' << kernel->name;
        }
}

// Implicit steps and equilibria balance the same forces as explicit ones come to rest with.
TEST(Anisotropy, EquilibriumIsWhereStepsComeToRest) {
    for (const auto& [name, a] : anisotropies())
        for (bool free : {false, true}) {
            const Body body = anisotropic(a, "breast:vertices=400", free, 0.3);
            Loads loads = gravity_only();
            loads.forces.push_back(patch_force(body, 11, 0.5, {0.01, -0.02, 0.01}));
            if (free) loads.pins.push_back({{0, 1, 2, 3, 4, 5, 40, 41, 42}, {}});
            State still = rest_state(body);
            const EquilibriumReport report = solve_equilibrium(body, loads, still);
            ASSERT_TRUE(report.reached) << name << free;
            EXPECT_LT(largest_imbalance(body, loads, still), 1.1 * report.tolerance_n) << name;
            for (Integrator integrator : {Integrator::symplectic, Integrator::implicit}) {
                StepOptions options;
                options.integrator = integrator, options.precision = Precision::full,
                options.tolerance = 1e-6;
                Workspace workspace(body, options);
                State state = still;  // and stays there
                for (int n = 0; n < (INNERSPRING_SANITIZED ? 5 : 20); ++n)
                    step(body, loads, state, workspace);
                EXPECT_LT(distance(state, still), 1e-6) << name << free << to_string(integrator);
            }
            if (free || INNERSPRING_SANITIZED) continue;  // swings for long; takes long
            State state = rest_state(body);
            StepOptions options;
            options.integrator = Integrator::implicit, options.dt = 0.05, options.tolerance = 1e-6;
            Workspace workspace(body, options);
            for (int n = 0; n < 200; ++n) ASSERT_EQ(step(body, loads, state, workspace).not_finite, no_index);
            EXPECT_LT(distance(state, still), 1e-4 * distance(still, rest_state(body))) << name;
        }
}

// A floor pressed against along an axis of orthotropy feels that axis's modulus and no other.
TEST(Anisotropy, AFloorFeelsTheModulusOfItsDirection) {
    std::vector<double> felt;
    for (const Vector& moduli : {Vector(10, 10, 10), Vector(10, 10, 30), Vector(30, 5, 10)}) {
        const Body body = anisotropic(orthotropic(moduli, Eigen::Matrix3d::Identity()),
                                      "icosphere:vertices=642", false, 0, 0);
        Loads loads = no_loads();
        loads.tools.push_back(plane_tool({0, 0, -0.95}, {0, 0, 1}, 0.3));
        StepOptions options;
        options.integrator = Integrator::symplectic;
        Workspace workspace(body, options);
        State state = rest_state(body);
        for (int n = 0; n < 300; ++n) step(body, loads, state, workspace);
        felt.push_back(workspace.contact().tools[0].force.z());
    }
    EXPECT_NEAR(felt[1] / felt[0], 3, 1e-4);
    EXPECT_NEAR(felt[2] / felt[0], 1, 1e-4);
}

// A refinement keeps momenta; and the layout that follows it steps to the same bits as one made anew.
TEST(Anisotropy, StepsFollowARefinement) {
    for (const auto& [name, a] : anisotropies())
        for (bool free : {false, true}) {
            Body body = anisotropic(a, "breast:vertices=800", free);
            State state = rest_state(body);
            StepOptions options;
            options.integrator = Integrator::symplectic;
            Workspace workspace(body, options);
            const Loads loads = gravity_only();
            for (int n = 0; n < 5; ++n) step(body, loads, state, workspace);
            const Vector p = linear_momentum(body, state), l = angular_momentum(body, state);
            Subdivision history(body.rest);
            const auto patch = triangles_near(body.rest, body.rest.positions[3], 0.3);
            workspace.adapt(body, refine(body, history, state, patch, 1, MeanStiffness::recomputed));
            EXPECT_LT((linear_momentum(body, state) - p).norm(), 1e-12 * p.norm()) << name;
            EXPECT_LT((angular_momentum(body, state) - l).norm(), 1e-12 * (l.norm() + p.norm())) << name;
            Workspace anew(body, options);
            EXPECT_EQ(workspace.substeps(), anew.substeps()) << name;
            State other = state;
            for (int n = 0; n < 5; ++n) step(body, loads, state, workspace), step(body, loads, other, anew);
            EXPECT_EQ(state.x, other.x) << name << free;
        }
}

// The bound of the stable step holds for the largest modulus: the body alone, undamped, does not gain energy.
TEST(Anisotropy, TheStableStepKnowsTheStiffestDirection) {
    const Anisotropy stiff = straight_fibres(2000, 5, Vector(1, 0, 0));
    const Body body = anisotropic(stiff, "sphere:vertices=300", false, 0, 1e-6, 0),
               plain = anisotropic({}, "sphere:vertices=300", false, 0, 1e-6, 0);
    // All but a single spring: omega^2 = K_i / m_i times the share of the stiffest direction.
    const double ratio = largest_stable_step(plain) / largest_stable_step(body);
    EXPECT_NEAR(ratio * ratio, 2000.0 / 10, 1e-3 * 200);
    StepOptions options;
    options.integrator = Integrator::symplectic;
    Workspace workspace(body, options);
    State state = random_state(body, 2, 1e-3, 0.01);
    const double energy = internal_energy(body, state);
    for (int n = 0; n < 500; ++n) {
        step(body, no_loads(), state, workspace);
        // At half the stable step the energy of a spring swings by up to (1 + 1/2) / (1 - 1/2).
        ASSERT_LT(internal_energy(body, state), 3 * energy);
    }
}

}  // namespace
}  // namespace innerspring
