#include "innerspring/sim/forces.h"

#include <gtest/gtest.h>

#include <functional>

#include "innerspring/mesh/error.h"
#include "support/bodies.h"

namespace innerspring {
namespace {

using namespace support;

using Energy = std::function<double(const std::vector<Vector>&)>;

/// Compares f with -dE by central differences: along random motions of all vertices and of single ones.
void expect_minus_gradient(const Energy& energy, const std::vector<Vector>& x, const std::vector<Vector>& f,
                           double step) {
    Random random(21);
    double typical = 0;
    for (const Vector& v : f) typical += v.squaredNorm();
    typical = std::sqrt(typical / double(f.size()));
    ASSERT_GT(typical, 0);
    for (int n = 0; n < 40; ++n) {
        std::vector<Vector> d(x.size(), Vector::Zero());
        if (n % 4 == 0)
            for (Vector& v : d) v = random_vector(random);
        else
            d[random.bits() % d.size()] = random_vector(random);
        std::vector<Vector> ahead = x, behind = x;
        double slope = 0, length2 = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            ahead[i] += step * d[i];
            behind[i] -= step * d[i];
            slope -= f[i].dot(d[i]);
            length2 += d[i].squaredNorm();
        }
        const double difference = (energy(ahead) - energy(behind)) / (2 * step);
        ASSERT_NEAR(difference, slope, 1e-6 * typical * std::sqrt(length2)) << "direction " << n;
    }
}

Body small_body(bool free, const char* shape = "sphere:vertices=120,irregularity=4") {
    BodyRecipe recipe;
    recipe.surface = 3;
    recipe.free = free;
    return make_body(shape, recipe);
}

TEST(Forces, InnerForceIsMinusItsGradient) {
    for (bool free : {false, true})
        for (const char* shape : {"sphere:vertices=120,irregularity=4", "organ:vertices=150"}) {
            const Body body = small_body(free, shape);
            Team team(1);
            for (double size : {1e-3, 0.1, 0.5}) {
                const State state = random_state(body, 1, size);
                std::vector<Vector> f(body.vertices(), Vector::Zero());
                add_inner_forces(body, home_frame(body, state.x, team), state.x, f);
                expect_minus_gradient(
                    [&](const auto& x) { return inner_energy(body, home_frame(body, x, team), x); }, state.x,
                    f, 1e-5);
            }
        }
}

TEST(Forces, SurfaceForceIsMinusItsGradient) {
    const Body body = small_body(false);
    for (double size : {1e-3, 0.02, 0.5}) {
        const State state = random_state(body, 2, size);
        std::vector<Vector> f(body.vertices(), Vector::Zero());
        add_surface_forces(body, state.x, f);
        expect_minus_gradient([&](const auto& x) { return surface_energy(body, x); }, state.x, f, 1e-6);
    }
}

TEST(Forces, GravityAndLoadsAreMinusTheirGradients) {
    const Body body = small_body(false);
    const State state = random_state(body, 3, 0.1);
    const Vector g(1, -9, 2);
    std::vector<Vector> f(body.vertices(), Vector::Zero());
    add_gravity(body, g, f);
    expect_minus_gradient([&](const auto& x) { return gravity_energy(body, g, x); }, state.x, f, 1e-3);

    Loads loads = one_force(patch_force(body, 7, 0.8, {1, 2, 3}));
    loads.forces.push_back(point_force(9, {0, -5, 0}));
    loads.forces.back().profile.points = {{0, 0}, {1, 2}};
    f.assign(body.vertices(), Vector::Zero());
    add_loads(loads, 0.25, f);
    expect_minus_gradient([&](const auto& x) { return load_energy(body, loads, 0.25, x); }, state.x, f, 1e-3);
    Vector total = Vector::Zero();
    for (const Vector& v : f) total += v;
    EXPECT_LT((total - Vector(1, 2 - 2.5, 3)).norm(), 1e-13);
}

TEST(Forces, VanishAtRest) {
    for (bool free : {false, true}) {
        const Body body = small_body(free);
        const State state = rest_state(body);
        Team team(1);
        std::vector<Vector> f(body.vertices(), Vector::Zero());
        add_inner_forces(body, home_frame(body, state.x, team), state.x, f);
        add_surface_forces(body, state.x, f);
        for (const Vector& v : f) ASSERT_LT(v.norm(), 1e-14);
    }
}

TEST(Forces, InnerForcesOfAFreeBodyBalance) {
    for (const char* shape :
         {"sphere:vertices=700,irregularity=5", "organ:vertices=400", "torus:vertices=300"}) {
        const Body body = small_body(true, shape);
        Random random(8);
        Team team(1);
        for (double size : {1e-6, 0.1, 3.0}) {
            State state = random_state(body, 4, size);
            const Eigen::Matrix3d R = random_rotation(random);
            const Vector shift = 10 * random_vector(random);
            for (Vector& x : state.x) x = R * x + shift;
            std::vector<Vector> f(body.vertices(), Vector::Zero());
            add_inner_forces(body, home_frame(body, state.x, team), state.x, f);
            add_surface_forces(body, state.x, f);
            Vector force = Vector::Zero(), torque = Vector::Zero();
            double scale = 0;
            for (std::size_t i = 0; i < f.size(); ++i) {
                force += f[i];
                torque += (state.x[i] - shift).cross(f[i]);
                scale += f[i].norm();
            }
            // Home positions are rounded to 1e-16 of the distance from the origin: K eps |x| is what cannot
            // be avoided.
            const double rounding = 1e-14 * (scale + sum(body.K) * (shift.norm() + 1));
            EXPECT_LT(force.norm(), rounding) << shape << " " << size;
            EXPECT_LT(torque.norm(), 5 * rounding) << shape << " " << size;
        }
    }
}

TEST(Forces, HomeFrameFollowsRigidMotionAndIsNeverAReflection) {
    const Body body = small_body(true);
    Random random(5);
    Team team(1);
    for (int n = 0; n < 5; ++n) {
        const Eigen::Matrix3d R = random_rotation(random);
        const Vector shift = 100 * random_vector(random);
        std::vector<Vector> x;
        for (const Vector& q : body.rest.positions) x.push_back(R * q + shift);
        const HomeFrame frame = home_frame(body, x, team);
        EXPECT_LT((frame.R - R).norm(), 1e-12);
        EXPECT_LT((frame.t - shift).norm(), 1e-11);
        EXPECT_LT(inner_energy(body, frame, x), 1e-20);
    }
    std::vector<Vector> mirrored;
    for (const Vector& q : body.rest.positions) mirrored.push_back(-q);
    EXPECT_NEAR(home_frame(body, mirrored, team).R.determinant(), 1, 1e-12);
    // All vertices in one point: no rotation is better than another, but it must still be one.
    const std::vector<Vector> point(body.vertices(), Vector(1, 2, 3));
    const HomeFrame frame = home_frame(body, point, team);
    EXPECT_LT((frame.R * frame.R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR(frame.R.determinant(), 1, 1e-12);
}

TEST(Forces, HeldBodyHasTheIdentityFrame) {
    const Body body = small_body(false);
    Team team(1);
    const HomeFrame frame = home_frame(body, random_state(body, 9, 1).x, team);
    EXPECT_EQ(frame.R, Eigen::Matrix3d::Identity());
    EXPECT_EQ(frame.t, Vector::Zero());
}

TEST(Forces, HomeFrameIsTheSameForAnyNumberOfThreads) {
    const Body body = small_body(true, "sphere:vertices=3000");
    const State state = random_state(body, 6, 0.3);
    Team alone(1);
    const HomeFrame one = home_frame(body, state.x, alone);
    for (int threads : {2, 3, 4}) {
        Team team(threads);
        const HomeFrame many = home_frame(body, state.x, team);
        EXPECT_EQ(one.R, many.R);
        EXPECT_EQ(one.t, many.t);
    }
}

TEST(Forces, ASpringOfNoLengthPushesNowhere) {
    const Body body = small_body(false);
    State state = rest_state(body);
    const auto [a, b] = body.edges[0];
    state.x[a] = state.x[b];
    std::vector<Vector> f(body.vertices(), Vector::Zero());
    add_surface_forces(body, state.x, f);
    for (const Vector& v : f) ASSERT_TRUE(v.allFinite());
}

TEST(Loads, PatchWeightsSumToOneAndEndAtTheRadius) {
    const Body body = make_sphere(spheres[1]);
    const std::vector<double> A = vertex_areas(body.rest.positions, body.rest.triangles);
    for (double r : {0.01, 0.1, 0.3, 1.0, 5.0}) {
        const Force patch = patch_force(body, 11, r, {0, 0, 1});
        EXPECT_NEAR(sum(patch.weights), 1, 1e-14);
        std::vector<double> share(body.vertices(), 0.0);
        for (std::size_t n = 0; n < patch.vertices.size(); ++n) {
            const double d = (body.rest.positions[patch.vertices[n]] - body.rest.positions[11]).norm();
            ASSERT_LT(d, r);
            ASSERT_GT(patch.weights[n], 0);
            share[patch.vertices[n]] +=
                patch.weights[n] / A[patch.vertices[n]] / std::pow(1 - d * d / (r * r), 2);
        }
        // Every vertex within reach has its share, in proportion to (1 - (d/r)^2)^2 A_i.
        for (std::size_t i = 0; i < body.vertices(); ++i) {
            const double d = (body.rest.positions[i] - body.rest.positions[11]).norm();
            ASSERT_NEAR(share[i], d < r ? share[11] : 0, 1e-9 * share[11]) << r << " " << i;
        }
    }
    EXPECT_EQ(patch_force(body, 11, 1e-6, {0, 0, 1}).vertices, std::vector<Index>{11});
}

TEST(Loads, PatchDoesNotLeakThroughAThinWall) {
    const Body body = make_body(box({2, 2, 0.1}, 0.1));
    Index middle = 0;
    for (Index i = 0; i < body.vertices(); ++i)
        if ((body.rest.positions[i] - Vector(0, 0, 0.05)).norm() <
            (body.rest.positions[middle] - Vector(0, 0, 0.05)).norm())
            middle = i;
    const Force patch = patch_force(body, middle, 0.5, {0, 0, -1});
    EXPECT_GT(patch.vertices.size(), 50u);
    for (Index i : patch.vertices)
        ASSERT_GT(body.rest.positions[i].z(), 0)
            << "the far face is within 0.5 m but not connected within it";
}

TEST(Loads, PatchInputs) {
    const Body body = small_body(false);
    EXPECT_THROW(patch_force(body, Index(body.vertices()), 0.1, Vector::Zero()), InputError);
    EXPECT_THROW(patch_force(body, 0, 0, Vector::Zero()), InputError);
    EXPECT_THROW(patch_force(body, 0, NAN, Vector::Zero()), InputError);
}

TEST(Loads, Profiles) {
    EXPECT_EQ(at({}, 3), 1);
    const Profile ramp{{{1, 2}, {3, 6}, {4, 0}}};
    EXPECT_EQ(at(ramp, 0), 2);
    EXPECT_EQ(at(ramp, 1), 2);
    EXPECT_EQ(at(ramp, 2), 4);
    EXPECT_EQ(at(ramp, 3), 6);
    EXPECT_EQ(at(ramp, 3.5), 3);
    EXPECT_EQ(at(ramp, 9), 0);
    EXPECT_EQ(offset_at({{}, {}}, 5), Vector::Zero());
    const Pin pin{{0}, {{0, Vector(0, 0, 0)}, {2, Vector(0, 4, 0)}}};
    EXPECT_EQ(offset_at(pin, 0.5), Vector(0, 1, 0));
    EXPECT_EQ(offset_at(pin, 7), Vector(0, 4, 0));
}

TEST(Loads, InvalidOnesAreRefused) {
    const Body body = small_body(false);
    const Index n = Index(body.vertices());
    auto expect_refused = [&](const Loads& loads) { EXPECT_THROW(require_valid(body, loads), InputError); };
    Loads good = one_force(patch_force(body, 0, 0.5, {0, 0, 1}));
    good.pins = {{{1, 2}, {}}, {{3}, {{0, Vector::Zero()}, {1, Vector::Ones()}}}};
    EXPECT_NO_THROW(require_valid(body, good));
    expect_refused(gravity_only({0, NAN, 0}));
    expect_refused(one_force(point_force(n, {0, 0, 1})));
    expect_refused(one_force(point_force(0, {0, INFINITY, 1})));
    expect_refused(one_force({"empty", {}, {}, {0, 0, 1}, {}}));
    expect_refused(one_force({"ragged", {1, 2}, {1}, {0, 0, 1}, {}}));
    expect_refused(one_force({"weight", {1}, {NAN}, {0, 0, 1}, {}}));
    Loads bad = good;
    bad.forces[0].profile.points = {{1, 0}, {1, 1}};
    expect_refused(bad);
    bad.forces[0].profile.points = {{0, 0}, {1, NAN}};
    expect_refused(bad);
    bad = good;
    bad.pins[1].vertices = {2};
    expect_refused(bad);  // pinned twice
    bad.pins[1].vertices = {n};
    expect_refused(bad);
    bad = good;
    bad.pins[1].path = {{1, Vector::Zero()}, {0, Vector::Zero()}};
    expect_refused(bad);
    bad.pins[1].path = {{1, Vector(0, 0, NAN)}};
    expect_refused(bad);
}

}  // namespace
}  // namespace innerspring
