#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "innerspring/mesh/geometry.h"
#include "innerspring/mesh/medial.h"
#include "innerspring/mesh/shapes.h"

using namespace innerspring;

namespace {

double median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
    return values[values.size() / 2];
}

void expect_sound(const SurfaceMesh& mesh, const std::vector<double>& radii) {
    ASSERT_EQ(radii.size(), mesh.positions.size());
    const auto [lower, upper] = bounding_box(mesh.positions);
    for (double r : radii) {
        ASSERT_TRUE(std::isfinite(r));
        ASSERT_GT(r, 0);
        ASSERT_LE(r, (upper - lower).norm());
    }
}

/// First-order relative change of volume under gravity g [m/s^2], with the masses and springs of Eqs. 1-3
/// about local centres.
double gravity_volume_change(const SurfaceMesh& mesh, const std::vector<double>& length, const Vector& g) {
    constexpr double mass = 0.05, modulus = 10;
    const double v = volume(mesh);
    const std::vector<double> areas = triangle_areas(mesh.positions, mesh.triangles);
    double columns = 0;
    for (std::size_t t = 0; t < areas.size(); ++t)
        for (Index i : mesh.triangles[t]) columns += areas[t] * length[i] / 9;
    std::vector<double> m(length.size(), 0.0), k(length.size(), 0.0);
    std::vector<Vector> gradient(length.size(), Vector::Zero());
    for (std::size_t t = 0; t < areas.size(); ++t) {
        const Triangle& corners = mesh.triangles[t];
        const double sum = length[corners[0]] + length[corners[1]] + length[corners[2]];
        const double v_t = v / columns * areas[t] * sum / 9;
        for (Index i : corners) {
            m[i] += (sum - length[i]) / (2 * sum) * v_t / v * mass;
            k[i] += modulus * v_t / (length[i] * length[i]);
            gradient[i] += double_area_vector(mesh.positions, corners) / 6;
        }
    }
    double change = 0;
    for (std::size_t i = 0; i < length.size(); ++i) change += gradient[i].dot(g) * m[i] / k[i] / v;
    return change;
}

TEST(Medial, ThreadsDoNotChangeABit) {
    const SurfaceMesh mesh = make_shape("organ:vertices=12000");
    const std::vector<double> alone = medial_radii(mesh, {.threads = 1});
    for (int threads : {0, 2, 3}) EXPECT_EQ(medial_radii(mesh, {.threads = threads}), alone);
}

/// Neighbours help each other, but who comes first must not matter: with few vertices to the search's own
/// tolerance, with many to what the points left out can hide.
TEST(Medial, TheOrderOfVerticesDoesNotMatter) {
    for (const auto& [shape, tolerance] : {std::pair{"organ:vertices=900", 2e-4},
                                           {"plate:vertices=900", 2e-4},
                                           {"dumbbell:vertices=5000", 0.02}}) {
        const SurfaceMesh mesh = make_shape(shape);
        const Index n = Index(mesh.positions.size());
        SurfaceMesh other = mesh;
        for (Index i = 0; i < n; ++i) other.positions[n - 1 - i] = mesh.positions[i];
        for (Triangle& t : other.triangles)
            for (Index& v : t) v = n - 1 - v;
        const std::vector<double> a = medial_radii(mesh), b = medial_radii(other);
        for (Index i = 0; i < n; ++i)
            EXPECT_NEAR(b[n - 1 - i] / a[i], 1, tolerance) << shape << " vertex " << i;
    }
}

}  // namespace

TEST(Medial, SphereGivesItsRadiusOnAnyTriangulation) {
    for (const char* s :
         {"sphere:vertices=100", "sphere", "sphere:vertices=6000", "sphere:irregularity=50,vertices=300",
          "sphere:irregularity=10,vertices=3000", "icosphere:vertices=2000", "icosphere:vertices=12"}) {
        SCOPED_TRACE(s);
        const SurfaceMesh mesh = make_shape(s);
        const std::vector<double> radii = medial_radii(mesh);
        expect_sound(mesh, radii);
        for (double r : radii) ASSERT_NEAR(r, 1, 1e-3);
    }
}

TEST(Medial, SlabGivesHalfItsThickness) {
    for (const char* s :
         {"plate:aspect=10,vertices=500", "plate:aspect=10,vertices=5000", "plate:aspect=50,vertices=300"}) {
        SCOPED_TRACE(s);
        const SurfaceMesh mesh = make_shape(s);
        const std::vector<double> radii = medial_radii(mesh);
        expect_sound(mesh, radii);
        const auto [lower, upper] = bounding_box(mesh.positions);
        const double thickness = (upper - lower).y(), width = (upper - lower).x();
        for (std::size_t i = 0; i < radii.size(); ++i)
            if (std::hypot(mesh.positions[i].x(), mesh.positions[i].z()) < 0.3 * width) {
                ASSERT_LE(radii[i], 0.61 * thickness);
                ASSERT_GE(radii[i], 0.45 * thickness);
            }
        EXPECT_NEAR(median(radii), thickness / 2, 0.1 * thickness);
    }
}

TEST(Medial, TorusAndCapsuleGiveTheirTube) {
    for (const char* s : {"torus:vertices=2000", "capsule:vertices=2000", "torus:ratio=5,vertices=2000"}) {
        SCOPED_TRACE(s);
        const SurfaceMesh mesh = make_shape(s);
        const auto [lower, upper] = bounding_box(mesh.positions);
        const double tube = (upper - lower).z() / 2;
        const std::vector<double> radii = medial_radii(mesh);
        expect_sound(mesh, radii);
        for (double r : radii) ASSERT_NEAR(r / tube, 1, 0.08);
        EXPECT_NEAR(median(radii) / tube, 1, 0.01);
    }
}

TEST(Medial, FineMeshesAreNoNoisierThanCoarseOnes) {
    const auto radii = medial_radii(make_shape("organ:vertices=8000"));
    const auto coarse = medial_radii(make_shape("organ:vertices=2000"));
    EXPECT_NEAR(median(radii), median(coarse), 0.03);
    EXPECT_GT(*std::min_element(radii.begin(), radii.end()), 0.05);
}

TEST(Medial, MovesTurnsAndScalesWithTheMesh) {
    const SurfaceMesh mesh = make_shape("organ:vertices=900");
    const std::vector<double> radii = medial_radii(mesh);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vector(1, 2, -1).normalized()).toRotationMatrix();
    SurfaceMesh moved = mesh, grown = mesh, turned = mesh;
    for (Vector& p : moved.positions) p += Vector(3, -5, 2);
    for (Vector& p : grown.positions) p *= 0.01;
    for (Vector& p : turned.positions) p = turn * p;
    const std::vector<double> a = medial_radii(moved), b = medial_radii(grown), c = medial_radii(turned);
    for (std::size_t i = 0; i < radii.size(); ++i) {
        ASSERT_NEAR(a[i] / radii[i], 1, 1e-3);
        ASSERT_NEAR(b[i] / (0.01 * radii[i]), 1, 1e-3);
        ASSERT_NEAR(c[i] / radii[i], 1, 0.02);
    }
}

TEST(Medial, DegenerateInputGivesPositiveRadii) {
    SurfaceMesh flat;  // two coincident triangles back to back: every normal cancels
    flat.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    flat.triangles = {{0, 1, 2}, {0, 2, 1}};
    expect_sound(flat, medial_radii(flat));

    SurfaceMesh needle = make_shape("icosphere:vertices=100");
    for (Vector& p : needle.positions) p = Vector(p.x(), 1e-9 * p.y(), p.z() > 0 ? 0 : 1e-12 * p.z());
    expect_sound(needle, medial_radii(needle));

    SurfaceMesh inside_out = make_shape("organ:vertices=300");
    for (Triangle& t : inside_out.triangles) std::swap(t[1], t[2]);
    expect_sound(inside_out, medial_radii(inside_out));

    SurfaceMesh tetrahedron;
    tetrahedron.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    expect_sound(tetrahedron, medial_radii(tetrahedron));

    EXPECT_TRUE(medial_radii(SurfaceMesh{}).empty());
}

TEST(Medial, GravityAlmostKeepsTheVolumeAboutLocalCentres) {
    // physics.md, section 2: the paper's gravity acts along -y.
    for (const char* s : {"sphere", "organ", "organ:vertices=5000,seed=2", "torus", "dumbbell", "capsule",
                          "plate", "ellipsoid", "breast"}) {
        const SurfaceMesh mesh = make_shape(s);
        EXPECT_LT(std::abs(gravity_volume_change(mesh, medial_radii(mesh), {0, -9.81, 0})), 3e-4) << s;
    }
    const SurfaceMesh sphere = make_shape("sphere");
    EXPECT_LT(std::abs(gravity_volume_change(sphere, medial_radii(sphere), {0, -9.81, 0})), 1e-10);
}
