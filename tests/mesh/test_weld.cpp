#include "innerspring/mesh/weld.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "innerspring/mesh/error.h"

namespace innerspring {
namespace {

/// Vertices along x, each used by a triangle of its own.
SurfaceMesh points(const std::vector<double>& xs) {
    SurfaceMesh mesh;
    mesh.name = "points";
    for (const double x : xs) {
        const Index v = Index(mesh.positions.size());
        mesh.positions.emplace_back(x, 0, 0);
        mesh.triangles.push_back({v, v, v});
    }
    return mesh;
}

/// The definition, in quadratic time: the earliest kept vertex no farther than the tolerance.
std::vector<Index> joined_by_definition(const SurfaceMesh& mesh, double tolerance) {
    std::vector<Index> kept, joined;
    for (Index v = 0; v < mesh.positions.size(); ++v) {
        Index k = 0;
        auto far = [&] {
            const Vector d = mesh.positions[v] - mesh.positions[kept[k]];
            return std::hypot(d[0], d[1], d[2]) > tolerance;
        };
        while (k < kept.size() && far()) ++k;
        if (k == kept.size()) kept.push_back(v);
        joined.push_back(k);
    }
    return joined;
}

TEST(Weld, EqualPositionsBecomeOneInOrderOfAppearance) {
    const Welded w = weld(points({3, 1, 3, 2, 1, 3}));
    EXPECT_EQ(w.mesh.name, "points");
    EXPECT_EQ(w.mesh.positions, (std::vector<Vector>{{3, 0, 0}, {1, 0, 0}, {2, 0, 0}}));
    EXPECT_EQ(w.new_from_old, (std::vector<Index>{0, 1, 0, 2, 1, 0}));
    EXPECT_EQ(w.mesh.triangles.size(), 6u);
    EXPECT_EQ(w.mesh.triangles[3], (Triangle{2, 2, 2}));
    EXPECT_EQ(w.merged, 3u);
    EXPECT_EQ(w.unused, 0u);
}

TEST(Weld, ZeroHasNoSign) {
    EXPECT_EQ(weld(points({0.0, -0.0})).mesh.positions.size(), 1u);
}

TEST(Weld, NeighbouringDoublesStayApart) {
    EXPECT_EQ(weld(points({1.0, std::nextafter(1.0, 2.0), 5e-324, 0.0, -5e-324})).merged, 0u);
}

TEST(Weld, UnusedVerticesAreDropped) {
    SurfaceMesh mesh = points({0, 1, 2, 3, 1});
    mesh.triangles = {{0, 3, 4}};
    const Welded w = weld(mesh);  // vertex 1 is used through its double, vertex 4
    EXPECT_EQ(w.mesh.positions, (std::vector<Vector>{{0, 0, 0}, {1, 0, 0}, {3, 0, 0}}));
    EXPECT_EQ(w.new_from_old, (std::vector<Index>{0, 1, no_index, 2, 1}));
    EXPECT_EQ(w.mesh.triangles, (std::vector<Triangle>{{0, 2, 1}}));
    EXPECT_EQ(w.merged, 1u);
    EXPECT_EQ(w.unused, 1u);
}

TEST(Weld, TheEarliestWithinTheToleranceWins) {
    // The third is nearer to the second, yet joins the first; the fourth is near the third only, which is not
    // kept.
    const Welded w = weld(points({0, 1.5, 1, 2.75}), {.tolerance = 1});
    EXPECT_EQ(w.new_from_old, (std::vector<Index>{0, 1, 0, 2}));
    EXPECT_EQ(weld(points({0, 1}), {.tolerance = 1}).merged, 1u)
        << "a distance equal to the tolerance is near";
}

TEST(Weld, ToleranceAgreesWithTheDefinition) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> in(-1, 1);
    for (const double tolerance : {0.0, 1e-3, 0.05, 0.1, 0.25, 1.0, 10.0}) {
        SurfaceMesh mesh;
        for (Index v = 0; v < 1000; ++v) {
            Vector p(in(random), in(random), in(random));
            if (v % 3 == 1) p = mesh.positions[v - 1] + Vector(tolerance, 0, 0);
            if (v % 7 == 1) p = p.array().round();
            mesh.positions.push_back(p);
            mesh.triangles.push_back({v, v, v});
        }
        EXPECT_EQ(weld(mesh, {.tolerance = tolerance}).new_from_old, joined_by_definition(mesh, tolerance))
            << tolerance;
    }
}

TEST(Weld, AnyRatioOfCoordinateToTolerance) {
    std::vector<double> xs = {0,
                              5e-324,
                              1e-300,
                              1,
                              std::nextafter(1.0, 2.0),
                              1e30,
                              std::nextafter(1e30, 0),
                              -1e30,
                              -1,
                              -5e-324,
                              4503599627370496,
                              4503599627370496.5};
    for (double x = 1e15; x < 1e17; x *= 1.7)
        for (int n = 0; n < 8; ++n) xs.push_back(n == 0 ? x : std::nextafter(xs.back(), 1e30));
    const SurfaceMesh mesh = points(xs);
    for (const double tolerance : {5e-324, 1e-308, 1e-16, 1e-3, 0.5, 1.0, 2.0, 8.0, 1e14, 1e30, 1e300,
                                   std::numeric_limits<double>::max()})
        EXPECT_EQ(weld(mesh, {.tolerance = tolerance}).new_from_old, joined_by_definition(mesh, tolerance))
            << tolerance;
}

TEST(Weld, ManyVerticesInOnePlace) {
    const SurfaceMesh mesh = points(std::vector<double>(100000, 0.5));
    EXPECT_EQ(weld(mesh).merged, 99999u);
    EXPECT_EQ(weld(mesh, {.tolerance = 0.1}).merged, 99999u);
}

TEST(Weld, EmptyMesh) {
    EXPECT_TRUE(weld({}).mesh.positions.empty());
}

TEST(Weld, RefusesTolerancesThatAreNoLength) {
    for (const double tolerance : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()})
        EXPECT_THROW(weld(points({0}), {.tolerance = tolerance}), InputError);
}

}  // namespace
}  // namespace innerspring
