#include "innerspring/body/estimate.h"

#include <gtest/gtest.h>

#include "support/bodies.h"

namespace innerspring {
namespace {

using namespace support;

TEST(Estimate, Quartiles) {
    const Quartiles odd = quartiles({5, 1, 3, 2, 4});
    EXPECT_EQ(odd.min, 1);
    EXPECT_EQ(odd.lower, 2);
    EXPECT_EQ(odd.median, 3);
    EXPECT_EQ(odd.upper, 4);
    EXPECT_EQ(odd.max, 5);
    const Quartiles even = quartiles({1, 2, 3, 4});
    EXPECT_DOUBLE_EQ(even.lower, 1.75);
    EXPECT_DOUBLE_EQ(even.median, 2.5);
    const Quartiles one = quartiles({7});
    EXPECT_EQ(one.min, 7);
    EXPECT_EQ(one.max, 7);
    EXPECT_EQ(quartiles({}).max, 0);
}

TEST(Estimate, ThePapersSphereSinksByFourMillimetres) {
    const Body body = make_sphere("icosphere:vertices=2562");
    const Estimate e = estimate(body);
    EXPECT_NEAR(e.sag, 3.9e-3, 0.02e-3);
    EXPECT_NEAR(e.mass_sum, 0.05, 1e-14);
    EXPECT_NEAR(e.stiffness_sum, 4 * pi * 10, 0.01 * e.stiffness_sum);
    EXPECT_NEAR(e.stiffness_sum, e.stiffness_theory, 0.005 * e.stiffness_theory);
    EXPECT_LT(e.mass_shift.norm(), 1e-9) << "an icosphere is symmetric";
}

// Sum of E A_i / L_i: about the centroid springs lean and are weaker than columns; about local centres they
// are stronger by the factor that makes the virtual volumes add up.
TEST(Estimate, StiffnessAgainstThatOfColumns) {
    const Body body = make_body("torus:vertices=1500");
    const std::vector<double> A = vertex_areas(body.rest.positions, body.rest.triangles);
    double unscaled = 0;
    for (std::size_t i = 0; i < A.size(); ++i) unscaled += A[i] * body.L[i] / 3;
    const Estimate torus = estimate(body);
    EXPECT_NEAR(torus.stiffness_sum, body.volume / unscaled * torus.stiffness_theory,
                0.03 * torus.stiffness_sum);
    const Estimate ellipsoid = estimate(make_body("ellipsoid:vertices=1500"));
    EXPECT_LT(ellipsoid.stiffness_sum, ellipsoid.stiffness_theory);
}

TEST(Estimate, MassShiftIsThatOfTheMasses) {
    // About the centre of a sphere Eq. 2 shares a triangle's mass equally, so the masses balance where the
    // surface does.
    const Body body = make_sphere(spheres[2]);
    Vector moment = Vector::Zero();
    for (std::size_t i = 0; i < body.vertices(); ++i) moment += body.m[i] / 0.05 * body.rest.positions[i];
    const Vector centroid = volume_centroid(body.rest.positions, body.rest.triangles);
    EXPECT_LT((estimate(body).mass_shift - (moment - centroid)).norm(), 1e-12);
    // It falls with the square of the mesh size on a symmetric shape and is small against the body.
    EXPECT_LT(estimate(make_body("ellipsoid:vertices=2000")).mass_shift.norm(), 0.02);
}

TEST(Estimate, Groups) {
    const Body body = make_sphere("icosphere:vertices=10242");
    const Groups g = dimensionless_groups(body, 9.81, 1e-3);
    EXPECT_NEAR(g.weight, 0.04905, 1e-4);
    EXPECT_NEAR(g.surface, 0.1, 1e-3);
    EXPECT_NEAR(g.force, 1e-4, 1e-6);
}

}  // namespace
}  // namespace innerspring
