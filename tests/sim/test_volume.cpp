#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "innerspring/mesh/random.h"
#include "innerspring/sim/equilibrium.h"
#include "innerspring/sim/measure.h"
#include "innerspring/sim/volume.h"
#include "support/bodies.h"
#include "support/sanitized.h"

// The volume of the whole body as a property of its material: nu from 0 to 1/2.
namespace innerspring {
namespace {

using namespace support;

Body sphere(double poisson, std::string_view shape = "sphere:vertices=1000", bool free = false) {
    BodyRecipe recipe;
    recipe.poisson = poisson, recipe.free = free;
    return make_body(shape, recipe);
}

/// An inward push of `newton` spread over `radius` around the vertex farthest along +x, for ever.
Loads push(const Body& body, double newton, double radius = 0.4, const Vector& gravity = Vector::Zero()) {
    Index top = 0;
    for (Index i = 0; i < body.vertices(); ++i)
        if (body.rest.positions[i].x() > body.rest.positions[top].x()) top = i;
    Loads loads;
    loads.gravity = gravity;
    loads.forces.push_back(patch_force(body, top, radius, newton * -Vector::UnitX()));
    return loads;
}

const Loads nothing{Vector::Zero(), {}, {}, {}};

double change(const Body& body, const State& state) {
    return volume(state.x, body.rest.triangles) / body.volume - 1;
}

std::vector<Vector> shaken(const Body& body, double by, std::uint64_t seed) {
    return random_state(body, seed, by).x;
}

// a_i is the gradient of Eq. 4, its sum exerts neither force nor torque, and add_curvature() is its change.
TEST(Volume, TheGradientIsThatOfEq4) {
    const Body body = sphere(0.3, "breast:vertices=300");
    const VolumeTerm term(body);
    Team team(1);
    std::vector<Vector> x = shaken(body, 0.05, 1), a, b;
    const double V = term.find(x, a, team) + body.volume;
    EXPECT_NEAR(V, volume(x, body.rest.triangles), 1e-13 * V);
    Vector force = Vector::Zero(), torque = Vector::Zero();
    for (std::size_t i = 0; i < x.size(); ++i) force += a[i], torque += x[i].cross(a[i]);
    EXPECT_LT(force.norm(), 1e-13);
    EXPECT_LT(torque.norm(), 1e-13);
    const std::vector<Vector> p = shaken(body, 1, 2);
    std::vector<Vector> da(x.size(), Vector::Zero()), plus = x, minus = x;
    const double h = 1e-5;
    double slope = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
        plus[i] += h * p[i], minus[i] -= h * p[i], slope += a[i].dot(p[i]);
    EXPECT_NEAR((volume(plus, body.rest.triangles) - volume(minus, body.rest.triangles)) / (2 * h), slope,
                1e-8 * V);
    const std::vector<bool> none(x.size(), false);
    term.add_curvature(-1, x, p, none, da, team);
    term.find(plus, a, team);
    term.find(minus, b, team);
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LT(((a[i] - b[i]) / (2 * h) - da[i]).norm(), 1e-8) << i;
}

// Net pressure P_0 inside a sphere of springs: 3 V kappa-law. With nu the bulk modulus against a load normal
// to the sphere everywhere is (E + 3 kappa)/3 + 2 E_s / (3 (1 - 1/3) R): u = p R / (E + 3 kappa + 3 E_s / R).
TEST(Volume, AnEvenPressureIsAnsweredByTheBulkModulus) {
    for (double nu : {0.0, 0.3, 0.45, 0.49}) {
        Body body = sphere(nu, "icosphere:vertices=2562");
        const double p = 1e-3, E = body.material.young, R = 1;
        Loads loads;
        loads.gravity.setZero();
        for (Index i = 0; i < body.vertices(); ++i) {
            Force f;
            f.vertices = {i}, f.weights = {1};
            f.newton = p * body.rest.positions[i].normalized() * body.K[i] * R / E;  // p A_i
            loads.forces.push_back(f);
        }
        State state = rest_state(body);
        ASSERT_TRUE(solve_equilibrium(body, loads, state).reached);
        const double kappa = bulk_modulus(body.material);
        EXPECT_NEAR(change(body, state), 3 * p / (E + 3 * kappa + 3 * body.material.surface / R),
                    0.01 * 3 * p / E)
            << nu;
        EXPECT_NEAR(change(body, state) * (E + 3 * kappa + 3 * body.material.surface / R) / (3 * p), 1, 0.01)
            << nu;
    }
}

// Law 2 with nu: -3F / (4 pi R^2 (E + 3 kappa + 3 E_s/R)).
TEST(Volume, APushCostsWhatLaw2SaysWithTheBulkModulus) {
    for (double nu : {0.0, 0.3, 0.45}) {
        const Body body = sphere(nu);
        const double F = 0.005;
        State state = rest_state(body);
        const EquilibriumReport report = solve_equilibrium(body, push(body, F), state);
        ASSERT_TRUE(report.reached);
        const double stiff =
            body.material.young + 3 * bulk_modulus(body.material) + 3 * body.material.surface;
        EXPECT_NEAR(change(body, state), -3 * F / (4 * std::numbers::pi * stiff),
                    0.05 * 3 * F / (4 * std::numbers::pi * stiff));
        EXPECT_NEAR(report.pressure, -bulk_modulus(body.material) * change(body, state), 1e-9);
    }
}

// nu = 1/2: V = V_0 in equilibrium, whatever the shape and the push; the pressure is the multiplier.
TEST(Volume, AHardOneKeepsItsVolumeInEquilibrium) {
    for (const char* shape : {"sphere:vertices=1000", "breast:vertices=600", "organ:vertices=1500"})
        for (double F : {1e-4, 0.01, 0.1}) {
            const Body body = sphere(0.5, shape);
            State state = rest_state(body);
            const Loads loads = push(body, F, 0.4, {0, 0, -9.81});
            const EquilibriumReport report = solve_equilibrium(body, loads, state);
            EXPECT_TRUE(report.reached)
                << shape << ' ' << F << ' ' << report.residual_n << ' ' << report.tolerance_n;
            EXPECT_LT(std::abs(change(body, state)), 1e-8) << shape << ' ' << F;
            EXPECT_LE(largest_imbalance(body, loads, state), 2 * report.tolerance_n);
        }
}

struct Way {
    const char* name;
    Integrator integrator;
    Precision precision;
    bool free;
};
const Way ways[] = {{"single", Integrator::symplectic, Precision::single, false},
                    {"double", Integrator::symplectic, Precision::full, false},
                    {"implicit", Integrator::implicit, Precision::full, false},
                    {"free", Integrator::symplectic, Precision::full, true},
                    {"free, implicit", Integrator::implicit, Precision::full, true}};

StepOptions options_of(const Way& way, double dt = 0.01) {
    StepOptions options;
    options.dt = dt, options.integrator = way.integrator, options.precision = way.precision;
    return options;
}

// nu = 1/2: after every step of every integrator, pushed suddenly and hard.
TEST(Volume, AHardOneKeepsItsVolumeInEveryStep) {
    for (const Way& way : ways) {
        const bool single = way.precision == Precision::single;  // which averages its rounding over many
        const Body body = sphere(0.5, single ? "sphere:vertices=4200" : "sphere:vertices=1000", way.free);
        Loads loads = push(body, 0.05, 0.4, way.free ? Vector::Zero() : Vector(0, 0, -9.81));
        if (way.free) {  // from both sides
            Index far = 0;
            for (Index i = 0; i < body.vertices(); ++i)
                if (body.rest.positions[i].x() < body.rest.positions[far].x()) far = i;
            loads.forces.push_back(patch_force(body, far, 0.4, 0.05 * Vector::UnitX()));
        }
        Workspace workspace(body, options_of(way));
        EXPECT_EQ(workspace.precision(), way.precision);
        State state = rest_state(body);
        double worst = 0, fastest = 0;
        for (int n = 0; n < (INNERSPRING_SANITIZED ? 40 : single ? 80 : 150); ++n) {
            const StepReport report = step(body, loads, state, workspace);
            ASSERT_EQ(report.not_finite, no_index) << way.name;
            worst = std::max(worst, std::abs(change(body, state)));
            for (const Vector& v : state.v) fastest = std::max(fastest, v.norm());
        }
        EXPECT_LT(worst, 1e-8) << way.name;
        EXPECT_GT(fastest, 0.1) << way.name;
        for (std::size_t i = 0; i < body.vertices(); ++i) EXPECT_TRUE(state.x[i].allFinite());
    }
}

// Steps end where the equilibrium is, at its pressure.
TEST(Volume, StepsComeToRestInEquilibrium) {
    for (double nu : {0.4, 0.5})
        for (const Way& way : ways) {
            if (way.free || (INNERSPRING_SANITIZED && way.precision == Precision::full && nu < 0.5)) continue;
            const Body body = sphere(nu, "sphere:vertices=600");
            const Loads loads = push(body, 0.02);
            State rest = rest_state(body), state = rest;
            const EquilibriumReport balance = solve_equilibrium(body, loads, rest);
            ASSERT_TRUE(balance.reached);
            StepOptions options = options_of(way, 0.02);
            options.tolerance = 1e-6;
            Workspace workspace(body, options);
            StepReport report;
            for (int n = 0; n < 400; ++n) report = step(body, loads, state, workspace);
            double off = 0;
            for (std::size_t i = 0; i < body.vertices(); ++i)
                off = std::max(off, (state.x[i] - rest.x[i]).norm());
            EXPECT_LT(off, way.precision == Precision::single ? 2e-5 : 2e-6) << way.name << ' ' << nu;
            EXPECT_NEAR(report.pressure / balance.pressure, 1, 1e-3) << way.name << ' ' << nu;
        }
}

// A free body under pressure keeps both momenta as well as one without: the linear one to rounding, the
// angular one to what the integrator's own step leaves of it.
TEST(Volume, MomentaStay) {
    for (const Way& way : ways) {
        if (!way.free) continue;
        double without = 0;
        for (double nu : {0.0, 0.45, 0.5}) {
            const Body body = sphere(nu, "organ:vertices=400", true);
            State state = rest_state(body);
            Random random(7);
            for (std::size_t i = 0; i < body.vertices(); ++i)
                state.v[i] = Vector(0.3, -0.2, 0.1) + Vector(0.5, 1, -0.7).cross(state.x[i]) +
                             0.3 * random_vector(random);
            const auto momenta = [&] {
                Vector p = Vector::Zero(), l = Vector::Zero();
                for (std::size_t i = 0; i < body.vertices(); ++i)
                    p += body.m[i] * state.v[i], l += body.m[i] * state.x[i].cross(state.v[i]);
                return std::pair{p, l};
            };
            const auto [p0, l0] = momenta();
            Workspace workspace(body, options_of(way));
            for (int n = 0; n < 100; ++n)
                ASSERT_EQ(step(body, nothing, state, workspace).not_finite, no_index);
            const auto [p, l] = momenta();
            EXPECT_LT((p - p0).norm(), 1e-10 * p0.norm()) << way.name << ' ' << nu;
            const double turned = (l - l0).norm() / l0.norm();
            if (nu == 0) without = turned;
            EXPECT_LE(turned, 1.1 * without + 1e-11) << way.name << ' ' << nu;
        }
    }
}

// An unloaded body stays where it is, to the bit in single precision.
TEST(Volume, AnUnloadedBodyRests) {
    for (double nu : {0.3, 0.5})
        for (const Way& way : ways) {
            const Body body = sphere(
                nu, way.precision == Precision::single ? "breast:vertices=4200" : "breast:vertices=700",
                way.free);
            Workspace workspace(body, options_of(way));
            State state = rest_state(body);
            for (int n = 0; n < 20; ++n) step(body, nothing, state, workspace);
            double off = 0;
            for (std::size_t i = 0; i < body.vertices(); ++i)
                off = std::max(off, (state.x[i] - body.rest.positions[i]).norm());
            if (way.precision == Precision::single)
                EXPECT_EQ(off, 0) << nu;
            else
                EXPECT_LT(off, 1e-13) << way.name << ' ' << nu;
        }
}

TEST(Volume, SameBitsForAnyNumberOfThreadsAndKernel) {
    for (double nu : {0.3, 0.5}) {
        const Body body = sphere(nu, "sphere:vertices=4200");
        const Loads loads = push(body, 0.05);
        std::vector<std::uint64_t> hashes;
        for (int threads : {1, 2, 4})
            for (const VectorKernels* kernel : vector_kernels()) {
                StepOptions options;
                options.threads = threads, options.kernel = kernel,
                options.integrator = Integrator::symplectic;
                Workspace workspace(body, options);
                State state = rest_state(body);
                step(body, loads, state, workspace, 5);
                hashes.push_back(state_hash(state));
            }
        for (std::uint64_t hash : hashes) EXPECT_EQ(hash, hashes[0]) << nu;
    }
}

// A tool that presses in: V stays, and at rest it feels what the springs pull with, as the pressure adds up
// to nothing over the whole surface. It feels more than without.
TEST(Volume, AToolFeelsTheSpringsAndThePressure) {
    for (const Way& way : ways) {
        if (way.free || (INNERSPRING_SANITIZED && way.integrator == Integrator::implicit)) continue;
        std::vector<double> felt;
        for (double nu : {0.0, 0.4, 0.5}) {
            const Body body = sphere(nu, "icosphere:vertices=642");
            Tool ball = sphere_tool(2, {0, 0, 0});
            ball.path = {{0, {Vector(0.05, 0.02, 3.01), Eigen::Quaterniond::Identity()}},
                         {0.4, {Vector(0.05, 0.02, 2.85), Eigen::Quaterniond::Identity()}}};
            const Loads loads{Vector::Zero(), {}, {}, {ball}};
            StepOptions options = options_of(way, 0.005);
            options.tolerance = 1e-6;
            Workspace workspace(body, options);
            State state = rest_state(body);
            double worst = 0;
            for (int n = 0; n < 500; ++n) {
                ASSERT_EQ(step(body, loads, state, workspace).not_finite, no_index);
                worst = std::max(worst, std::abs(change(body, state)));
            }
            EXPECT_LT(worst, nu == 0.5 ? 1e-8 : 1) << way.name;
            std::vector<Vector> f(body.vertices(), Vector::Zero());
            add_inner_forces(body, {}, state.x, f);
            Vector springs = Vector::Zero();
            for (const Vector& each : f) springs += each;
            const Vector F = workspace.contact().tools[0].force;
            EXPECT_LT((F - springs).norm(), (way.precision == Precision::full ? 1e-5 : 2e-4) * F.norm())
                << way.name << ' ' << nu;
            felt.push_back(F.z());
        }
        EXPECT_GT(felt[1], 1.02 * felt[0]);
        EXPECT_GT(felt[2], 1.005 * felt[1]);
    }
}

// Refined in the middle of a press: V stays, and the pressure hardly changes.
TEST(Volume, RefinementKeepsVolumeAndPressure) {
    for (const Way& way : ways) {
        if (way.free) continue;
        Body body = sphere(0.5, "sphere:vertices=800");
        Loads loads = push(body, 0.01);
        Workspace workspace(body, options_of(way));
        State state = rest_state(body);
        StepReport before, after;
        for (int n = 0; n < 100; ++n) before = step(body, loads, state, workspace);
        Subdivision history(body.rest);
        const Transfer transfer = refine(body, history, state, triangles_near(body.rest, {1, 0, 0}, 0.3));
        carry_over(loads, body, transfer);
        workspace.adapt(body, transfer);
        EXPECT_GT(body.vertices(), 820u);
        for (int n = 0; n < 100; ++n) {
            after = step(body, loads, state, workspace);
            ASSERT_EQ(after.not_finite, no_index) << way.name;
            EXPECT_LT(std::abs(change(body, state)), 1e-8) << way.name << ' ' << n;
        }
        EXPECT_NEAR(after.pressure / before.pressure, 1, 0.03) << way.name;
    }
}

// Left alone on a floor for a minute, a free body neither shakes nor creeps nor rolls, and weighs what it
// does.
TEST(Volume, ABodyOnAFloorRestsForAMinute) {
    for (double nu : {0.0, 0.45, 0.5}) {
        if (INNERSPRING_SANITIZED && nu < 0.5) continue;
        BodyRecipe recipe;
        recipe.free = true, recipe.poisson = nu, recipe.young = 100, recipe.surface = 10;
        const Body body = make_body("icosphere:vertices=162", recipe);
        const Loads loads{{0, -9.81, 0}, {}, {}, {plane_tool({0, -1, 0}, {0, 1, 0}, 0.5)}};
        StepOptions options;
        options.dt = 0.01, options.integrator = Integrator::symplectic;
        Workspace workspace(body, options);
        Team team(1);
        State state = rest_state(body);
        for (int n = 0; n < 2000; ++n) ASSERT_EQ(step(body, loads, state, workspace).not_finite, no_index);
        const State settled = state;
        const HomeFrame home = home_frame(body, state.x, team);
        const Vector weight = body.material.mass * loads.gravity;
        double fastest = 0, drift = 0, roll = 0, off = 0;
        for (int n = 0; n < (INNERSPRING_SANITIZED ? 300 : 6000); ++n) {
            step(body, loads, state, workspace);
            for (std::size_t i = 0; i < body.vertices(); ++i)
                fastest = std::max(fastest, state.v[i].norm()),
                drift = std::max(drift, (state.x[i] - settled.x[i]).norm());
            roll = std::max(roll, (home_frame(body, state.x, team).R - home.R).norm());
            off = std::max(off, (workspace.contact().tools[0].force - weight).norm());
        }
        EXPECT_LT(fastest, 1e-9) << nu;
        EXPECT_LT(drift, 1e-9) << nu;
        EXPECT_LT(roll, 1e-9) << nu;
        EXPECT_LT(off, 1e-9 * weight.norm()) << nu;
    }
}

}  // namespace
}  // namespace innerspring
