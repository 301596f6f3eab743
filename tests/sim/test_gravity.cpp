#include <gtest/gtest.h>

#include "innerspring/body/estimate.h"
#include "innerspring/sim/equilibrium.h"
#include "support/bodies.h"

// Laws 1 and 3 of docs/physics.md: what gravity does to a held body.
namespace innerspring {
namespace {

using namespace support;

State sunk(const Body& body, const Vector& g = {0, -9.81, 0}) {
    State state = rest_state(body);
    const EquilibriumReport report = solve_equilibrium(body, gravity_only(g), state);
    EXPECT_TRUE(report.reached) << body.rest.name << " residual " << report.residual_n << " of "
                                << report.tolerance_n;
    return state;
}

/// Largest difference of any vertex's displacement from `u` [m].
double distortion(const Body& body, const State& state, const Vector& u) {
    double largest = 0;
    for (std::size_t i = 0; i < body.vertices(); ++i)
        largest = std::max(largest, (state.x[i] - body.rest.positions[i] - u).norm());
    return largest;
}

TEST(Gravity, ASphereSinksAsAWhole) {
    for (const std::string& shape : spheres)
        for (Scheme scheme : {Scheme::A, Scheme::C}) {
            BodyRecipe recipe;
            recipe.scheme = scheme;
            const Body body = make_sphere(shape, recipe);
            const double sag = 0.05 * 9.81 / (3 * body.volume * 10);
            EXPECT_NEAR(sag, 3.9e-3, 0.06e-3) << shape;
            EXPECT_NEAR(sag, estimate(body).sag, 0.02 * sag);
            const State state = sunk(body);
            EXPECT_LT(distortion(body, state, {0, -sag, 0}), 1e-8 * sag) << shape;
            EXPECT_LT(std::abs(relative_volume_change(body, state)), 1e-10) << shape;
        }
}

TEST(Gravity, ASphereStaysWholeOnItsWayDown) {
    for (const std::string& shape : spheres)
        for (Integrator integrator : {Integrator::symplectic, Integrator::implicit}) {
            const Body body = make_sphere(shape);
            const double sag = 0.05 * 9.81 / (3 * body.volume * 10);
            StepOptions options;
            options.integrator = integrator;
            Workspace workspace(body, options);
            State state = rest_state(body);
            for (int n = 0; n < 60; ++n) {
                step(body, gravity_only(), state, workspace);
                const Vector u = state.x[0] - body.rest.positions[0];
                ASSERT_LT(distortion(body, state, u), 1e-7 * sag) << shape << " step " << n;
                ASSERT_LT(std::abs(relative_volume_change(body, state)), 1e-10) << shape << " step " << n;
            }
            EXPECT_LT(distortion(body, state, {0, -sag, 0}), 1e-5 * sag) << shape;
        }
}

TEST(Gravity, SchemeBDistortsASphere) {
    for (const std::string& shape : {spheres[1], spheres[2]}) {
        BodyRecipe recipe;
        recipe.scheme = Scheme::B;
        const Body body = make_sphere(shape, recipe);
        const double sag = 0.05 * 9.81 / (3 * body.volume * 10);
        for (const Vector& g : {Vector(0, -9.81, 0), Vector(0, 0, -9.81)}) {
            const State state = sunk(body, g);
            EXPECT_GT(distortion(body, state, sag * g.normalized()), 0.1 * sag) << shape;
        }
        // The density varies along z, so that it is along z that heavy and light vertices sink differently.
        EXPECT_GT(std::abs(relative_volume_change(body, sunk(body, {0, 0, -9.81}))), 1e-5) << shape;
    }
}

TEST(Gravity, AnOffCentreSphereChangesVolumeAtFirstOrder) {
    for (const std::string& shape : {std::string("icosphere:vertices=2562"), spheres[1]})
        for (const Vector& offset : {Vector(0, 0.02, 0), Vector(0, -0.04, 0), Vector(0.03, 0.03, 0)}) {
            BodyRecipe recipe;
            recipe.surface = 0.1;
            recipe.centre = {CentreKind::given, offset};
            const Body body = make_body(shape, recipe);
            const Vector centroid = volume_centroid(body.rest.positions, body.rest.triangles), down(0, -1, 0);
            const double law = 2 * 0.05 * 9.81 / (3 * body.volume * 10) * down.dot(centroid - offset);
            EXPECT_NEAR(relative_volume_change(body, sunk(body)), law, 0.1 * std::abs(law))
                << shape << " " << offset.transpose();
        }
}

TEST(Gravity, AboutTheCentroidVolumeChangesAtSecondOrderOnly) {
    for (const char* shape :
         {"ellipsoid:vertices=1000", "ellipsoid:vertices=1000,a=1,b=1.5,c=0.8", "capsule:vertices=1000"}) {
        BodyRecipe recipe;
        const Body body = make_body(shape, recipe);
        ASSERT_EQ(body.centre.kind, CentreKind::centroid);
        recipe.centre = {CentreKind::given, body.centre.position + Vector(0.03, 0.03, 0)};
        const Body shifted = make_body(shape, recipe);
        for (const Vector& g : {Vector(9.81, 0, 0), Vector(0, 9.81, 0)}) {
            // The part of the change that turns sign with gravity is the first order.
            auto odd = [&](const Body& b) {
                return (relative_volume_change(b, sunk(b, g)) - relative_volume_change(b, sunk(b, -g))) / 2;
            };
            EXPECT_LT(std::abs(odd(body)), 0.1 * std::abs(odd(shifted))) << shape;
        }
    }
}

}  // namespace
}  // namespace innerspring
