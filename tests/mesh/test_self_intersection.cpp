#include "innerspring/mesh/self_intersection.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "innerspring/mesh/triangle_intersection.h"
#include "small_meshes.h"

namespace innerspring {
namespace {

using namespace innerspring::testing;

// --- A second opinion in whole numbers: separating axes and cones, none of which the library uses. ---

__extension__ using Wide = __int128;

struct Whole {
    Wide x, y, z;
};

Whole whole(const Vector& p) {
    return {Wide(p[0]), Wide(p[1]), Wide(p[2])};
}
Whole operator-(const Whole& a, const Whole& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
Wide dot(const Whole& a, const Whole& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
Whole cross(const Whole& a, const Whole& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
bool zero(const Whole& a) {
    return a.x == 0 && a.y == 0 && a.z == 0;
}
int sign(Wide v) {
    return (v > 0) - (v < 0);
}

using Corners = std::array<Whole, 3>;

/// Two convex polygons are disjoint if and only if one of these axes separates them strictly.
bool meet_by_separating_axes(const Corners& a, const Corners& b) {
    std::vector<Whole> axes;
    const Whole na = cross(a[1] - a[0], a[2] - a[0]), nb = cross(b[1] - b[0], b[2] - b[0]);
    axes.insert(axes.end(), {na, nb});
    for (int i = 0; i < 3; ++i) {
        axes.push_back(cross(na, a[(i + 1) % 3] - a[i]));
        axes.push_back(cross(nb, b[(i + 1) % 3] - b[i]));
        for (int j = 0; j < 3; ++j) axes.push_back(cross(a[(i + 1) % 3] - a[i], b[(j + 1) % 3] - b[j]));
    }
    for (const Whole& axis : axes) {
        const auto [a_low, a_high] = std::minmax({dot(axis, a[0]), dot(axis, a[1]), dot(axis, a[2])});
        const auto [b_low, b_high] = std::minmax({dot(axis, b[0]), dot(axis, b[1]), dot(axis, b[2])});
        if (a_high < b_low || b_high < a_low) return false;
    }
    return true;
}

bool in_cone(const Whole& r, const Whole& p, const Whole& q) {
    const Whole n = cross(p, q);
    return !zero(r) && dot(n, r) == 0 && dot(cross(p, r), n) >= 0 && dot(cross(r, q), n) >= 0;
}

/// Triangles v, p, q and v, r, s meet elsewhere than in v if their cones at v have a ray in common.
bool meet_beside_vertex(const Whole& v, Whole p, Whole q, Whole r, Whole s) {
    p = p - v, q = q - v, r = r - v, s = s - v;
    const Whole line = cross(cross(p, q), cross(r, s)), back{-line.x, -line.y, -line.z};
    return in_cone(p, r, s) || in_cone(q, r, s) || in_cone(r, p, q) || in_cone(s, p, q) ||
           (in_cone(line, p, q) && in_cone(line, r, s)) || (in_cone(back, p, q) && in_cone(back, r, s));
}

bool folded(const Whole& u, const Whole& v, const Whole& a, const Whole& b) {
    const Whole p = cross(v - u, a - u), q = cross(v - u, b - u);
    return zero(cross(p, q)) && dot(p, q) > 0;
}

bool second_opinion(const std::vector<Vector>& x, const Triangle& s, const Triangle& t) {
    std::vector<Index> both, only_s, only_t;
    for (Index v : s) (std::ranges::count(t, v) ? both : only_s).push_back(v);
    for (Index v : t)
        if (!std::ranges::count(s, v)) only_t.push_back(v);
    const auto p = [&](Index v) { return whole(x[v]); };
    switch (both.size()) {
        case 3:
            return true;
        case 2:
            return folded(p(both[0]), p(both[1]), p(only_s[0]), p(only_t[0]));
        case 1:
            return meet_beside_vertex(p(both[0]), p(only_s[0]), p(only_s[1]), p(only_t[0]), p(only_t[1]));
        default:
            return meet_by_separating_axes({p(s[0]), p(s[1]), p(s[2])}, {p(t[0]), p(t[1]), p(t[2])});
    }
}

bool has_area(const std::vector<Vector>& x, const Triangle& t) {
    return !zero(cross(whole(x[t[1]]) - whole(x[t[0]]), whole(x[t[2]]) - whole(x[t[0]])));
}

TEST(TriangleIntersection, AgreesWithASecondOpinionInWholeNumbers) {
    Dice dice(11);
    std::array<int, 4> compared{}, crossing{};
    for (int n = 0; n < 400000; ++n) {
        const std::int64_t size = 2 + dice(12), depth = 1 + dice(size);  // depth 1: all in a plane
        std::vector<Vector> x;
        for (int i = 0; i < 6; ++i)
            x.emplace_back(double(dice(size)), double(dice(size)), double(dice(depth)));
        if (depth == 1 && dice(2))
            for (Vector& p : x) p = {p[0] + 2 * p[1], p[1] - p[0], 3 * p[0] + p[1]};
        const int shared = int(dice(4));
        Triangle s{0, 1, 2}, t{3, 4, 5};
        for (int i = 0; i < shared; ++i) t[i] = s[i];
        std::shuffle(s.begin(), s.end(), dice.engine);
        std::shuffle(t.begin(), t.end(), dice.engine);
        if (!has_area(x, s) || !has_area(x, t)) continue;
        const bool expected = second_opinion(x, s, t);
        ASSERT_EQ(triangles_cross(x, s, t), expected) << "case " << n << ", " << shared << " vertices shared";
        ASSERT_EQ(triangles_cross(x, t, s), expected) << "case " << n << " the other way round";
        ++compared[shared];
        crossing[shared] += expected;
    }
    for (int shared = 0; shared < 4; ++shared) {
        EXPECT_GT(crossing[shared], 1000);
        if (shared < 3) {
            EXPECT_GT(compared[shared] - crossing[shared], 1000);
        }
    }
}

TEST(TriangleIntersection, PlacesAndOrderDoNotMatter) {
    Dice dice(12);
    for (int n = 0; n < 20000; ++n) {
        std::vector<Vector> x, shifted;
        for (int i = 0; i < 6; ++i) x.emplace_back(double(dice(5)), double(dice(5)), double(dice(5)));
        for (const Vector& p : x) shifted.emplace_back(p * 0x1p-20 + Vector(1e6, -3e5, 0x1p20));  // exact
        const int shared = int(dice(3));
        Triangle s{0, 1, 2}, t{shared > 0 ? 0u : 3u, shared > 1 ? 1u : 4u, 5};
        const bool expected = triangles_cross(x, s, t);
        EXPECT_EQ(triangles_cross(shifted, s, t), expected);
        std::shuffle(s.begin(), s.end(), dice.engine);
        std::shuffle(t.begin(), t.end(), dice.engine);
        EXPECT_EQ(triangles_cross(x, s, t), expected);
        EXPECT_EQ(triangles_cross(shifted, t, s), expected);
    }
}

TEST(TriangleIntersection, OrientationIsExactNextToThePlane) {
    Dice dice(13);
    int on_the_plane = 0;
    for (int n = 0; n < 100000; ++n) {
        const std::int64_t size = std::int64_t(1) << (4 + dice(24));
        const auto point = [&] { return Vector(double(dice(size)), double(dice(size)), double(dice(size))); };
        const Vector a = point(), b = point(), c = point();
        const double i = double(dice(5)) - 2, j = double(dice(5)) - 2;
        const Vector nudge(double(dice(3)) - 1, double(dice(3)) - 1, double(dice(3)) - 1);
        const Vector d = a + i * (b - a) + j * (c - a) + (dice(2) ? nudge : Vector::Zero());
        const Whole o = whole(a);
        const int expected = sign(dot(cross(whole(b) - o, whole(c) - o), whole(d) - o));
        ASSERT_EQ(orientation(a, b, c, d), expected) << "case " << n;
        ASSERT_EQ(orientation(b, a, c, d), -expected);
        ASSERT_EQ(orientation(d, b, c, a), -expected);
        on_the_plane += expected == 0;
        const Whole flat = cross(whole(b) - o, whole(d) - o);
        ASSERT_EQ(orientation_along(0, a, b, d), sign(flat.x));
        ASSERT_EQ(orientation_along(1, a, b, d), sign(flat.y));
        ASSERT_EQ(orientation_along(2, a, b, d), sign(flat.z));
    }
    EXPECT_GT(on_the_plane, 10000);
}

TEST(TriangleIntersection, OrientationIsExactWhereDifferencesRound) {
    Dice dice(14);
    for (int n = 0; n < 50000; ++n) {
        // b = a + 2^57 e_x + small: b - a does not fit in a double.
        const auto small = [&] { return double(dice(2001) - 1000); };
        const Vector a(small(), small(), small()), c(small(), small(), small()), d(small(), small(), small());
        const Vector b((dice(2) ? 0x1p57 : -0x1p57), small(), small());
        const Vector near(d[0], a[1] + (c[1] - a[1]), a[2] + (c[2] - a[2]));  // in the plane but for rounding
        for (const Vector& p : {d, near}) {
            const Whole o = whole(a);
            ASSERT_EQ(orientation(a, b, c, p), sign(dot(cross(whole(b) - o, whole(c) - o), whole(p) - o)));
            ASSERT_EQ(orientation_along(2, a, b, p), sign(cross(whole(b) - o, whole(p) - o).z));
        }
    }
}

TEST(TriangleIntersection, KnownCases) {
    const std::vector<Vector> x{{0, 0, 0},      {2, 0, 0},     {0, 2, 0},      // in the plane z = 0
                                {0.5, 0.5, -1}, {0.5, 0.5, 1}, {3, 3, 1},      // pierces it
                                {0.2, 0.2, 0},  {0.4, 0.2, 0}, {0.2, 0.4, 0},  // inside it
                                {2, 0, 5},      {4, 0, 5},  // with vertex 1: touches there only
                                {0, 0, 1e-30},  {2, 0, 1e-30}, {0, 2, 1e-30}};
    EXPECT_TRUE(triangles_cross(x, {0, 1, 2}, {3, 4, 5}));
    EXPECT_TRUE(triangles_cross(x, {0, 1, 2}, {6, 7, 8}));
    EXPECT_TRUE(triangles_cross(x, {0, 1, 2}, {0, 7, 8}))
        << "coplanar, sharing a vertex, one within the other";
    EXPECT_FALSE(triangles_cross(x, {0, 1, 2}, {1, 9, 10}));
    EXPECT_TRUE(triangles_cross(x, {0, 1, 2}, {0, 1, 8})) << "folded";
    EXPECT_FALSE(triangles_cross(x, {0, 1, 2}, {0, 1, 4})) << "a sharp edge";
    EXPECT_TRUE(triangles_cross(x, {0, 1, 2}, {2, 1, 0}));
    EXPECT_FALSE(triangles_cross(x, {0, 1, 2}, {11, 12, 13}));
    EXPECT_TRUE(segment_meets_triangle(x[3], x[4], x[0], x[1], x[2]));
    EXPECT_FALSE(segment_meets_triangle(x[4], x[5], x[0], x[1], x[2]));
}

TEST(SelfIntersections, AgreeWithLookingAtAllPairs) {
    for (unsigned seed = 1; seed <= 40; ++seed) {
        Dice dice(seed);
        SurfaceMesh m{"soup", {}, {}};
        const int vertices = 10 + int(dice(200)), triangles = 1 + int(dice(300));
        for (int i = 0; i < vertices; ++i)
            m.positions.emplace_back(dice.unit(), dice.unit(), seed % 4 ? dice.unit() : 0.5);
        while (int(m.triangles.size()) < triangles) {
            Triangle t;
            for (Index& v : t) v = Index(dice(vertices));
            m.triangles.push_back(t);
            if (seed % 3 == 0)  // small ones as well
                for (Index v : t) m.positions[v] = 0.7 * m.positions[v] + 0.3 * m.positions[t[0]];
        }
        std::vector<std::pair<Index, Index>> expected;
        for (Index a = 0; a < m.triangles.size(); ++a)
            for (Index b = a + 1; b < m.triangles.size(); ++b)
                if (triangles_cross(m.positions, m.triangles[a], m.triangles[b])) expected.emplace_back(a, b);
        EXPECT_EQ(self_intersections(m), expected) << "seed " << seed;
    }
}

TEST(SelfIntersections, NoneOnGoodSurfaces) {
    for (SurfaceMesh m : {tetrahedron(), cube(), ball(4), torus(40, 20)}) {
        EXPECT_TRUE(self_intersections(m).empty()) << m.name;
        for (Vector& p : m.positions) p = some_rotation() * p + Vector(10, 20, 30);
        EXPECT_TRUE(self_intersections(m).empty()) << m.name << ", rotated";
    }
}

TEST(SelfIntersections, NoneOnARotatedFlatSheet) {
    SurfaceMesh m{"sheet", {}, {}};
    const Index n = 60;
    for (Index i = 0; i < n; ++i)
        for (Index j = 0; j < n; ++j) m.positions.push_back(some_rotation() * Vector(0.1 * i, 0.1 * j, 7));
    for (Index i = 0; i + 1 < n; ++i)
        for (Index j = 0; j + 1 < n; ++j) {
            const Index a = i * n + j;
            m.triangles.insert(m.triangles.end(), {{a, a + n, a + n + 1}, {a, a + n + 1, a + 1}});
        }
    EXPECT_TRUE(self_intersections(m).empty());
}

TEST(SelfIntersections, CrossingTetrahedra) {
    const auto pairs = self_intersections(together(tetrahedron(), moved(tetrahedron(), {0.2, 0.2, -0.3})));
    ASSERT_FALSE(pairs.empty());
    for (const auto& [a, b] : pairs) {
        EXPECT_LT(a, 4u);
        EXPECT_GE(b, 4u);
    }
    EXPECT_TRUE(std::ranges::is_sorted(pairs));
}

TEST(SelfIntersections, Limits) {
    SurfaceMesh m{
        "pile", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, std::vector<Triangle>(100000, Triangle{0, 1, 2})};
    EXPECT_EQ(self_intersections(m, 1000).size(), 1000u);
    EXPECT_FALSE(search_self_intersections(m, 10).complete);
    m.triangles.resize(5);
    EXPECT_EQ(self_intersections(m, 10).size(), 10u);
    EXPECT_TRUE(search_self_intersections(m, 10).complete);
    EXPECT_FALSE(search_self_intersections(m, 10, 3).complete);
    m.positions[0][0] = std::nan("");
    EXPECT_TRUE(self_intersections(m).empty());
    EXPECT_TRUE(self_intersections(SurfaceMesh{}).empty());
}

}  // namespace
}  // namespace innerspring
