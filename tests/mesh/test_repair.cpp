#include "innerspring/mesh/repair.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "innerspring/mesh/check.h"
#include "innerspring/mesh/geometry.h"
#include "small_meshes.h"

namespace innerspring {
namespace {

using namespace innerspring::testing;

using Actions = std::vector<std::string>;

/// Every vertex that is left stands where it stood, and the map says so.
void expect_map_holds(const SurfaceMesh& before, const Repaired& after, double tolerance = 0) {
    ASSERT_EQ(after.new_from_old.size(), before.positions.size());
    std::vector<bool> reached(after.mesh.positions.size(), false);
    for (std::size_t v = 0; v < before.positions.size(); ++v) {
        const Index n = after.new_from_old[v];
        if (n == no_index) continue;
        ASSERT_LT(n, after.mesh.positions.size());
        EXPECT_LE((after.mesh.positions[n] - before.positions[v]).norm(), tolerance);
        reached[n] = true;
    }
    EXPECT_TRUE(std::ranges::all_of(reached, [](bool b) { return b; }));
}

TEST(Repair, LeavesGoodMeshesAlone) {
    for (const SurfaceMesh& m : {tetrahedron(), cube(), ball(2), torus(9, 7)}) {
        const Repaired r = repair(m);
        EXPECT_TRUE(r.actions.empty()) << m.name << ": " << r.actions[0];
        EXPECT_EQ(r.mesh.triangles, m.triangles);
        EXPECT_EQ(r.mesh.positions, m.positions);
        EXPECT_EQ(r.mesh.name, m.name);
        expect_map_holds(m, r);
    }
}

TEST(Repair, MergesASoupOfTriangles) {
    SurfaceMesh m{"soup", {}, {}};
    for (const Triangle& t : cube().triangles) {
        for (Index v : t) m.positions.push_back(cube().positions[v]);
        const Index n = Index(m.positions.size());
        m.triangles.push_back({n - 3, n - 2, n - 1});
    }
    m.positions.push_back({9, 9, 9});
    const Repaired r = repair(m);
    EXPECT_EQ(r.actions,
              (Actions{"merged 28 vertices into others at their places", "dropped 1 unused vertex"}));
    EXPECT_EQ(check(r.mesh).verdict, Verdict::fine);
    EXPECT_EQ(r.new_from_old.back(), no_index);
    expect_map_holds(m, r);
}

TEST(Repair, MergesWithATolerance) {
    SurfaceMesh m = cube();
    m.positions.push_back(m.positions[7] + Vector(1e-7, 0, 0));
    m.triangles[2] = {4, 5, 8};
    EXPECT_EQ(check(repair(m).mesh).verdict, Verdict::unusable);
    const Repaired r = repair(m, {.tolerance = 1e-6});
    EXPECT_EQ(check(r.mesh).verdict, Verdict::fine);
    EXPECT_EQ(r.new_from_old[8], r.new_from_old[7]);
    expect_map_holds(m, r, 1e-6);
}

TEST(Repair, TurnsTrianglesAndPieces) {
    SurfaceMesh m = reversed(cube());
    std::swap(m.triangles[5][1], m.triangles[5][2]);
    std::swap(m.triangles[8][1], m.triangles[8][2]);
    const Repaired r = repair(m);
    EXPECT_EQ(r.actions, (Actions{"turned 2 triangles round to face as their neighbours do",
                                  "turned 1 piece right side out (12 triangles)"}));
    EXPECT_DOUBLE_EQ(volume(r.mesh), 1);
    EXPECT_EQ(check(r.mesh).verdict, Verdict::fine);
}

TEST(Repair, LeavesCavitiesAlone) {
    const SurfaceMesh m = together(cube(), moved(reversed(cube()), {0.25, 0.25, 0.25}, 0.5));
    EXPECT_TRUE(repair(m).actions.empty());
    const SurfaceMesh apart = together(cube(), moved(reversed(cube()), {2, 0, 0}, 0.5));
    EXPECT_EQ(repair(apart).actions, Actions{"turned 1 piece right side out (12 triangles)"});
    EXPECT_DOUBLE_EQ(volume(repair(apart).mesh), 1.125);
}

TEST(Repair, DropsWhatEnclosesNothing) {
    SurfaceMesh m = tetrahedron();
    m.positions.push_back({1, 1, 1});
    m.triangles.insert(m.triangles.end(), {{1, 2, 4}, {2, 1, 4}, {0, 0, 3}, {1, 2, 3}, {2, 3, 1}});
    const Repaired r = repair(m);
    EXPECT_EQ(r.actions, (Actions{"dropped 1 triangle without area", "dropped 2 duplicate triangles",
                                  "dropped 2 triangles folded onto one another", "dropped 1 unused vertex"}));
    EXPECT_EQ(r.mesh.triangles, tetrahedron().triangles);
    EXPECT_EQ(r.new_from_old[4], no_index);
    expect_map_holds(m, r);
}

TEST(Repair, UnitesTwoCubesAlongTheirCommonWall) {
    SurfaceMesh m = together(cube(), moved(cube(), {1, 0, 0}));
    // The wall x = 1 is cut along the other diagonal in the second cube: turn it so that the walls match.
    const Index o = 8;
    m.triangles[12 + 8] = {o + 0, o + 4, o + 6};
    m.triangles[12 + 9] = {o + 0, o + 6, o + 2};
    m.triangles[10] = {1, 3, 7};
    m.triangles[11] = {1, 7, 5};
    const Repaired r = repair(m);
    EXPECT_EQ(r.actions, (Actions{"merged 4 vertices into others at their places",
                                  "dropped 4 triangles folded onto one another"}));
    EXPECT_EQ(check(r.mesh).verdict, Verdict::fine);
    EXPECT_DOUBLE_EQ(volume(r.mesh), 2);
}

TEST(Repair, KeepsOneOfASurfaceAndItsReverse) {
    SurfaceMesh m = torus(8, 6);
    const SurfaceMesh back = reversed(m);
    m.triangles.insert(m.triangles.end(), back.triangles.begin(), back.triangles.end());
    const Repaired r = repair(m);
    EXPECT_EQ(r.actions, Actions{"dropped 96 duplicate triangles"});
    EXPECT_EQ(r.mesh.triangles, torus(8, 6).triangles);
}

TEST(Repair, NeverClosesAHole) {
    SurfaceMesh m = cube();
    m.triangles.pop_back();
    EXPECT_TRUE(repair(m).actions.empty());
    // A triangle without area that keeps the surface closed stays.
    m = cube();
    m.positions.push_back({0.5, 0.5, 0});
    m.triangles[0] = {0, 2, 8};
    m.triangles.insert(m.triangles.end(), {{8, 2, 3}, {0, 8, 3}});
    EXPECT_TRUE(repair(m).actions.empty());
}

TEST(Repair, AfterwardsDamagedShapesAreFine) {
    for (unsigned seed = 1; seed <= 60; ++seed) {
        Dice dice(seed);
        const SurfaceMesh good = seed % 3 == 0   ? torus(9, 7)
                                 : seed % 3 == 1 ? ball(2)
                                                 : together(ball(1), moved(torus(8, 6), {9, 0, 0}));
        SurfaceMesh m = good;
        for (Triangle& t : m.triangles)
            if (dice(2)) std::swap(t[1], t[2]);
        const std::size_t n = m.triangles.size();
        for (std::size_t t = 0; t < n; ++t)
            if (dice(3) == 0)
                m.triangles.push_back({m.triangles[t][1], m.triangles[t][2], m.triangles[t][0]});
        for (int i = int(dice(10)); i > 0; --i) {
            const Index v = Index(dice(std::int64_t(m.positions.size())));
            m.triangles.push_back({v, Index(dice(std::int64_t(m.positions.size()))), v});
        }
        std::shuffle(m.triangles.begin(), m.triangles.end(), dice.engine);
        for (Triangle& t : m.triangles)  // cut some vertices loose
            if (dice(4) == 0) {
                m.positions.push_back(m.positions[t[0]]);
                t[0] = Index(m.positions.size() - 1);
            }
        const Repaired r = repair(m);
        EXPECT_FALSE(r.actions.empty());
        EXPECT_NO_THROW(require_usable(r.mesh)) << "seed " << seed;
        EXPECT_EQ(r.mesh.positions.size(), good.positions.size());
        EXPECT_EQ(r.mesh.triangles.size(), good.triangles.size());
        EXPECT_NEAR(volume(r.mesh), volume(good), 1e-12 * volume(good));
        EXPECT_TRUE(repair(r.mesh).actions.empty()) << "seed " << seed;
        expect_map_holds(m, r);
    }
}

TEST(Repair, TwiceIsOnceForAnySoup) {
    for (unsigned seed = 1; seed <= 2000; ++seed) {
        Dice dice(seed);
        SurfaceMesh m{"soup", {}, {}};
        const std::int64_t vertices = 1 + dice(10), triangles = dice(30);
        for (int i = 0; i < vertices; ++i)
            m.positions.emplace_back(double(dice(4)), double(dice(4)), double(dice(3)));
        for (int i = 0; i < triangles; ++i)
            m.triangles.push_back({Index(dice(vertices)), Index(dice(vertices)), Index(dice(vertices))});
        const Repaired r = repair(m);
        expect_map_holds(m, r);
        const Repaired again = repair(r.mesh);
        EXPECT_TRUE(again.actions.empty()) << "seed " << seed << ": " << again.actions[0];
    }
}

}  // namespace
}  // namespace innerspring
