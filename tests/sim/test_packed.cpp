#include "innerspring/sim/packed.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "innerspring/sim/stability.h"
#include "sim/allocations.h"
#include "support/bodies.h"
#include "support/sanitized.h"

namespace innerspring {
namespace {

using namespace support;

#if INNERSPRING_SANITIZED
constexpr bool sanitized = true;
#else
constexpr bool sanitized = false;
#endif

std::vector<Body> some_bodies() {
    std::vector<Body> bodies;
    for (const char* shape : {"icosphere:vertices=642", "sphere:vertices=700,irregularity=5",
                              "organ:vertices=500", "torus:vertices=300", "capsule:vertices=333"})
        bodies.push_back(make_body(shape, {.damping = 0.05}));
    return bodies;
}

/// Gravity, a growing press and a pull on one vertex; two vertices held, two led away.
Loads pushed_about(const Body& body) {
    Loads loads = gravity_only({1, -9.81, 0.5});
    loads.forces = {patch_force(body, densest_vertex(body), 0.5 * body.radius, {0.02, 0.01, -0.04}),
                    point_force(3, {0.001, 0, 0})};
    loads.forces[0].profile.points = {{0, 0}, {0.05, 1}, {0.1, 0.5}};
    loads.pins = {{{10, 11}, {}}, {{20, 21}, {{0, Vector::Zero()}, {0.1, Vector(0, 0.02, 0)}}}};
    return loads;
}

StepOptions explicit_steps(const Body& body, Precision precision) {
    StepOptions options;
    options.dt = 0.99 * step_safety * largest_stable_step(body);
    options.integrator = Integrator::symplectic;
    options.precision = precision;
    return options;
}

/// Largest distance between two states over the largest displacement in the second.
double distance(const Body& body, const State& a, const State& b) {
    double most = 0, scale = 0;
    for (std::size_t i = 0; i < body.vertices(); ++i) {
        most = std::max(most, (a.x[i] - b.x[i]).norm());
        scale = std::max(scale, (b.x[i] - body.rest.positions[i]).norm());
    }
    return most / scale;
}

TEST(Packed, EveryKernelGivesTheSameBitsAndFollowsThePlainDoubleLoop) {
    const int steps = sanitized ? 200 : 1000;
    for (const Body& body : some_bodies()) {
        const Loads loads = pushed_about(body);
        State exact = random_state(body, 5, 1e-3, 0.01);
        const State start = exact;
        Workspace full(body, explicit_steps(body, Precision::full));
        ASSERT_EQ(full.precision(), Precision::full);
        for (int n = 0; n < steps; ++n) step(body, loads, exact, full);
        std::uint64_t bits = 0;
        for (const VectorKernels* kernel : vector_kernels()) {
            StepOptions options = explicit_steps(body, Precision::single);
            options.kernel = kernel;
            Workspace workspace(body, options);
            ASSERT_EQ(workspace.precision(), Precision::single);
            State state = start;
            ASSERT_EQ(step(body, loads, state, workspace, steps).not_finite, no_index);
            EXPECT_EQ(state.steps, exact.steps);
            EXPECT_NEAR(state.time, exact.time, 1e-12);
            // The bound we state for 1000 steps, three times what is seen here.
            EXPECT_LT(distance(body, state, exact), 3e-6) << body.rest.name << " " << kernel->name;
            EXPECT_GT(distance(body, state, exact), 0) << "it is not the double kernel that ran";
            if (!bits) bits = state_hash(state);
            EXPECT_EQ(state_hash(state), bits) << body.rest.name << " " << kernel->name;
        }
    }
    EXPECT_STREQ(vector_kernels().back()->name, "portable");
}

TEST(Packed, SlotsAreTheFanOfEachVertex) {
    for (const Body& body : some_bodies()) {
        const Packed p = pack(body);
        std::map<std::pair<Index, Index>, Index> third;  // of a triangle, after each of its sides
        for (const Triangle& t : body.rest.triangles)
            for (int k = 0; k < 3; ++k) third[{t[k], t[(k + 1) % 3]}] = t[(k + 2) % 3];
        std::size_t slots = 0;
        for (Index i = 0; i < body.vertices(); ++i) {
            const Index place = p.place_of[i];
            ASSERT_EQ(p.vertex_at[place], i);
            const SlotRange range = p.ranges[place / slice_width];
            const auto spokes = body.spokes_of(i);
            ASSERT_GE(range.count, spokes.size());
            std::vector<Index> fan;
            for (std::size_t n = 0; n < range.count; ++n) {
                const PackedSlot& slot = p.slots[range.first + n];
                const Index j = p.vertex_at[slot.offset[place % slice_width] / sizeof(PackedRow)];
                const double k = double(slot.k[place % slice_width]) * p.stiffness;
                if (n < spokes.size()) {
                    fan.push_back(j);
                    const auto spoke =
                        std::ranges::find_if(spokes, [j](const Spoke& s) { return s.neighbour == j; });
                    ASSERT_NE(spoke, spokes.end());
                    EXPECT_NEAR(k, spoke->k, 1e-7 * spoke->k);
                } else {
                    EXPECT_EQ(k, 0);
                    EXPECT_EQ(j, fan.front());
                }
            }
            for (std::size_t n = 0; n < fan.size(); ++n)
                ASSERT_EQ((third[{i, fan[n]}]), fan[(n + 1) % fan.size()]) << body.rest.name << " " << i;
            slots += spokes.size();
        }
        EXPECT_LT(double(p.slots.size() * slice_width), 1.25 * double(slots) + 200) << "too many empty slots";
    }
}

TEST(Packed, SameBitsForAnyNumberOfThreadsWithVolume) {
    const Body body = make_body("sphere:vertices=5000,irregularity=3");
    const Loads loads = pushed_about(body);
    std::uint64_t bits = 0;
    double volume_then = 0;
    for (int threads : {1, 2, 3}) {
        StepOptions options = explicit_steps(body, Precision::single);
        options.threads = threads, options.volume = true;
        Workspace workspace(body, options);
        State state = random_state(body, 1, 1e-3, 0.1);
        const double V = step(body, loads, state, workspace, 20).volume;
        if (!bits) bits = state_hash(state), volume_then = V;
        EXPECT_EQ(state_hash(state), bits) << threads;
        EXPECT_EQ(V, volume_then) << threads;
    }
}

TEST(Packed, VolumeIsThatOfEquation4) {
    for (const char* shape : {"icosphere:vertices=642", "organ:vertices=2000", "torus:vertices=1000"}) {
        SurfaceMesh mesh = make_shape(shape);
        for (Vector& x : mesh.positions) x += Vector(300, -200, 100);
        const Body body = make_body(std::move(mesh));
        for (Precision precision : {Precision::single, Precision::full}) {
            StepOptions options = explicit_steps(body, precision);
            options.volume = true;
            Workspace workspace(body, options);
            State state = random_state(body, 3, 0.01, 0.1);
            for (int n = 0; n < 5; ++n) {
                // Eq. 4 far from the origin loses digits of its own: about the body instead.
                std::vector<Vector> x = state.x;
                for (Vector& p : x) p -= Vector(300, -200, 100);
                const double V = volume(x, body.rest.triangles);
                EXPECT_NEAR(step(body, {}, state, workspace).volume, V, 1e-7 * V)
                    << shape << " " << to_string(precision);
            }
        }
    }
}

TEST(Packed, SizeAndPlaceChangeNothing) {
    // A body of another size and far away: the same motion in its own units.
    for (const double size : {1e-6, 1.0, 1e5}) {
        SurfaceMesh mesh = make_shape("organ:vertices=500");
        for (Vector& x : mesh.positions) x = size * (x + Vector(50, 20, -30));
        const Body body = make_body(std::move(mesh), {.young = 10 / size, .damping = 0.1});
        Loads loads = gravity_only(size * Vector(0, -9.81, 0));
        State single = rest_state(body), full = single;
        Workspace a(body, explicit_steps(body, Precision::single)),
            b(body, explicit_steps(body, Precision::full));
        ASSERT_EQ(a.precision(), Precision::single);
        step(body, loads, single, a, 300), step(body, loads, full, b, 300);
        EXPECT_LT(distance(body, single, full), 1e-5) << size;
    }
}

TEST(Packed, AnUnloadedBodyStaysAtRestToTheBit) {
    for (const Body& body : some_bodies()) {
        State state = rest_state(body);
        Workspace workspace(body, explicit_steps(body, Precision::single));
        step(body, gravity_only(Vector::Zero()), state, workspace, 100);
        EXPECT_EQ(state.x, body.rest.positions) << body.rest.name;
        for (const Vector& v : state.v) ASSERT_EQ(v.norm(), 0);
    }
}

TEST(Packed, SpringsExertNoNetForce) {
    // Without inner springs and damping that matter, the momentum of a held body is that of its surface net.
    const Body body = make_body("sphere:vertices=700,irregularity=5", {.young = 1e-12, .damping = 0});
    State state = random_state(body, 9, 0.01, 0);
    Vector p = Vector::Zero();
    double size = 0;
    Workspace workspace(body, explicit_steps(body, Precision::single));
    step(body, gravity_only(Vector::Zero()), state, workspace, 500);
    for (std::size_t i = 0; i < body.vertices(); ++i)
        p += body.m[i] * state.v[i], size += body.m[i] * state.v[i].norm();
    EXPECT_GT(size, 0);
    EXPECT_LT(p.norm(), 3e-6 * size);
}

TEST(Packed, EnergyOfAnUndampedBodyStays) {
    const Body body = make_body("sphere:vertices=500,irregularity=3", {.damping = 0});
    State state = random_state(body, 4, 1e-3, 0.01);
    const auto energy = [&] {
        const Measures now = measure(body, gravity_only(Vector::Zero()), state);
        return now.kinetic + now.elastic;
    };
    StepOptions options = explicit_steps(body, Precision::single);
    options.dt /= 5;
    Workspace workspace(body, options);
    const double before = energy();
    for (int n = 0; n < 10; ++n) {
        step(body, gravity_only(Vector::Zero()), state, workspace, sanitized ? 100 : 1000);
        EXPECT_NEAR(energy(), before, 0.02 * before) << n;
    }
}

TEST(Packed, FollowsRefinementAndItsUndoing) {
    Body body = make_body("sphere:vertices=400,irregularity=3");
    Subdivision history(body.rest);
    Packed p = pack(body);
    Random random(2);
    Team alone(1);
    std::size_t most = 0;
    for (int n = 0; n < (sanitized ? 8 : 30); ++n) {
        State state = random_state(body, std::uint64_t(n), 1e-3, 0.1);
        if (n % 3 != 2) {
            const Vector middle = body.rest.positions[random.below(body.vertices())];
            const Transfer t = refine(body, history, state, triangles_near(body.rest, middle, 0.2));
            adapt(p, body, t.surface, t.body);
        } else {
            const double level = random.uniform(-1, 1);
            const Transfer t =
                coarsen(body, history, state,
                        [&](const Vector& a, const Vector&, const Vector&) { return a.x() < level; });
            adapt(p, body, t.surface, t.body);
        }
        most = std::max(most, body.vertices());
        // Where a vertex lies changes nothing: as with a body packed anew.
        Packed anew = pack(body);
        State a = random_state(body, 7, 1e-3, 0.1), b = a;
        load(p, body, a, alone), load(anew, body, b, alone);
        const double h = 0.4 * largest_stable_step(body);
        for (int s = 0; s < 3; ++s) {
            VolumeFlow V[2];
            ASSERT_TRUE(advance(p, *vector_kernels().front(), h, {0, -9.81, 0}, alone, &V[0]));
            ASSERT_TRUE(advance(anew, *vector_kernels().back(), h, {0, -9.81, 0}, alone, &V[1]));
            EXPECT_NEAR(V[0].excess, V[1].excess, 1e-7 * V[1].excess);
        }
        store(p, body, a, alone), store(anew, body, b, alone);
        ASSERT_EQ(state_hash(a), state_hash(b)) << n;
    }
    EXPECT_GT(most, 450u);
}

TEST(Packed, StepsAtATimeAreTheStepsOneByOne) {
    const Body body = make_body("organ:vertices=500");
    const Loads loads = pushed_about(body);
    StepOptions options;
    options.integrator = Integrator::symplectic;
    Workspace workspace(body, options);
    State together = rest_state(body), alone = together;
    step(body, loads, together, workspace, 12);
    for (int n = 0; n < 12; ++n) step(body, loads, alone, workspace);
    EXPECT_EQ(together.steps, alone.steps);
    EXPECT_EQ(together.time, alone.time);
    EXPECT_LT(distance(body, together, alone), 1e-6);
}

TEST(Packed, AllocatesNothingInAStep) {
    const Body body = make_body("icosphere:vertices=2562");
    const Loads loads = pushed_about(body);
    for (int threads : {1, 2}) {
        StepOptions options = explicit_steps(body, Precision::single);
        options.threads = threads, options.volume = true;
        Workspace workspace(body, options);
        State state = rest_state(body);
        step(body, loads, state, workspace);
        const long before = allocations();
        step(body, loads, state, workspace, 50);
        EXPECT_EQ(allocations(), before) << threads;
    }
}

TEST(Packed, WhereSinglePrecisionWillNotDoDoubleIsUsed) {
    EXPECT_EQ(Workspace(make_body("icosphere:vertices=42", {.free = true}), {}).precision(), Precision::full);
    Body far_apart = make_body("icosphere:vertices=42");
    far_apart.m[3] = 1e-31;
    EXPECT_FALSE(packable(far_apart));
    EXPECT_TRUE(packable(make_body("icosphere:vertices=42", {.surface = 0})));
}

}  // namespace
}  // namespace innerspring
