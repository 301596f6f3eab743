#include "innerspring/body/centre.h"

#include <gtest/gtest.h>

#include "innerspring/body/distribution.h"
#include "innerspring/mesh/error.h"
#include "support/bodies.h"
#include "support/sanitized.h"

namespace innerspring {
namespace {

using namespace support;

/// How far inside all planes of the mesh `p` is [m]; negative outside the kernel.
double depth_in_kernel(const SurfaceMesh& mesh, const Vector& p) {
    double least = INFINITY;
    for (const Triangle& t : mesh.triangles)
        least =
            std::min(least, double_area_vector(mesh.positions, t).normalized().dot(mesh.positions[t[0]] - p));
    return least;
}

/// A kernel point must keep the margin, and no feasible point drawn near it or from the box may be nearer to
/// the target.
void expect_nearest(const SurfaceMesh& mesh, const Vector& target, double margin, const Vector& found) {
    const double size = 1e-7;
    EXPECT_GT(depth_in_kernel(mesh, found), margin - size);
    const auto [lower, upper] = bounding_box(mesh.positions);
    Random random(5);
    const double best = (found - target).norm();
    int feasible = 0;
    for (int n = 0; n < 6000; ++n) {
        Vector p = lower + (upper - lower).cwiseProduct((random_vector(random) + Vector::Ones()) / 2);
        if (n % 3 == 1) p = found + std::pow(10, random.uniform(-5, 0)) * random_vector(random);
        if (n % 3 == 2) p = target + (best * random.uniform(0.5, 1)) * random_vector(random).normalized();
        if (depth_in_kernel(mesh, p) < margin) continue;
        ++feasible;
        EXPECT_GE((p - target).norm(), best - size) << p.transpose();
    }
    EXPECT_GT(feasible, 20) << "the search saw too few points to mean anything";
}

TEST(KernelPoint, OfACubeIsTheTargetOrItsProjection) {
    const SurfaceMesh cube = box({2, 2, 2}, 0.5);
    EXPECT_EQ(*kernel_point(cube, {0.1, 0.2, 0.3}, 0.1), Vector(0.1, 0.2, 0.3));
    EXPECT_LT((*kernel_point(cube, {3, 0.2, -0.3}, 0.1) - Vector(0.9, 0.2, -0.3)).norm(), 1e-8);
    EXPECT_LT((*kernel_point(cube, {3, -4, 0.5}, 0.25) - Vector(0.75, -0.75, 0.5)).norm(), 1e-8);
    EXPECT_LT((*kernel_point(cube, {3, -4, 5}, 0.5) - Vector(0.5, -0.5, 0.5)).norm(), 1e-8);
    EXPECT_TRUE(kernel_point(cube, Vector::Zero(), 0.99));
    EXPECT_FALSE(kernel_point(cube, Vector::Zero(), 1.01)) << "no point is that deep inside";
}

TEST(KernelPoint, IsTheNearestOfAll) {
    const SurfaceMesh mesh = comet();
    const Vector centroid = volume_centroid(mesh.positions, mesh.triangles);
    ASSERT_LT(depth_in_kernel(mesh, centroid), 0)
        << "the shape was made so that its centroid is outside the kernel";
    ASSERT_GT(depth_in_kernel(mesh, Vector::Zero()), 0.1);
    const double margin = 0.02;
    const auto found = kernel_point(mesh, centroid, margin);
    ASSERT_TRUE(found);
    expect_nearest(mesh, centroid, margin, *found);
}

TEST(KernelPoint, IsTheNearestForTiltedShapesAndTargets) {
    Random random(11);
    for (int n = 0; n < (INNERSPRING_SANITIZED ? 1 : 4); ++n) {
        const SurfaceMesh mesh = moved(comet(), random_rotation(random), 1, random_vector(random));
        const Vector target = random_vector(random) * 3;
        const auto found = kernel_point(mesh, target, 0.05);
        ASSERT_TRUE(found);
        expect_nearest(mesh, target, 0.05, *found);
    }
}

TEST(KernelPoint, NoneWhereNoPointSeesAll) {
    EXPECT_FALSE(kernel_point(make_shape("torus:vertices=500"), Vector::Zero(), 1e-6));
    EXPECT_FALSE(kernel_point(make_shape("organ:vertices=500"), Vector::Zero(), 1e-6));
}

TEST(Centre, AutoTakesTheCentroidOfCompactShapes) {
    for (const char* shape : {"sphere", "icosphere", "ellipsoid", "breast"}) {
        const Body body = make_body(std::string(shape) + ":vertices=800");
        EXPECT_EQ(body.centre.kind, CentreKind::centroid) << shape;
        EXPECT_LT((body.centre.position - volume_centroid(body.rest.positions, body.rest.triangles)).norm(),
                  1e-12)
            << shape;
        EXPECT_NE(body.centre.reason.find("positive"), std::string::npos) << body.centre.reason;
    }
}

TEST(Centre, AutoTakesAKernelPointOfALopsidedStar) {
    const Body body = make_body(comet());
    ASSERT_EQ(body.centre.kind, CentreKind::kernel) << body.centre.reason;
    EXPECT_GT(depth_in_kernel(body.rest, body.centre.position), 0);
    EXPECT_NE(body.centre.reason.find("kernel"), std::string::npos) << body.centre.reason;
    for (double K : body.K) ASSERT_GT(K, 0);
}

TEST(Centre, AutoGoesLocalAndSaysWhy) {
    for (const char* shape : {"organ:vertices=800", "torus:vertices=800"}) {
        const Body body = make_body(shape);
        EXPECT_EQ(body.centre.kind, CentreKind::local) << shape;
        // The reason counts the vertices that the centroid would have cost.
        const LeastPositive worst =
            least_positive(body.rest, distribute_about(body.rest, body.centre.position));
        EXPECT_GT(worst.count, 0u);
        EXPECT_NE(
            body.centre.reason.find(std::to_string(worst.count) + " of " + std::to_string(body.vertices())),
            std::string::npos)
            << body.centre.reason;
    }
}

TEST(Centre, AGivenCentreOutsideIsRefusedNamingAVertex) {
    BodyRecipe recipe;
    recipe.centre = {CentreKind::given, Vector(0, 0, 1.5)};
    try {
        make_body("icosphere:vertices=162", recipe);
        FAIL() << "built about a centre outside";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("vertex"), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find("given"), std::string::npos) << error.what();
    }
}

TEST(Centre, AskedForKindsAreTakenOrRefused) {
    BodyRecipe recipe;
    recipe.centre.kind = CentreKind::kernel;
    EXPECT_THROW(make_body("torus:vertices=400", recipe), InputError);
    EXPECT_EQ(make_body(comet(), recipe).centre.kind, CentreKind::kernel);
    recipe.centre.kind = CentreKind::centroid;
    EXPECT_THROW(make_body("torus:vertices=400", recipe), InputError);
    EXPECT_EQ(make_body("sphere:vertices=400", recipe).centre.kind, CentreKind::centroid);
    recipe.centre.kind = CentreKind::local;
    EXPECT_EQ(make_body("sphere:vertices=400", recipe).centre.kind, CentreKind::local);
    recipe.centre = {CentreKind::given, Vector(0.1, 0, 0)};
    EXPECT_EQ(make_body("sphere:vertices=400", recipe).centre.position, Vector(0.1, 0, 0));
    recipe.centre = {CentreKind::given, make_shape("sphere:vertices=400").positions[3]};
    EXPECT_THROW(make_body("sphere:vertices=400", recipe), InputError)
        << "a vertex has no spring of length zero";
}

TEST(Centre, Parsing) {
    EXPECT_EQ(parse_centre("auto").kind, CentreKind::automatic);
    EXPECT_EQ(parse_centre("centroid").kind, CentreKind::centroid);
    EXPECT_EQ(parse_centre("kernel").kind, CentreKind::kernel);
    EXPECT_EQ(parse_centre("local").kind, CentreKind::local);
    const CentreOption given = parse_centre("1.5,-2,3e-3");
    EXPECT_EQ(given.kind, CentreKind::given);
    EXPECT_EQ(given.position, Vector(1.5, -2, 3e-3));
    for (CentreKind kind :
         {CentreKind::automatic, CentreKind::centroid, CentreKind::kernel, CentreKind::local})
        EXPECT_EQ(parse_centre(to_string(kind)).kind, kind);
    for (const char* wrong :
         {"", "middle", "given", "1,2", "1,2,3,4", "1,2,", "1,2,x", "nan,0,0", "inf,0,0", "1 2 3", "1,2,3 "})
        EXPECT_THROW(parse_centre(wrong), InputError) << wrong;
}

}  // namespace
}  // namespace innerspring
