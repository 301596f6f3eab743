#include <gtest/gtest.h>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/random.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/signed_distance.h"
#include "support/bodies.h"

namespace innerspring {
namespace {

// The distance to a box is known: to its nearest face inside, to the clamped point outside.
TEST(SignedDistance, OfABoxIsExactInsideAndOutside) {
    const Vector half(0.5, 0.3, 0.2);
    const DistanceField field = build_distance_field(support::box(2 * half, 0.2));
    Random random(1);
    for (int n = 0; n < 2000; ++n) {
        const Vector p = support::random_vector(random);
        const Vector over = p.cwiseAbs() - half;
        const double exact = over.maxCoeff() < 0 ? over.maxCoeff() : over.cwiseMax(0).norm();
        const Nearest found = nearest(field, p);
        EXPECT_NEAR(found.distance, exact, 1e-12);
        EXPECT_NEAR(found.normal.norm(), 1, 1e-12);
        // Along the normal the distance shrinks to 0.
        EXPECT_NEAR(nearest(field, p - found.distance * found.normal).distance, 0, 1e-12);
        EXPECT_EQ(nearest(field, p, std::abs(exact) * 0.99).distance, INFINITY);
        EXPECT_NEAR(nearest(field, p, std::abs(exact) * 1.01).distance, exact, 1e-12);
    }
}

// Against every triangle by turns.
TEST(SignedDistance, OfAnUnevenSurfaceIsThatToTheNearestTriangle) {
    const SurfaceMesh mesh = make_shape("torus:vertices=500");
    const DistanceField field = build_distance_field(mesh);
    Random random(2);
    for (int n = 0; n < 300; ++n) {
        const Vector p = support::random_vector(random);
        double least = INFINITY;
        for (const Triangle& t : mesh.triangles)
            least = std::min(least, (nearest_on_triangle(p, mesh.positions[t[0]], mesh.positions[t[1]],
                                                         mesh.positions[t[2]])
                                         .point -
                                     p)
                                        .norm());
        EXPECT_NEAR(std::abs(nearest(field, p).distance), least, 1e-12);
    }
}

TEST(SignedDistance, NeedsAClosedSurface) {
    SurfaceMesh open = make_shape("icosphere:vertices=42");
    open.triangles.pop_back();
    EXPECT_THROW(build_distance_field(open), InputError);
}

}  // namespace
}  // namespace innerspring
