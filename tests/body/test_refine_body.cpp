#include <gtest/gtest.h>

#include "innerspring/body/distribution.h"
#include "innerspring/body/refine.h"
#include "innerspring/mesh/error.h"
#include "support/body_checks.h"
#include "support/sanitized.h"

namespace innerspring {
namespace {

using namespace support;

void expect_same(const std::vector<double>& a, const std::vector<double>& b, double tolerance,
                 const char* what) {
    ASSERT_EQ(a.size(), b.size()) << what;
    for (std::size_t i = 0; i < a.size(); ++i)
        ASSERT_NEAR(a[i], b[i], tolerance * std::abs(b[i])) << what << i;
}

// Re-estimation in place is what build_body() makes of the refined surface.
TEST(RefinedBody, IsWhatTheRefinedMeshGives) {
    for (Scheme scheme : {Scheme::A, Scheme::B, Scheme::C})
        for (int levels : {1, 2}) {
            const Body body = make_sphere("sphere:vertices=300,irregularity=3", {.scheme = scheme});
            const auto region = triangles_near(body.rest, body.rest.positions[17], 0.4);
            const Body fine = refined(body, region, levels);
            expect_sound(fine);
            const Body anew =
                make_body(refine(body.rest, region, {levels}).mesh,
                          {.scheme = scheme, .centre = {CentreKind::given, body.centre.position}});
            EXPECT_EQ(fine.rest.positions, anew.rest.positions);
            EXPECT_EQ(fine.rest.triangles, anew.rest.triangles);
            expect_same(fine.L, anew.L, 0, "L");
            expect_same(fine.m, anew.m, 1e-13, "m");
            expect_same(fine.K, anew.K, 1e-13, "K");
            expect_same(fine.c, anew.c, 1e-13, "c");
            for (Index i = 0; i < fine.vertices(); ++i)
                for (std::size_t s = 0; s < fine.spokes_of(i).size(); ++s) {
                    ASSERT_EQ(fine.spokes_of(i)[s].neighbour, anew.spokes_of(i)[s].neighbour);
                    ASSERT_EQ(fine.spokes_of(i)[s].k, anew.spokes_of(i)[s].k);
                    ASSERT_EQ(fine.spokes_of(i)[s].rest, anew.spokes_of(i)[s].rest);
                }
        }
}

// Law 8 for the sums that the physics rests on, with every kind of centre.
TEST(RefinedBody, SumsStayAndAllIsPositive) {
    for (const char* shape : {"sphere:vertices=300", "organ:vertices=400", "torus:vertices=300"}) {
        const Body body = make_body(shape);
        const auto region = triangles_near(body.rest, body.rest.positions[3], 0.5);
        const Body fine = refined(body, region, 2);
        expect_sound(fine);
        EXPECT_EQ(fine.volume, body.volume);
        EXPECT_NEAR(volume(fine.rest), body.volume, 1e-12 * body.volume);
        double V = 0;  // a third of the sum of W_i
        for (const Triangle& t : fine.rest.triangles)
            V += virtual_tetrahedron(fine.centre, fine.rest.positions, fine.L, t);
        EXPECT_NEAR(V, body.volume, 1e-12 * body.volume);
        EXPECT_EQ(fine.centre.kind, body.centre.kind);
        EXPECT_GT(fine.vertices(), body.vertices() + 50);
    }
}

// The stiffness of a patch does not change when it is cut: K_i scales with its area. Eq. 3's L_i at the new
// vertices makes up for a little.
TEST(RefinedBody, StiffnessOfAPatchStays) {
    const Body body = make_sphere("icosphere:vertices=642");
    const Body fine = refined(body, triangles_near(body.rest, body.rest.positions[3], 0.5));
    EXPECT_NEAR(sum(fine.K), sum(body.K), 0.01 * sum(body.K));
    const Index vertex = 3;
    EXPECT_NEAR(fine.K[vertex], body.K[vertex] / 4, 0.01 * body.K[vertex]);
    EXPECT_NEAR(fine.m[vertex], body.m[vertex] / 4, 0.01 * body.m[vertex]);
}

TEST(RefinedBody, MeanStiffnessIsRecomputedOrKept) {
    const Body body = make_body("sphere:vertices=300", {.scheme = Scheme::A});
    const auto region = triangles_near(body.rest, body.rest.positions[3], 0.5);
    const Body total = refined(body, region, 1, MeanStiffness::recomputed),
               node = refined(body, region, 1, MeanStiffness::kept);
    EXPECT_NEAR(sum(total.K), sum(body.K), 0.01 * sum(body.K));  // the same column over more vertices
    for (double K : node.K) ASSERT_EQ(K, body.K[0]);
    EXPECT_NEAR(sum(node.m), body.material.mass, 1e-12);
    expect_sound(total);
}

// Refining in place many times, here and there, and taking it back gives the body back.
TEST(RefinedBody, InPlaceThereAndBack) {
    for (const char* shape : {"sphere:vertices=250,irregularity=3", "organ:vertices=250"})
        for (Scheme scheme : {Scheme::B, Scheme::C}) {
            if (INNERSPRING_SANITIZED && scheme == Scheme::B) continue;
            const Body before = make_body(shape, {.scheme = scheme});
            Body body = before;
            Subdivision history(body.rest);
            reserve(body, 400);
            Random random(7);
            for (int n = 0; n < 12; ++n) {
                const Vector place = body.rest.positions[random.below(body.vertices())];
                if (n % 4 < 3)
                    restructure(body, history,
                                history.split(body.rest, triangles_near(body.rest, place, 0.1), 1 + n % 2));
                else
                    restructure(
                        body, history,
                        history.unsplit(body.rest, [&](const Vector& a, const Vector&, const Vector&) {
                            return (a - place).norm() < 1;
                        }));
                expect_sound(body);
            }
            restructure(body, history,
                        history.unsplit(body.rest,
                                        [](const Vector&, const Vector&, const Vector&) { return false; }));
            expect_sound(body);
            EXPECT_EQ(body.rest.positions, before.rest.positions);
            expect_same(body.m, before.m, 1e-13, "m");
            expect_same(body.K, before.K, 1e-12, "K");
            expect_same(body.L, before.L, 0, "L");
            EXPECT_EQ(body.k.size(), before.k.size());
        }
}

// About one centre some tetrahedra may be negative though every vertex is positive: those must not be cut.
TEST(RefinedBody, NeverCutsANegativeTetrahedron) {
    // A vertex drawn over its neighbours: what lies under its overhang is seen from outside only.
    SurfaceMesh mesh = make_shape("icosphere:vertices=642");
    const Vector up = mesh.positions[100], side = up.cross(Vector(0.3, 0.5, 0.1)).normalized();
    mesh.positions[100] += 0.25 * side + 0.15 * up;
    const Body body = make_body(mesh, {.centre = origin()});
    std::vector<Index> negative;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& c = mesh.triangles[t];
        if (mesh.positions[c[0]].dot(mesh.positions[c[1]].cross(mesh.positions[c[2]])) < 0)
            negative.push_back(Index(t));
    }
    ASSERT_FALSE(negative.empty());
    EXPECT_THROW(refined(body, negative), InputError);
    EXPECT_NO_THROW(refined(body, triangles_near(mesh, -up, 0.2)));
}

}  // namespace
}  // namespace innerspring
