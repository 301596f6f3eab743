// Meshes that nobody here made.
#include <gtest/gtest.h>

#include <filesystem>

#include "check_helpers.h"
#include "innerspring/mesh/geometry.h"
#include "innerspring/mesh/read.h"
#include "innerspring/mesh/weld.h"

namespace innerspring {
namespace {

using namespace innerspring::testing;

class RealMesh : public ::testing::Test {
  protected:
    static bool there(const std::string& name) {
        return std::filesystem::exists(std::filesystem::path(SHARED_MESHES) / name);
    }
    static SurfaceMesh load(const std::string& name) {
        SurfaceMesh m = weld(read(std::filesystem::path(SHARED_MESHES) / name)).mesh;
        m.name = name;
        return m;
    }
};

#define NEEDS(name) \
    if (!there(name)) GTEST_SKIP() << name << " is not beside the checkout"

TEST_F(RealMesh, Dragon) {
    NEEDS("dragon.stl");
    const SurfaceMesh m = load("dragon.stl");
    const CheckReport report = checked(m);
    EXPECT_EQ(report.verdict, Verdict::unusable);
    EXPECT_EQ(finding(report, "closed").count, 26u);
    EXPECT_EQ(finding(report, "manifold_edges").count, 97u);
    EXPECT_FALSE(report.genus);
    expect_mentions(refusal(m), "dragon.stl: the surface is not closed (26 open edges); edge ");
}

TEST_F(RealMesh, Suzanne) {
    NEEDS("suzanne.obj");
    const CheckReport report = checked(load("suzanne.obj"));
    EXPECT_EQ(report.verdict, Verdict::unusable);
    EXPECT_EQ(finding(report, "closed").count, 42u);
    EXPECT_EQ(report.components, 3u);
    EXPECT_EQ(finding(report, "duplicate").count, 2u)
        << "the edge with four triangles is that of a folded pair";
}

TEST_F(RealMesh, Liver) {
    NEEDS("liver.obj");
    const SurfaceMesh m = load("liver.obj");
    const CheckReport report = checked(m);
    EXPECT_EQ(faults(report), Keys{"star_shaped"});
    EXPECT_EQ(report.vertices, 139u);
    EXPECT_EQ(report.genus, 0);
    EXPECT_NEAR(report.negative_tetrahedra_by_count, 36.0 / 274, 1e-12);
    // About the mean of the vertices it is worse.
    const Vector mean = vertex_mean(m.positions);
    const auto negative = std::ranges::count_if(m.triangles, [&](const Triangle& t) {
        return (m.positions[t[0]] - mean).dot((m.positions[t[1]] - mean).cross(m.positions[t[2]] - mean)) <=
               0;
    });
    EXPECT_EQ(negative, 63);  // 23 % of 274
    EXPECT_EQ(refusal(m), "");
}

TEST_F(RealMesh, Torus) {
    NEEDS("torus.obj");
    const CheckReport report = checked(load("torus.obj"));
    EXPECT_EQ(report.genus, 1);
    EXPECT_NEAR(report.negative_tetrahedra_by_count, 0.40, 0.005);
}

TEST_F(RealMesh, Bunny) {
    NEEDS("Bunny.stl");
    const CheckReport report = checked(load("Bunny.stl"));
    EXPECT_EQ(report.vertices, 1366u);
    EXPECT_EQ(report.genus, 0);
    EXPECT_NEAR(report.negative_tetrahedra_by_count, 0.09, 0.005);
}

TEST_F(RealMesh, Spot) {
    NEEDS("spot.obj");
    const CheckReport report = checked(load("spot.obj"));
    EXPECT_EQ(report.vertices, 2930u);
    EXPECT_EQ(report.genus, 0);
    EXPECT_NEAR(report.negative_tetrahedra_by_count, 0.11, 0.01);
}

TEST_F(RealMesh, StarShapedLiver) {
    NEEDS("liver2.obj");
    const CheckReport report = checked(load("liver2.obj"));
    EXPECT_EQ(report.verdict, Verdict::fine);
    EXPECT_EQ(report.vertices, 1170u);
    EXPECT_EQ(report.negative_tetrahedra_by_count, 0);
}

}  // namespace
}  // namespace innerspring
