#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/geometry.h"
#include "innerspring/mesh/nearest_name.h"
#include "innerspring/mesh/self_intersection.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/topology.h"
#include "mesh/manifold.h"
#include "support/sanitized.h"

using namespace innerspring;

namespace {

constexpr double pi = std::numbers::pi;
using Words = std::vector<std::string_view>;

bool is_sphere(const std::string& shape) {
    return shape == "sphere" || shape == "icosphere";
}

double smallest_angle(const SurfaceMesh& mesh) {
    double least = pi;
    for (const Triangle& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) {
            const Vector a = mesh.positions[t[(k + 1) % 3]] - mesh.positions[t[k]];
            const Vector b = mesh.positions[t[(k + 2) % 3]] - mesh.positions[t[k]];
            least = std::min(least, std::atan2(a.cross(b).norm(), a.dot(b)));
        }
    return least * 180 / pi;
}

/// Share of triangles whose tetrahedron with the volume centroid has a negative volume.
double negative_share(const SurfaceMesh& mesh) {
    const Vector c = volume_centroid(mesh.positions, mesh.triangles);
    double negative = 0;
    for (const Triangle& t : mesh.triangles)
        negative += (mesh.positions[t[0]] - c).dot(double_area_vector(mesh.positions, t)) < 0;
    return negative / double(mesh.triangles.size());
}

bool same_bits(const SurfaceMesh& a, const SurfaceMesh& b) {
    return a.positions == b.positions && a.triangles == b.triangles;
}

std::string message_of(const std::string& specification) {
    try {
        make_shape(specification);
    } catch (const InputError& error) {
        return error.what();
    }
    return "(accepted)";
}

class EveryShape : public testing::TestWithParam<std::tuple<std::string, int>> {};

std::string spec(const std::string& shape, int vertices, const std::string& more = "") {
    return shape + ":vertices=" + std::to_string(vertices) + more;
}

}  // namespace

TEST_P(EveryShape, IsAClosedSolidOfTheWantedSize) {
    const auto [shape, vertices] = GetParam();
    const SurfaceMesh mesh = make_shape(spec(shape, vertices));
    EXPECT_EQ(mesh.name, spec(shape, vertices));
    EXPECT_EQ(check_manifold(mesh), shape == "torus" ? 0 : 2);
    EXPECT_GT(volume(mesh), 0);
    if (!is_sphere(shape)) {
        EXPECT_NEAR(volume_radius(volume(mesh)), 1, 1e-12);
        EXPECT_LT(volume_centroid(mesh.positions, mesh.triangles).norm(), 1e-12);
    }
    EXPECT_NEAR(double(mesh.positions.size()), vertices,
                shape == "icosphere" ? 0.2 * vertices : 0);  // the nearest 10 n^2 + 2
    EXPECT_GT(smallest_angle(mesh), 15);
    EXPECT_TRUE(self_intersections(mesh).empty());
}

TEST_P(EveryShape, IsTheSameBitsForTheSameSpecificationOnly) {
    const auto [shape, vertices] = GetParam();
    const SurfaceMesh mesh = make_shape(spec(shape, vertices));
    EXPECT_TRUE(same_bits(mesh, make_shape(spec(shape, vertices, ",seed=1"))));
    EXPECT_EQ(same_bits(mesh, make_shape(spec(shape, vertices, ",seed=2"))), shape == "icosphere");
}

TEST_P(EveryShape, HasARadius) {
    const auto [shape, vertices] = GetParam();
    const SurfaceMesh one = make_shape(spec(shape, vertices)),
                      small = make_shape(spec(shape, vertices, ",radius=0.05"));
    EXPECT_NEAR(volume(small) / volume(one), 0.05 * 0.05 * 0.05, 1e-15);
    EXPECT_EQ(one.triangles, small.triangles);
}

INSTANTIATE_TEST_SUITE_P(Shapes, EveryShape,
                         testing::Combine(testing::Values("sphere", "icosphere", "ellipsoid", "breast",
                                                          "capsule", "torus", "dumbbell", "plate", "organ"),
                                          testing::Values(200, 2000, INNERSPRING_SANITIZED ? 5000 : 20000)),
                         [](const auto& which) {
                             return std::get<0>(which.param) + "_" + std::to_string(std::get<1>(which.param));
                         });

TEST(Shapes, AreSoundAtTheirLimits) {
    for (const char* s :
         {"sphere:irregularity=50", "sphere:irregularity=1", "ellipsoid:a=10,b=3,c=1",
          "ellipsoid:a=10,b=10,c=1,vertices=4000", "capsule:aspect=1", "capsule:aspect=20", "torus:ratio=1.2",
          "torus:ratio=20", "dumbbell:neck=0.1", "dumbbell:neck=0.95", "plate:aspect=1",
          "plate:aspect=50,vertices=8000", "organ:bumpiness=0", "organ:bumpiness=1.5"}) {
        SCOPED_TRACE(s);
        const SurfaceMesh mesh = make_shape(s);
        check_manifold(mesh);
        EXPECT_GT(smallest_angle(mesh), 15);
        EXPECT_TRUE(self_intersections(mesh).empty());
    }
}

TEST(Shapes, AreClosedWithAsFewVerticesAsAllowed) {
    for (std::string_view shape : shape_names())
        for (int vertices : {12, 13, 17, 30, 60}) {
            SCOPED_TRACE(spec(std::string(shape), vertices));
            const SurfaceMesh mesh = make_shape(spec(std::string(shape), vertices));
            EXPECT_EQ(check_manifold(mesh), shape == "torus" ? 0 : 2);
            EXPECT_GT(volume(mesh), 0);
            EXPECT_TRUE(self_intersections(mesh).empty());
        }
}

TEST(Shapes, SeedsGiveSoundOrgans) {
    for (int seed = 2; seed < 20; ++seed) {
        SCOPED_TRACE(seed);
        const SurfaceMesh mesh = make_shape("organ:vertices=1500,seed=" + std::to_string(seed));
        EXPECT_EQ(check_manifold(mesh), 2);
        EXPECT_GT(smallest_angle(mesh), 15);
        EXPECT_TRUE(self_intersections(mesh).empty());
        EXPECT_GT(negative_share(mesh), 0.01);
        EXPECT_LT(negative_share(mesh), 0.15);
    }
}

TEST(Shapes, OnlyOrganAndTorusHaveNegativeVirtualTetrahedra) {
    for (const char* shape : {"sphere", "icosphere", "ellipsoid", "breast", "capsule", "plate"})
        EXPECT_EQ(negative_share(make_shape(shape)), 0) << shape;
    EXPECT_GT(negative_share(make_shape("organ:vertices=5000")), 0.03);
    EXPECT_LT(negative_share(make_shape("organ:vertices=5000")), 0.15);
    EXPECT_GT(negative_share(make_shape("torus")), 0.2);
    EXPECT_GT(negative_share(make_shape("dumbbell:neck=0.2")), 0.03);
}

TEST(Sphere, VerticesLieOnTheSphere) {
    for (const char* s : {"sphere:radius=1.7", "icosphere:radius=1.7", "sphere:radius=1.7,irregularity=50"})
        for (const Vector& p : make_shape(s).positions) EXPECT_NEAR(p.norm(), 1.7, 1e-15);
}

TEST(Sphere, VolumeTendsToTheBall) {
    for (const char* s : {"sphere", "icosphere", "sphere:irregularity=10"}) {
        const std::string more = std::string(s).find(':') == std::string::npos ? ":" : ",";
        auto gap = [&](const char* vertices) {
            return 1 - volume(make_shape(s + more + "vertices=" + vertices)) / (4 * pi / 3);
        };
        EXPECT_LT(gap("20000"), 1e-3) << s;
        EXPECT_GT(gap("20000"), 0) << s;
        EXPECT_NEAR(gap("2000") / gap("20000"), 10, 1.5) << s;  // of second order in the spacing
    }
}

TEST(Sphere, DensestOverCoarsestIsTheIrregularity) {
    for (double irregularity : {1.0, 3.0, 5.0, 20.0, 50.0}) {
        const SurfaceMesh mesh =
            make_shape("sphere:vertices=20000,irregularity=" + std::to_string(irregularity));
        const double cap = 0.05, slope = std::log(irregularity) / 2;  // the density is exp(slope (z + 1))
        double north = 0, south = 0, middle = 0;
        for (const Vector& p : mesh.positions) {
            north += p.z() > 1 - 2 * cap;
            south += p.z() < -1 + 2 * cap;
            middle += std::abs(p.z()) < cap;  // as much area as a cap
        }
        EXPECT_NEAR(north / south * std::exp(slope * 2 * cap) / irregularity, 1, 0.15) << irregularity;
        EXPECT_NEAR(north / middle * std::exp(slope * cap) / std::sqrt(irregularity), 1, 0.15)
            << irregularity;
        EXPECT_GT(smallest_angle(mesh), 15) << irregularity;
    }
}

TEST(Sphere, IsUnstructured) {
    for (const char* s : {"sphere:vertices=2000", "sphere:vertices=2000,irregularity=1"}) {
        const SurfaceMesh mesh = make_shape(s);
        const Topology topology = build_topology(mesh.positions.size(), mesh.triangles);
        std::size_t six = 0;
        for (std::size_t v = 0; v < mesh.positions.size(); ++v)
            six += topology.vertex_triangles[v].size() == 6;
        EXPECT_LT(six, 0.65 * double(mesh.positions.size()));
    }
}

TEST(Icosphere, CountsAreTenNSquaredPlusTwo) {
    for (int n = 1; n < 15; ++n) {
        const std::size_t count = std::size_t(10 * n * n + 2);
        EXPECT_EQ(make_shape("icosphere:vertices=" + std::to_string(count)).positions.size(), count);
        EXPECT_EQ(make_shape("icosphere:vertices=" + std::to_string(count + 4)).positions.size(), count);
    }
}

TEST(Ellipsoid, VerticesLieOnTheEllipsoid) {
    const SurfaceMesh mesh = make_shape("ellipsoid:a=3,b=2,c=1,vertices=3000");
    const auto [lower, upper] = bounding_box(mesh.positions);
    // Up to the normalisation, which moves and scales by what the facets cut off.
    const double scale = 1 / std::cbrt(6.0);
    for (const Vector& p : mesh.positions)
        EXPECT_NEAR(p.cwiseQuotient(Vector(3, 2, 1)).norm() / scale, 1, 3e-3);
    EXPECT_NEAR((upper - lower).x() / (upper - lower).y(), 1.5, 0.01);
    EXPECT_NEAR((upper - lower).x() / (upper - lower).z(), 3.0, 0.02);
}

TEST(Breast, IsDenseAtTheNippleAndFlatBehind) {
    const SurfaceMesh mesh = make_shape("breast:vertices=4000");
    Index tip = 0;
    for (Index v = 0; v < mesh.positions.size(); ++v)
        if (mesh.positions[v].z() > mesh.positions[tip].z()) tip = v;
    const std::vector<double> areas = vertex_areas(mesh.positions, mesh.triangles);
    std::vector<double> near, far;
    double back = 0;
    const double behind = bounding_box(mesh.positions).first.z();
    for (std::size_t v = 0; v < areas.size(); ++v) {
        const double distance = (mesh.positions[v] - mesh.positions[tip]).norm();
        if (distance < 0.12) near.push_back(areas[v]);
        if (distance > 0.8) far.push_back(areas[v]);
        if (mesh.positions[v].z() < behind + 0.05) back += areas[v];
    }
    auto median = [](std::vector<double>& a) {
        std::nth_element(a.begin(), a.begin() + std::ptrdiff_t(a.size() / 2), a.end());
        return a[a.size() / 2];
    };
    EXPECT_GT(median(far) / median(near), 3);
    EXPECT_LT(median(far) / median(near), 5);
    EXPECT_GT(back, 2.0);                      // a disc of radius 0.8 at least
    EXPECT_LT(mesh.positions[tip].y(), -0.1);  // hangs towards -y
}

TEST(Specification, MistakesAreNamed) {
    EXPECT_NE(message_of("shpere").find("did you mean 'sphere'"), std::string::npos);
    EXPECT_NE(message_of("zzz").find("known: sphere"), std::string::npos);
    EXPECT_NE(message_of("sphere:verticse=100").find("did you mean 'vertices'"), std::string::npos);
    EXPECT_NE(message_of("torus:irregularity=3").find("no key 'irregularity'"), std::string::npos);
    EXPECT_NE(message_of("sphere:vertices=11").find("from 12 to 5000000"), std::string::npos);
    EXPECT_NE(message_of("sphere:vertices=100.5").find("whole number"), std::string::npos);
    EXPECT_NE(message_of("sphere:irregularity=0.5").find("from 1 to 50"), std::string::npos);
    EXPECT_NE(message_of("sphere:vertices=100,vertices=200").find("twice"), std::string::npos);
    EXPECT_NE(message_of("ellipsoid:a=100,b=1,c=1").find("at most"), std::string::npos);
    EXPECT_NE(message_of("torus:ratio=20,vertices=30").find("at least 5 times"), std::string::npos);
    for (const char* bad :
         {"", ":", "sphere:vertices", "sphere:vertices=", "sphere:vertices=1e3x", "sphere:vertices=nan",
          "sphere:radius=inf", "sphere:radius=-1", "sphere:=3", "sphere:,", "sphere:seed=-1", "Sphere "})
        EXPECT_NE(message_of(bad), "(accepted)") << bad;
    EXPECT_EQ(make_shape("sphere:vertices=1e2").positions.size(), 100u);
    EXPECT_EQ(make_shape("sphere:").positions.size(), 1000u);
}

TEST(Specification, ShapesAreRecognised) {
    EXPECT_TRUE(is_shape("sphere"));
    EXPECT_TRUE(is_shape("organ:vertices=3"));
    EXPECT_FALSE(is_shape("sphere.obj"));
    EXPECT_FALSE(is_shape(""));
    EXPECT_EQ(shape_names().size(), 9u);
}

TEST(NearestName, FindsWhatWasMeant) {
    const Words known{"vertices", "seed", "radius", "irregularity"};
    EXPECT_EQ(nearest_name("vertcies", known), "vertices");
    EXPECT_EQ(nearest_name("Radius", known), "radius");
    EXPECT_EQ(nearest_name("irreg", known), "irregularity");
    EXPECT_EQ(nearest_name("sed", known), "seed");
    EXPECT_EQ(nearest_name("velocity", known), "");
    EXPECT_EQ(nearest_name("", known), "");
    EXPECT_EQ(nearest_name("x", known), "");
    EXPECT_EQ(nearest_name(std::string(100000, 'a'), known), "");
    EXPECT_EQ(nearest_name("time_step", Words{"time-step"}), "time-step");
}
