#include "innerspring/body/distribution.h"

#include <gtest/gtest.h>

#include "support/bodies.h"

namespace innerspring {
namespace {

using namespace support;

/// W_i, the sum of the virtual tetrahedra at each vertex.
std::vector<double> sums_at_vertices(const SurfaceMesh& mesh, const Distribution& d) {
    std::vector<double> W(mesh.positions.size(), 0.0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (Index i : mesh.triangles[t]) W[i] += d.V_t[t];
    return W;
}

TEST(Distribution, EquationTwoOnOneTriangle) {
    // About its fourth vertex only one face of a tetrahedron has a virtual tetrahedron, so that m_i / M is
    // Eq. 2 itself.
    SurfaceMesh mesh;
    mesh.positions = {{1, 0, 0}, {0, 2, 0}, {0, 0, 3}, {0, 0, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
    const Distribution d = distribute_about(mesh, mesh.positions[3]);
    EXPECT_NEAR(d.m[0], 5.0 / 12, 1e-15);
    EXPECT_NEAR(d.m[1], 4.0 / 12, 1e-15);
    EXPECT_NEAR(d.m[2], 3.0 / 12, 1e-15);
    EXPECT_EQ(d.m[3], 0);
    EXPECT_NEAR(d.K[0], 1, 1e-15);  // V_t / L^2 with V_t = 1 and no 1/3
    EXPECT_NEAR(d.K[1], 1.0 / 4, 1e-15);
    EXPECT_NEAR(d.K[2], 1.0 / 9, 1e-15);
}

TEST(Distribution, SumsHoldAboutAnyCentre) {
    for (const char* shape : {"sphere:vertices=500", "organ:vertices=500", "torus:vertices=500"}) {
        const SurfaceMesh mesh = make_shape(shape);
        for (const Vector& c : {Vector(0, 0, 0), Vector(0.3, -0.2, 0.1), Vector(5, 4, -3)}) {
            const Distribution d = distribute_about(mesh, c);
            EXPECT_NEAR(sum(d.V_t), volume(mesh), 1e-12 * volume(mesh)) << shape;
            EXPECT_NEAR(sum(d.m), 1, 1e-12) << shape;
            EXPECT_NEAR(sum(sums_at_vertices(mesh, d)), 3 * volume(mesh), 1e-11 * volume(mesh)) << shape;
        }
    }
}

TEST(Distribution, NoThirdInTheInnerSprings) {
    for (const std::string& shape : spheres) {
        const double R = 1.7;
        const SurfaceMesh mesh = moved(make_shape(shape), Eigen::Matrix3d::Identity(), R, Vector::Zero());
        const Distribution d = distribute_about(mesh, Vector::Zero());
        const std::vector<double> W = sums_at_vertices(mesh, d);
        for (std::size_t i = 0; i < W.size(); ++i)
            ASSERT_NEAR(d.K[i], W[i] / (R * R), 1e-12 * d.K[i]) << shape << " vertex " << i;
        EXPECT_NEAR(sum(d.K), 3 * volume(mesh) / (R * R), 1e-12 * sum(d.K)) << shape;
        EXPECT_NEAR(sum(d.K), 4 * pi * R, 0.02 * sum(d.K))
            << shape;  // E 4 pi R^2 / R, less what the mesh cuts off
    }
}

TEST(Distribution, MassOverStiffnessIsTheSameAllOverASphere) {
    for (const std::string& shape : spheres) {
        const SurfaceMesh mesh = make_shape(shape);
        const Distribution d = distribute_about(mesh, Vector::Zero());
        const double law = 1 / (3 * volume(mesh));  // M R^2 / (3 V E)
        for (std::size_t i = 0; i < d.m.size(); ++i)
            ASSERT_NEAR(d.m[i] / d.K[i], law, 1e-12 * law) << shape << " vertex " << i;
    }
}

TEST(Distribution, LocalCentresArePositiveAndSumExactly) {
    for (std::string_view name : shape_names()) {
        const SurfaceMesh mesh = make_shape(std::string(name) + ":vertices=700");
        const Distribution d = distribute_locally(mesh);
        EXPECT_NEAR(sum(d.V_t), volume(mesh), 1e-12 * volume(mesh)) << name;
        EXPECT_NEAR(sum(d.m), 1, 1e-12) << name;
        for (std::size_t i = 0; i < d.m.size(); ++i) {
            ASSERT_GT(d.m[i], 0) << name << " vertex " << i;
            ASSERT_GT(d.K[i], 0) << name << " vertex " << i;
        }
        EXPECT_EQ(least_positive(mesh, d).count, 0u) << name;
    }
}

TEST(Distribution, LocalCentresGiveTheSphereBack) {
    for (const std::string& shape : spheres) {
        const SurfaceMesh mesh = make_shape(shape);
        const Distribution local = distribute_locally(mesh), exact = distribute_about(mesh, Vector::Zero());
        for (std::size_t i = 0; i < local.K.size(); ++i) {
            ASSERT_NEAR(local.L[i], 1, 0.01) << shape << " vertex " << i;
            ASSERT_NEAR(local.K[i], exact.K[i], 0.03 * exact.K[i]) << shape << " vertex " << i;
            ASSERT_NEAR(local.m[i], exact.m[i], 0.03 * exact.m[i]) << shape << " vertex " << i;
        }
    }
}

// K_i = s E A_i / L_i, L_i = d/2: the column times the factor that makes the virtual volumes add up, 3 in a
// wide slab.
TEST(Distribution, LocalCentresGiveASlabItsColumns) {
    const double d = 0.25;
    const SurfaceMesh mesh = box({2, 2, d}, 0.1);
    const Distribution local = distribute_locally(mesh);
    const std::vector<double> A = vertex_areas(mesh.positions, mesh.triangles);
    double unscaled = 0;
    for (std::size_t i = 0; i < A.size(); ++i) unscaled += A[i] * local.L[i] / 3;
    const double s = volume(mesh) / unscaled;
    EXPECT_GT(s, 2.4);
    EXPECT_LT(s, 3);
    int seen = 0;
    for (std::size_t i = 0; i < A.size(); ++i) {
        const Vector& q = mesh.positions[i];
        if (std::max(std::abs(q.x()), std::abs(q.y())) > 1 - 1.5 * d) continue;
        ++seen;
        ASSERT_NEAR(local.L[i], d / 2, 0.01 * d) << i;
        ASSERT_NEAR(local.K[i], s * 2 * A[i] / d, 0.02 * s * 2 * A[i] / d) << i;
    }
    EXPECT_GT(seen, 200);
    // About the centroid the columns of a slab lean over and are too weak: the reason for local centres.
    const Distribution about = distribute_about(mesh, Vector::Zero());
    EXPECT_LT(about.K[0] * d / (2 * A[0]), 0.2);
}

TEST(Distribution, LeastPositiveFindsTheWorstVertex) {
    const SurfaceMesh sphere = make_shape("icosphere:vertices=162");
    EXPECT_NEAR(least_positive(sphere, distribute_about(sphere, Vector::Zero())).value, 1, 0.05);
    const Distribution outside = distribute_about(sphere, {0, 0, 3});
    const LeastPositive worst = least_positive(sphere, outside);
    EXPECT_LT(worst.value, 0);
    std::size_t count = 0;
    for (std::size_t i = 0; i < outside.K.size(); ++i) count += outside.K[i] <= 0 || outside.m[i] <= 0;
    EXPECT_EQ(worst.count, count);
    EXPECT_GT(outside.L[worst.vertex], 0);
    // On a vertex exactly: 0/0 is not positive, and it is that vertex which is named.
    const LeastPositive on_vertex = least_positive(sphere, distribute_about(sphere, sphere.positions[17]));
    EXPECT_GE(on_vertex.count, 1u);
    EXPECT_EQ(on_vertex.vertex, 17u);
}

}  // namespace
}  // namespace innerspring
