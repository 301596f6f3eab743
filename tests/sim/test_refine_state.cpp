#include <gtest/gtest.h>

#include "innerspring/mesh/error.h"
#include "innerspring/sim/refine.h"
#include "innerspring/sim/stability.h"
#include "support/body_checks.h"

namespace innerspring {
namespace {

using namespace support;

struct Moving {
    Body body;
    Subdivision history;
    State state;
    explicit Moving(Body b, std::uint64_t seed = 1)
        : body(std::move(b)), history(body.rest), state(random_state(body, seed, 0.02, 0.3)) {
        // A bulk motion as well, so that there is momentum to keep.
        for (std::size_t i = 0; i < state.v.size(); ++i)
            state.v[i] += Vector(0.5, -0.2, 0.1) + Vector(0.3, 0.4, -0.7).cross(state.x[i]);
    }
    double kinetic() const { return measure(body, no_loads(), state).kinetic; }
    double elastic() const { return measure(body, no_loads(), state).elastic; }
};

// Mass, volume and both momenta to 1e-12; the energies change by what is reported.
TEST(RefineState, ConservesMassVolumeAndMomenta) {
    for (Scheme scheme : {Scheme::A, Scheme::B, Scheme::C})
        for (bool free : {false, true})
            for (const char* shape : {"sphere:vertices=300,irregularity=3", "organ:vertices=300"}) {
                Moving m(make_body(shape, {.scheme = scheme, .free = free}));
                const Vector p = linear_momentum(m.body, m.state), l = angular_momentum(m.body, m.state);
                const double V = volume(m.state.x, m.body.rest.triangles), kinetic = m.kinetic(),
                             elastic = m.elastic();
                const std::vector<Vector> x = m.state.x;
                const Transfer change = refine(m.body, m.history, m.state,
                                               triangles_near(m.body.rest, m.body.rest.positions[5], 0.5), 2);
                expect_sound(m.body);
                ASSERT_EQ(m.state.x.size(), m.body.vertices());
                ASSERT_EQ(m.state.v.size(), m.body.vertices());
                EXPECT_LT((linear_momentum(m.body, m.state) - p).norm(), 1e-12 * p.norm());
                EXPECT_LT((angular_momentum(m.body, m.state) - l).norm(), 1e-12 * l.norm());
                EXPECT_NEAR(volume(m.state.x, m.body.rest.triangles), V, 1e-12 * V);
                EXPECT_NEAR(change.volume_change_m3, 0, 1e-12 * V);
                EXPECT_NEAR(m.kinetic() - kinetic, change.kinetic_change_j, 1e-11 * kinetic);
                // The frame of a free body is fitted anew; what that changes is of second order.
                EXPECT_NEAR(m.elastic() - elastic, change.elastic_change_j, (free ? 1e-2 : 1e-11) * elastic);
                for (std::size_t i = 0; i < x.size(); ++i) ASSERT_EQ(m.state.x[i], x[i]);
                for (const auto& [vertex, halves] : change.surface.created)
                    ASSERT_EQ(m.state.x[vertex], Vector(0.5 * (m.state.x[halves.a] + m.state.x[halves.b])));
            }
}

TEST(RefineState, CoarseningConservesMassAndMomentaAndReportsTheVolume) {
    for (Scheme scheme : {Scheme::A, Scheme::C}) {
        Moving m(make_body("sphere:vertices=300,irregularity=3", {.scheme = scheme}));
        refine(m.body, m.history, m.state, triangles_near(m.body.rest, m.body.rest.positions[5], 0.5), 2);
        Random random(4);
        for (Vector& x : m.state.x) x += 0.003 * random_vector(random);  // new vertices leave their planes
        const Vector p = linear_momentum(m.body, m.state), l = angular_momentum(m.body, m.state);
        const double V = volume(m.state.x, m.body.rest.triangles), kinetic = m.kinetic(),
                     elastic = m.elastic();
        const Vector keep_from = m.body.rest.positions[5];
        const Transfer change = coarsen(
            m.body, m.history, m.state,
            [&](const Vector& a, const Vector&, const Vector&) { return (a - keep_from).norm() < 0.2; });
        EXPECT_FALSE(change.surface.retired.empty());
        expect_sound(m.body);
        EXPECT_LT((linear_momentum(m.body, m.state) - p).norm(), 1e-12 * p.norm());
        EXPECT_LT((angular_momentum(m.body, m.state) - l).norm(), 1e-12 * l.norm());
        EXPECT_NEAR(volume(m.state.x, m.body.rest.triangles) - V, change.volume_change_m3, 1e-12 * V);
        EXPECT_NE(change.volume_change_m3, 0);
        EXPECT_NEAR(m.kinetic() - kinetic, change.kinetic_change_j, 1e-10 * kinetic);
        EXPECT_NEAR(m.elastic() - elastic, change.elastic_change_j, 1e-10 * elastic);
    }
}

// A free body at rest stays so: neither refining nor its undoing makes a force. One that flies goes on; that
// Eq. 2 moves the centre of mass a little, and both momenta are kept, turns it by as little.
TEST(RefineState, AFreeBodyFliesOn) {
    for (double speed : {0.0, 0.4}) {
        Body body = make_body("ellipsoid:vertices=300", {.damping = 0, .free = true});
        Subdivision history(body.rest);
        State state = rest_state(body);
        const Vector v = speed * Vector(0.8, 0.2, -0.5);
        for (Vector& u : state.v) u = v;
        Workspace workspace(body, {.dt = 0.01});
        const Vector start = state.x[0];
        for (int n = 0; n < 20; ++n) {
            if (n == 7)
                workspace.adapt(body, refine(body, history, state,
                                             triangles_near(body.rest, body.rest.positions[0], 0.4)));
            if (n == 14)
                workspace.adapt(body, coarsen(body, history, state, [](auto&&...) { return false; }));
            step(body, no_loads(), state, workspace);
        }
        EXPECT_LT((state.x[0] - start - 0.2 * v).norm(), 1e-13 + 1e-4 * 0.2 * speed);
        EXPECT_EQ(history.families(), 0u);
    }
}

// At rest under a pressure of patch kind, refining disturbs little, and the same balance is found.
TEST(RefineState, APatchLoadFindsTheSameBalanceOnTheRefinedBody) {
    Body body = make_sphere("icosphere:vertices=642");
    Subdivision history(body.rest);
    State state = rest_state(body);
    Loads loads = one_force(patch_force(body, 10, 0.5, -0.05 * body.rest.positions[10]));
    Workspace workspace(body, {.dt = 0.01});
    for (int n = 0; n < 60; ++n) step(body, loads, state, workspace);
    auto kernel_mean = [&] {
        double mean = 0;
        const Force& f = loads.forces[0];
        for (std::size_t n = 0; n < f.vertices.size(); ++n)
            mean += f.weights[n] * (state.x[f.vertices[n]] - body.rest.positions[f.vertices[n]]).norm();
        return mean;
    };
    const double coarse = kernel_mean();
    const Transfer change =
        refine(body, history, state, triangles_near(body.rest, body.rest.positions[10], 0.6));
    carry_over(loads, body, change);
    workspace.adapt(body, change);
    require_valid(body, loads);
    EXPECT_NEAR(sum(loads.forces[0].weights), 1, 1e-12);
    EXPECT_GT(loads.forces[0].vertices.size(), 20u);
    for (int n = 0; n < 60; ++n) step(body, loads, state, workspace);
    EXPECT_NEAR(kernel_mean(), coarse, 0.01 * coarse);
}

// The bound that is kept up to date locally is the one found anew, to the last bit.
TEST(RefineState, StabilityBoundIsKeptUpToDate) {
    for (const char* shape :
         {"sphere:vertices=800,irregularity=3", "icosphere:vertices=642", "organ:vertices=600"})
        for (Scheme scheme : {Scheme::B, Scheme::C}) {
            Body body = make_body(shape, {.scheme = scheme});
            Subdivision history(body.rest);
            StabilityBound bound = stability_bound(body);
            Random random(2);
            State state = rest_state(body);
            for (int n = 0; n < 9; ++n) {
                const Vector place = body.rest.positions[random.below(body.vertices())];
                const Transfer change =
                    n % 3 < 2
                        ? refine(body, history, state, triangles_near(body.rest, place, 0.15))
                        : coarsen(body, history, state, [&](const Vector& a, const Vector&, const Vector&) {
                              return (a - place).norm() < 0.5;
                          });
                update(bound, body, change.surface, change.body);
                const StabilityBound anew = stability_bound(body);
                ASSERT_EQ(bound.ratio, anew.ratio) << shape << n;
                ASSERT_EQ(bound.value, anew.value) << shape << n;
            }
        }
}

// A carried-over workspace steps to the same bits as a new one of the same sub-steps.
TEST(RefineState, SteppingGoesOnStably) {
    for (bool free : {false, true}) {
        Body body = make_body("breast:vertices=500", {.free = free});
        Subdivision history(body.rest);
        State state = rest_state(body);
        Loads loads = one_force(patch_force(body, 20, 0.4, {0, 0.1, -0.2}));
        if (free) loads.pins = {{{0, 1, 2}, {}}};
        Workspace workspace(body, {.dt = 0.01});
        workspace.reserve(500);
        double highest = 0;
        for (int n = 0; n < 120; ++n) {
            if (n % 20 == 5) {
                const Transfer change = refine(body, history, state, coarse_triangles(body, 20, 0.4, 0.05));
                carry_over(loads, body, change);
                workspace.adapt(body, change);
            }
            if (n % 20 == 15) {
                const Transfer change = coarsen(body, history, state, [](auto&&...) { return false; });
                carry_over(loads, body, change);
                workspace.adapt(body, change);
            }
            require_valid(body, loads);
            ASSERT_EQ(step(body, loads, state, workspace).not_finite, no_index);
            highest = std::max(highest, measure(body, loads, state).max_displacement);
        }
        EXPECT_LT(highest, 0.5);
        EXPECT_GT(highest, 1e-3);
    }
}

// What is refused leaves the body as it was.
TEST(RefineState, ARefusedRefinementIsTakenBack) {
    SurfaceMesh mesh = make_shape("icosphere:vertices=642");
    const Vector up = mesh.positions[100], side = up.cross(Vector(0.3, 0.5, 0.1)).normalized();
    mesh.positions[100] += 0.25 * side + 0.15 * up;
    Moving m(make_body(mesh, {.centre = origin()}));
    const Body before = m.body;
    const State state = m.state;
    EXPECT_THROW(refine(m.body, m.history, m.state, triangles_in_ring(mesh, topology_of(m.body), 100, 1)),
                 InputError);
    expect_sound(m.body);
    EXPECT_EQ(m.body.rest.positions, before.rest.positions);
    for (std::size_t i = 0; i < before.vertices(); ++i) {
        ASSERT_NEAR(m.body.m[i], before.m[i], 1e-14 * before.m[i]);
        ASSERT_NEAR(m.body.K[i], before.K[i], 1e-14 * before.K[i]);
    }
    EXPECT_EQ(m.state.x, state.x);
    EXPECT_LT(std::abs(m.kinetic() - measure(before, no_loads(), state).kinetic), 1e-12 * m.kinetic());
}

TEST(RefineState, LoadsAndPinsAreCarriedOver) {
    Body body = make_body("icosphere:vertices=162");
    Subdivision history(body.rest);
    State state = rest_state(body);
    Loads loads = no_loads();
    const auto around = ring(topology_of(body), 7, 1);
    loads.pins = {{around, {}}};
    const Transfer finer =
        refine(body, history, state, triangles_in_ring(body.rest, topology_of(body), 7, 0));
    carry_over(loads, body, finer);
    // Within the ring every edge's middle is new and pinned; so is each on the ring itself.
    EXPECT_EQ(loads.pins[0].vertices.size(), around.size() + 2 * (around.size() - 1));
    // A force on a new vertex goes back to the ends of its edge.
    const auto [vertex, halves] = finer.surface.created.front();
    loads.forces.push_back(point_force(vertex, {1, 2, 3}));
    const Transfer back = coarsen(body, history, state, [](auto&&...) { return false; });
    carry_over(loads, body, back);
    require_valid(body, loads);
    EXPECT_EQ(loads.pins[0].vertices, around);
    EXPECT_EQ(loads.forces[0].vertices, (std::vector<Index>{halves.a, halves.b}));
    EXPECT_EQ(loads.forces[0].weights, (std::vector<double>{0.5, 0.5}));
    EXPECT_EQ(body.vertices(), 162u);
}

}  // namespace
}  // namespace innerspring
