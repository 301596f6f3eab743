#include "innerspring/body/body.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/read.h"
#include "innerspring/mesh/weld.h"
#include "support/body_checks.h"

namespace innerspring {
namespace {

using namespace support;

void expect_close(const std::vector<double>& a, const std::vector<double>& b, double factor, double tolerance,
                  const char* what) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i)
        ASSERT_NEAR(a[i], factor * b[i], tolerance * factor * b[i]) << what << " " << i;
}

TEST(Body, MassIsConservedInEveryScheme) {
    for (Scheme scheme : {Scheme::A, Scheme::B, Scheme::C})
        for (const char* shape :
             {"sphere:vertices=500", "organ:vertices=500", "torus:vertices=500", "breast:vertices=500"}) {
            BodyRecipe recipe;
            recipe.scheme = scheme;
            recipe.mass = 0.73;
            const Body body = make_body(shape, recipe);
            EXPECT_NEAR(sum(body.m), 0.73, 1e-13) << shape << to_string(scheme);
        }
}

TEST(Body, SchemesAAndBHaveTheMeanStiffnessOfC) {
    BodyRecipe recipe;
    const Body C = make_body("sphere:vertices=500", recipe);
    recipe.scheme = Scheme::B;
    const Body B = make_body("sphere:vertices=500", recipe);
    recipe.scheme = Scheme::A;
    const Body A = make_body("sphere:vertices=500", recipe);
    const double mean = sum(C.K) / double(C.vertices());
    for (std::size_t i = 0; i < C.vertices(); ++i) {
        ASSERT_NEAR(A.K[i], mean, 1e-12 * mean);
        ASSERT_EQ(A.K[i], B.K[i]);
        ASSERT_EQ(B.m[i], C.m[i]);
        ASSERT_EQ(A.m[i], 0.05 / double(A.vertices()));
    }
    EXPECT_GT(*std::max_element(C.K.begin(), C.K.end()), 1.5 * mean) << "the sphere is meant to be irregular";
}

TEST(Body, StiffnessDampingAndSurfaceFollowTheirFormulas) {
    BodyRecipe recipe;
    recipe.young = 37;
    recipe.surface = 2.5;
    recipe.damping = 0.3;
    const Body body = make_sphere(spheres[1], recipe);
    EXPECT_NEAR(sum(body.K), 3 * body.volume * 37, 1e-11 * sum(body.K));
    for (std::size_t i = 0; i < body.vertices(); ++i)
        ASSERT_NEAR(body.c[i], 2 * 0.3 * std::sqrt(body.K[i] * body.m[i]), 1e-14 * body.c[i]);
    // Each triangle gives its area to its three edges: sum k_e |e|^2 = 3 E_s area.
    double sum_k = 0;
    for (std::size_t e = 0; e < body.k.size(); ++e) {
        const auto [a, b] = body.edges[e];
        ASSERT_NEAR(body.rest_length[e], (body.rest.positions[a] - body.rest.positions[b]).norm(), 1e-15);
        sum_k += body.k[e] * body.rest_length[e] * body.rest_length[e];
    }
    EXPECT_NEAR(sum_k, 3 * 2.5 * sum(triangle_areas(body.rest.positions, body.rest.triangles)),
                1e-10 * sum_k);
}

TEST(Body, SurfaceSpringOfOneEquilateralPair) {
    const Body body =
        make_body("icosphere:vertices=12");  // 20 equal equilateral triangles: k = E_s 2 (sqrt 3 / 4)
    for (double k : body.k) EXPECT_NEAR(k, std::sqrt(3.0) / 2, 1e-12);
}

TEST(Body, SpokesAreTheEdgesSeenFromBothEnds) {
    const Body body = make_body("organ:vertices=300");
    EXPECT_EQ(body.spokes.size(), 2 * body.k.size());
    expect_sound(body);
}

TEST(Body, ScaleLaws) {
    for (const char* shape : {"ellipsoid:vertices=400", "organ:vertices=400"}) {
        const SurfaceMesh mesh = make_shape(shape);
        const Body one = make_body(mesh);
        for (double s : {1e-3, 0.1, 1e3}) {
            const Body scaled = make_body(moved(mesh, Eigen::Matrix3d::Identity(), s, Vector::Zero()));
            ASSERT_EQ(scaled.centre.kind, one.centre.kind) << shape;
            expect_close(scaled.K, one.K, s, 1e-9, "K");
            expect_close(scaled.m, one.m, 1, 1e-9, "m");
            expect_close(scaled.k, one.k, 1, 1e-9, "k");
            expect_close(scaled.L, one.L, s, 1e-9, "L");
        }
    }
}

TEST(Body, ScalesWithMaterial) {
    BodyRecipe recipe;
    const Body one = make_body("breast:vertices=400", recipe);
    recipe.young *= 3, recipe.mass *= 5, recipe.surface *= 7;
    const Body other = make_body("breast:vertices=400", recipe);
    expect_close(other.K, one.K, 3, 1e-12, "K");
    expect_close(other.m, one.m, 5, 1e-12, "m");
    expect_close(other.k, one.k, 7, 1e-12, "k");
    expect_close(other.c, one.c, std::sqrt(15.0), 1e-12, "c");
}

TEST(Body, RotationAndTranslationChangeNothing) {
    Random random(3);
    for (const char* shape : {"breast:vertices=400", "torus:vertices=400"}) {
        const SurfaceMesh mesh = make_shape(shape);
        const Body one = make_body(mesh),
                   other = make_body(moved(mesh, random_rotation(random), 1, Vector(3, -2, 1)));
        ASSERT_EQ(other.centre.kind, one.centre.kind);
        // A medial ball ends on one sample of the far side or another, found to 1e-4 of its radius.
        const double tolerance = one.centre.kind == CentreKind::local ? 2e-3 : 1e-10;
        expect_close(other.K, one.K, 1, tolerance, "K");
        expect_close(other.m, one.m, 1, tolerance, "m");
        expect_close(other.k, one.k, 1, 1e-10, "k");
    }
}

TEST(Body, SubdividingFlatTrianglesChangesNoSum) {
    // Law 8: a box meshed coarsely and finely is the same box.
    const Body coarse = make_body(box({2, 1, 1.5}, 0.5)), fine = make_body(box({2, 1, 1.5}, 0.25));
    EXPECT_NEAR(fine.volume, coarse.volume, 1e-12);
    EXPECT_NEAR(sum(fine.m), sum(coarse.m), 1e-13);
    EXPECT_NEAR(sum(triangle_areas(fine.rest.positions, fine.rest.triangles)),
                sum(triangle_areas(coarse.rest.positions, coarse.rest.triangles)), 1e-12);
}

TEST(Body, DensityAndSurfaceRatioAreResolved) {
    Material material;
    material.density = 1000;
    material.surface_ratio = 0.1;
    const Body body = build_body(
        moved(make_shape("icosphere:vertices=642"), Eigen::Matrix3d::Identity(), 0.05, Vector::Zero()),
        material);
    EXPECT_NEAR(sum(body.m), 1000 * body.volume, 1e-12);
    EXPECT_NEAR(body.material.surface, 0.1 * 10 * body.radius, 1e-12);
}

TEST(Body, TinyAndHugeUnitsAreRightOrRefused) {
    const SurfaceMesh mesh = make_shape("sphere:vertices=200");
    const Body one = make_body(mesh);
    int built = 0, refused = 0;
    for (int power = -160; power <= 160; power += 10) {
        const double s = std::pow(10.0, power);
        try {
            const Body body = make_body(moved(mesh, Eigen::Matrix3d::Identity(), s, Vector::Zero()));
            ++built;
            expect_close(body.K, one.K, s, 1e-6, "K");
            expect_close(body.m, one.m, 1, 1e-6, "m");
            expect_close(body.k, one.k, 1, 1e-6, "k");
        } catch (const InputError& error) {
            ++refused;
            EXPECT_GE(std::abs(power), 30) << error.what();
        }
    }
    EXPECT_GE(built, 5);
    EXPECT_GE(refused, 2);
}

TEST(Body, ExtremeMaterialsAreRightOrRefused) {
    BodyRecipe recipe;
    recipe.young = 1e-300, recipe.mass = 1e-300;
    EXPECT_NO_THROW(make_body("sphere:vertices=200", recipe));
    recipe.young = 1e-310;
    EXPECT_THROW(make_body("sphere:vertices=200", recipe), InputError)
        << "stiffness below the normal numbers";
    recipe = {};
    recipe.surface = 1e308;
    recipe.young = 1e308;
    try {
        const Body body = make_body("sphere:vertices=200", recipe);
        for (double k : body.k) ASSERT_TRUE(std::isfinite(k));
        for (double c : body.c) ASSERT_TRUE(std::isfinite(c));
    } catch (const InputError&) {
        SUCCEED();
    }
}

TEST(Body, UnusableMeshesAreRefused) {
    SurfaceMesh open = make_shape("icosphere:vertices=42");
    open.triangles.pop_back();
    EXPECT_THROW(make_body(open), InputError);
    SurfaceMesh inside_out = make_shape("icosphere:vertices=42");
    for (Triangle& t : inside_out.triangles) std::swap(t[0], t[1]);
    EXPECT_THROW(make_body(inside_out), InputError);
    SurfaceMesh unused = make_shape("icosphere:vertices=42");
    unused.positions.push_back({0, 0, 0.5});
    EXPECT_THROW(make_body(unused), InputError) << "a vertex without triangles would have no mass";
    EXPECT_THROW(make_body(SurfaceMesh{}), InputError);
}

TEST(Body, SchemeParsing) {
    EXPECT_EQ(parse_scheme("A"), Scheme::A);
    EXPECT_EQ(parse_scheme("b"), Scheme::B);
    for (Scheme scheme : {Scheme::A, Scheme::B, Scheme::C})
        EXPECT_EQ(parse_scheme(to_string(scheme)), scheme);
    for (const char* wrong : {"", "D", "AB", "scheme C"})
        EXPECT_THROW(parse_scheme(wrong), InputError) << wrong;
}

TEST(Body, RealMeshes) {
    const std::filesystem::path folder = SHARED_MESHES;
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no meshes at " << folder;
    for (const char* name : {"liver.obj", "liver2.obj", "Bunny.stl", "torus.obj", "spot.obj"}) {
        SurfaceMesh mesh = weld(read(folder / name)).mesh;
        if (volume(mesh) < 0)
            for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
        normalize(mesh);
        const Body body = make_body(mesh);
        for (std::size_t i = 0; i < body.vertices(); ++i) {
            ASSERT_GT(body.K[i], 0) << name;
            ASSERT_GT(body.m[i], 0) << name;
        }
        EXPECT_NEAR(sum(body.m), 0.05, 1e-12) << name;
        EXPECT_NEAR(body.volume, 4 * pi / 3, 1e-9) << name;
        EXPECT_FALSE(body.centre.reason.empty()) << name;
    }
    for (const char* broken : {"dragon.stl", "suzanne.obj"})
        EXPECT_THROW(make_body(weld(read(folder / broken)).mesh), InputError) << broken;
}

}  // namespace
}  // namespace innerspring
