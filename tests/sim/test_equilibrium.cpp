#include "innerspring/sim/equilibrium.h"

#include <gtest/gtest.h>

#include "innerspring/mesh/error.h"
#include "support/bodies.h"
#include "support/sanitized.h"

namespace innerspring {
namespace {

using namespace support;

/// Largest force left on any vertex that is not pinned [N], from the forces themselves.
double left_over(const Body& body, const Loads& loads, const State& state) {
    Team team(1);
    std::vector<Vector> f(body.vertices(), Vector::Zero());
    add_inner_forces(body, home_frame(body, state.x, team), state.x, f);
    add_surface_forces(body, state.x, f);
    add_gravity(body, loads.gravity, f);
    add_loads(loads, state.time, f);
    for (const Pin& pin : loads.pins)
        for (Index i : pin.vertices) f[i].setZero();
    double largest = 0;
    for (const Vector& v : f) largest = std::max(largest, v.norm());
    return largest;
}

Loads moderate(const Body& body) {
    Loads loads = gravity_only();
    loads.forces = {
        patch_force(body, coarsest_vertex(body), 0.5, -0.5 * body.rest.positions[coarsest_vertex(body)])};
    return loads;
}

TEST(Equilibrium, ConvergesInFewIterations) {
    for (const char* shape : {"icosphere:vertices=642", "sphere:vertices=600,irregularity=5,seed=2",
                              "organ:vertices=600", "torus:vertices=600"})
        for (double surface : {0.1, 1.0, 100.0}) {
            BodyRecipe recipe;
            recipe.surface = surface;
            const Body body = make_body(shape, recipe);
            const Loads loads = moderate(body);
            State state = rest_state(body);
            const EquilibriumReport report = solve_equilibrium(body, loads, state);
            EXPECT_TRUE(report.reached) << shape << " E_s " << surface << " residual " << report.residual_n;
            EXPECT_LE(report.iterations, surface > 10 ? 45 : 15) << shape << " E_s " << surface;
            EXPECT_LE(left_over(body, loads, state), report.tolerance_n * 1.01);
            EXPECT_LE(report.tolerance_n, 1e-9 * load_sum(body, loads, 0));
            for (const Vector& v : state.v) ASSERT_EQ(v, Vector::Zero());
        }
}

TEST(Equilibrium, ConvergesFasterAndFaster) {
    const Body body = make_body("sphere:vertices=400");
    const Loads loads = moderate(body);
    // The residual after n iterations, for each n.
    std::vector<double> residuals;
    for (int n = 1; n < 20; ++n) {
        State state = rest_state(body);
        EquilibriumOptions options;
        options.max_iterations = n;
        options.tolerance_n = 1e-13 * load_sum(body, loads, 0);
        const EquilibriumReport report = solve_equilibrium(body, loads, state, options);
        residuals.push_back(report.residual_n);
        EXPECT_EQ(report.reached, report.residual_n <= report.tolerance_n);
        if (report.reached) break;
    }
    ASSERT_GE(residuals.size(), 3u);
    const std::size_t n = residuals.size() - 1;
    // Down to rounding in a few iterations, each of which gains more than the one before.
    EXPECT_LT(residuals[n], residuals[n - 1] * 2e-2);
    EXPECT_LT(residuals[n] / residuals[n - 1], residuals[1] / residuals[0]);
    EXPECT_LE(residuals.size(), 9u);
}

TEST(Equilibrium, DoesNotDependOnWhereItStarts) {
    for (bool free : {false, true}) {
        BodyRecipe recipe;
        recipe.free = free;
        const Body body = make_body("sphere:vertices=300", recipe);
        Loads loads = moderate(body);
        if (free) loads.pins = {{ring(topology_of(body), 0, 3), {}}};
        State from_rest = rest_state(body), from_afar = random_state(body, 3, 0.03, 1);
        ASSERT_TRUE(solve_equilibrium(body, loads, from_rest).reached);
        ASSERT_TRUE(solve_equilibrium(body, loads, from_afar).reached);
        EXPECT_LT(distance(from_rest, from_afar), 1e-6);
        EXPECT_GT(distance(from_rest, rest_state(body)), 1e-3);
    }
}

TEST(Equilibrium, WithoutLoadsItIsTheRestShape) {
    const Body body = make_body("organ:vertices=300");
    State state = random_state(body, 4, 0.005);
    const EquilibriumReport report = solve_equilibrium(body, no_loads(), state);
    EXPECT_TRUE(report.reached) << report.residual_n << " of " << report.tolerance_n;
    EXPECT_LT(distance(state, rest_state(body)), 1e-8);
    State rest = rest_state(body);
    EXPECT_TRUE(solve_equilibrium(body, no_loads(), rest).reached);
}

TEST(Equilibrium, StiffSurfaceIsNoExcuse) {
    for (double surface : {1e4, 1e7}) {
        BodyRecipe recipe;
        recipe.surface = surface;
        const Body body = make_body("sphere:vertices=300", recipe);
        State state = rest_state(body);
        const EquilibriumReport report = solve_equilibrium(body, moderate(body), state);
        EXPECT_TRUE(report.reached) << surface << " residual " << report.residual_n << " of "
                                    << report.tolerance_n;
        EXPECT_LT(report.iterations, 30) << surface;
    }
}

TEST(Equilibrium, LargeLoadsConvergeOrSaySo) {
    int reached = 0, cases = 0;
    for (double surface : {0.1, 1.0, 10.0})
        for (double press :
             {1.0, 3.0, 10.0, 100.0}) {  // in units of E R^2 / 3: the deepest indent is far beyond R / 2
            BodyRecipe recipe;
            recipe.surface = surface;
            const Body body = make_sphere("sphere:vertices=400,irregularity=3", recipe);
            const Index vertex = densest_vertex(body);
            const Loads loads =
                one_force(patch_force(body, vertex, 0.5, -press * 10 / 3 * body.rest.positions[vertex]));
            State state = rest_state(body);
            const EquilibriumReport report = solve_equilibrium(body, loads, state);
            const double left = left_over(body, loads, state);
            ++cases, reached += report.reached;
            EXPECT_EQ(report.reached, left <= report.tolerance_n * 1.01)
                << "E_s " << surface << " press " << press << " left " << left;
            ASSERT_TRUE(std::isfinite(left));
        }
    EXPECT_EQ(reached, cases);
}

// Loads and stiffnesses at the ends of the numbers: balanced in finite numbers, or nothing is said to be.
TEST(Equilibrium, BeyondTheNumbersNothingIsReached) {
    const auto claim = [](const Body& body, const Loads& loads) {
        State state = rest_state(body);
        const bool reached = solve_equilibrium(body, loads, state).reached;
        for (const Vector& x : state.x) EXPECT_TRUE(x.allFinite());
        return reached;
    };
    const Body body = make_body("sphere:vertices=200");
    EXPECT_FALSE(claim(body, one_force(point_force(3, {1e160, 0, 0}))));
    Loads heavy = gravity_only();
    heavy.gravity = {0, 1e200, 0};
    EXPECT_FALSE(claim(body, heavy));
    BodyRecipe soft;
    soft.young = 1e-300;
    EXPECT_FALSE(claim(make_body("sphere:vertices=200", soft), gravity_only()));
    EXPECT_TRUE(claim(body, gravity_only()));
}

// Where no part of the net is compressed much, refining the mesh takes no more iterations.
TEST(Equilibrium, IterationsDoNotGrowWithTheMesh) {
    for (const double newton : {0.01, -1e-3}) {  // a pull, and a push too light to wrinkle any of the nets
        std::vector<int> iterations, products;
        for (int vertices : {642, 2562, INNERSPRING_SANITIZED ? 2562 : 10242}) {
            const Body body = make_sphere("icosphere:vertices=" + std::to_string(vertices));
            Loads loads = gravity_only();
            loads.forces = {patch_force(body, 0, 0.4, newton * body.rest.positions[0])};
            State state = rest_state(body);
            const EquilibriumReport report = solve_equilibrium(body, loads, state);
            ASSERT_TRUE(report.reached) << vertices;
            iterations.push_back(report.iterations), products.push_back(report.products);
        }
        EXPECT_LE(iterations[2], iterations[0] + 2) << newton;
        EXPECT_LE(products[2], products[0] * 3 / 2 + 5) << newton;
    }
}

TEST(Equilibrium, SameBitsForAnyNumberOfThreads) {
    const Body body = make_body("sphere:vertices=1100,irregularity=3");
    std::vector<std::uint64_t> hashes;
    for (int threads : {1, 2, 4}) {
        State state = rest_state(body);
        ASSERT_TRUE(solve_equilibrium(body, moderate(body), state, {.threads = threads}).reached);
        hashes.push_back(state_hash(state));
    }
    EXPECT_EQ(hashes[1], hashes[0]);
    EXPECT_EQ(hashes[2], hashes[0]);
}

TEST(Equilibrium, AFreeBodyNeedsAPin) {
    BodyRecipe recipe;
    recipe.free = true;
    const Body body = make_body("sphere:vertices=300", recipe);
    State state = rest_state(body);
    EXPECT_THROW(solve_equilibrium(body, gravity_only(), state), InputError);
}

TEST(Equilibrium, AFreeBodyHangsFromItsPins) {
    for (int rings : {1, 4}) {
        BodyRecipe recipe;
        recipe.free = true;
        recipe.surface = 5;
        const Body body = make_body("sphere:vertices=300", recipe);
        Loads loads = gravity_only();
        Index top = 0;
        for (Index i = 0; i < body.vertices(); ++i)
            if (body.rest.positions[i].x() > body.rest.positions[top].x())
                top = i;  // at the side: it must also turn
        loads.pins = {{ring(topology_of(body), top, rings), {}}};
        State state = rest_state(body);
        const EquilibriumReport report = solve_equilibrium(body, loads, state);
        EXPECT_TRUE(report.reached) << rings << " rings: residual " << report.residual_n << " after "
                                    << report.iterations;
        EXPECT_LE(report.iterations, 40) << rings << " rings";
        EXPECT_LE(left_over(body, loads, state), report.tolerance_n * 1.01);
        for (Index i : loads.pins[0].vertices) ASSERT_EQ(state.x[i], body.rest.positions[i]);
        EXPECT_LT(vertex_mean(state.x).y(), vertex_mean(body.rest.positions).y() - 1e-3);
    }
}

TEST(Equilibrium, PrescribedMotionSqueezesAHeldBody) {
    const Body body = make_body("sphere:vertices=300");
    Loads loads = no_loads();
    loads.pins = {{ring(topology_of(body), 5, 2), {{0, Vector::Zero()}, {1, -0.2 * body.rest.positions[5]}}}};
    State state = rest_state(body);
    state.time = 0.5;
    const EquilibriumReport report = solve_equilibrium(body, loads, state);
    EXPECT_TRUE(report.reached);
    EXPECT_LT((state.x[5] - 0.9 * body.rest.positions[5]).norm(), 1e-14);
    EXPECT_EQ(state.time, 0.5);
    EXPECT_LT(relative_volume_change(body, state), -1e-4);
}

}  // namespace
}  // namespace innerspring
