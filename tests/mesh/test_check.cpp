#include "innerspring/mesh/check.h"

#include <gtest/gtest.h>

#include "check_helpers.h"
#include "innerspring/mesh/weld.h"
#include "small_meshes.h"

namespace innerspring {
namespace {

using namespace innerspring::testing;

TEST(Check, GoodSolidsAreFine) {
    for (const SurfaceMesh& m : {tetrahedron(), cube(), ball(3)}) {
        const CheckReport report = checked(m);
        EXPECT_EQ(report.verdict, Verdict::fine) << m.name;
        EXPECT_EQ(report.genus, 0);
        EXPECT_EQ(report.components, 1u);
        EXPECT_EQ(2 * report.edges, 3 * report.triangles);
        EXPECT_EQ(refusal(m), "");
    }
}

TEST(Check, MeasuresACube) {
    const CheckReport report = checked(moved(cube(), {1, 2, 3}, 2));
    EXPECT_DOUBLE_EQ(report.volume_m3, 8);
    EXPECT_DOUBLE_EQ(report.area_m2, 24);
    EXPECT_EQ(report.lower, Vector(1, 2, 3));
    EXPECT_EQ(report.upper, Vector(3, 4, 5));
    EXPECT_LT((report.centroid - Vector(2, 3, 4)).norm(), 1e-14);
    EXPECT_EQ(report.edges, 18u);
    EXPECT_DOUBLE_EQ(report.edge_min_m, 2);
    EXPECT_DOUBLE_EQ(report.edge_max_m, std::sqrt(8.0));
    EXPECT_NEAR(report.edge_mean_m, (12 * 2 + 6 * std::sqrt(8.0)) / 18, 1e-14);
}

TEST(Check, OpenSurface) {
    SurfaceMesh m = cube();
    m.triangles.erase(m.triangles.begin());  // 0-2-3
    const CheckReport report = checked(m);
    EXPECT_EQ(faults(report), Keys{"closed"});
    const Finding& f = finding(report, "closed");
    EXPECT_EQ(f.verdict, Verdict::unusable);
    EXPECT_EQ(f.count, 3u);
    EXPECT_EQ(f.first, "edge 0-2 of triangle 8, used by 1 triangle");
    EXPECT_FALSE(report.genus);
    EXPECT_EQ(f.advice.find("--weld"), std::string::npos);
    expect_mentions(
        refusal(m),
        "cube: the surface is not closed (3 open edges); edge 0-2 of triangle 8, used by 1 triangle; close");
}

TEST(Check, SeamsThatNearlyCloseAreToldToWeld) {
    SurfaceMesh m = cube();
    m.positions.push_back(m.positions[7] + Vector(1e-7, 0, 0));
    m.triangles[2] = {4, 5, 8};
    expect_mentions(finding(checked(m), "closed").advice, "--weld 2e-06");
}

TEST(Check, EdgeWithThreeTriangles) {
    SurfaceMesh m = tetrahedron();
    m.positions.push_back({1, 1, 1});
    m.triangles.push_back({1, 2, 4});
    const CheckReport report = checked(m);
    EXPECT_EQ(faults(report), (Keys{"closed", "manifold_edges"}));
    const Finding& f = finding(report, "manifold_edges");
    EXPECT_EQ(f.count, 1u);
    EXPECT_EQ(f.verdict, Verdict::unusable);
    EXPECT_EQ(f.first, "edge 1-2 of triangle 0, used by 3 triangles");
}

TEST(Check, BowTieVertex) {
    SurfaceMesh m = together(tetrahedron(), reversed(moved(tetrahedron(), {0, 0, 0}, -1)));
    for (Triangle& t : m.triangles)
        for (Index& v : t) v = v == 4 ? 0 : v;
    m = weld(m).mesh;
    const CheckReport report = checked(m);
    EXPECT_EQ(faults(report), (Keys{"manifold_vertices", "components", "star_shaped"}));
    const Finding& f = finding(report, "manifold_vertices");
    EXPECT_EQ(f.count, 1u);
    EXPECT_EQ(f.verdict, Verdict::unusable);
    expect_mentions(f.first, "vertex 0 at (0, 0, 0)");
    EXPECT_EQ(report.components, 2u);
    EXPECT_FALSE(report.genus);
    expect_mentions(refusal(m), "1 vertex joins parts");
}

TEST(Check, FlippedTriangle) {
    SurfaceMesh m = cube();
    std::swap(m.triangles[5][1], m.triangles[5][2]);
    const CheckReport report = checked(m);
    EXPECT_EQ(faults(report), Keys{"oriented"});
    const Finding& f = finding(report, "oriented");
    EXPECT_EQ(f.verdict, Verdict::usable);
    EXPECT_EQ(f.count, 1u);
    EXPECT_EQ(f.first, "triangle 5 (vertices 0, 4, 5) faces against its neighbours");
    EXPECT_EQ(report.genus, 0);
    expect_mentions(refusal(m), "cube: 1 triangle is turned the wrong way; triangle 5 (vertices 0, 4, 5)");
    expect_mentions(refusal(m), "--fix -o OUT");
}

TEST(Check, InsideOut) {
    const SurfaceMesh m = reversed(cube());
    const CheckReport report = checked(m);
    EXPECT_EQ(faults(report), Keys{"inside_out"});
    EXPECT_EQ(finding(report, "inside_out").count, 1u);
    EXPECT_EQ(finding(report, "inside_out").verdict, Verdict::usable);
    expect_mentions(finding(report, "inside_out").first, "12 triangles, volume -1 m^3");
    EXPECT_DOUBLE_EQ(report.volume_m3, -1);
    EXPECT_LT((report.centroid - Vector(0.5, 0.5, 0.5)).norm(), 1e-14);
    expect_mentions(refusal(m), "inside out");
}

TEST(Check, TwoPieces) {
    const SurfaceMesh m = together(cube(), moved(tetrahedron(), {5, 0, 0}));
    const CheckReport report = checked(m);
    EXPECT_EQ(faults(report), (Keys{"components", "star_shaped"}));
    EXPECT_EQ(report.components, 2u);
    EXPECT_EQ(finding(report, "components").count, 2u);
    expect_mentions(finding(report, "components").first, "triangle 12");
    expect_mentions(finding(report, "components").advice, "--centre local");
    EXPECT_EQ(report.genus, 0);
    EXPECT_EQ(refusal(m), "");

    const SurfaceMesh one_inverted = together(cube(), moved(reversed(tetrahedron()), {5, 0, 0}));
    EXPECT_EQ(finding(checked(one_inverted), "inside_out").count, 1u);
    expect_mentions(finding(checked(one_inverted), "inside_out").first, "triangle 12");
}

TEST(Check, CavityIsNotInsideOut) {
    const SurfaceMesh m = together(cube(), moved(reversed(cube()), {0.25, 0.25, 0.25}, 0.5));
    const CheckReport report = checked(m);
    EXPECT_EQ(faults(report), (Keys{"components", "star_shaped"}));
    expect_mentions(finding(report, "components").advice, "the piece of triangle 12 is a cavity");
    EXPECT_DOUBLE_EQ(report.volume_m3, 0.875);
    EXPECT_EQ(finding(report, "star_shaped").count, 12u);
    EXPECT_EQ(refusal(m), "");

    const SurfaceMesh stone = together(cube(), moved(cube(), {0.25, 0.25, 0.25}, 0.5));
    expect_mentions(finding(checked(stone), "components").advice, "its volume counts twice");

    // A ball in the hole of a torus lies in its box but not in it; a ball in the tube lies in both.
    const SurfaceMesh inverted = reversed(ball(1));
    EXPECT_EQ(finding(checked(together(torus(20, 10), moved(inverted, {0, 0, 0}, 0.5))), "inside_out").count,
              1u);
    EXPECT_EQ(finding(checked(together(torus(20, 10), moved(inverted, {2, 0, 0}, 0.5))), "inside_out").count,
              0u);
    // In a cavity there is room for a piece of its own.
    const SurfaceMesh nested = together(m, moved(reversed(cube()), {0.4, 0.4, 0.4}, 0.1));
    EXPECT_EQ(finding(checked(nested), "inside_out").count, 1u);
}

TEST(Check, DegenerateTriangles) {
    SurfaceMesh m = cube();
    m.triangles.push_back({3, 3, 5});
    CheckReport report = checked(m);
    EXPECT_EQ(faults(report), Keys{"degenerate"});
    EXPECT_EQ(finding(report, "degenerate").count, 1u);
    EXPECT_EQ(finding(report, "degenerate").verdict, Verdict::usable);
    EXPECT_EQ(finding(report, "degenerate").first, "triangle 12 (vertices 3, 3, 5) has no area");
    EXPECT_EQ(report.genus, 0);
    expect_mentions(refusal(m), "1 triangle has no area");

    // A vertex on the diagonal 0-3 with a triangle of no area under it: part of a closed surface, and
    // harmless.
    m = cube();
    m.positions.push_back({0.5, 0.5, 0});
    m.triangles[0] = {0, 2, 8};
    m.triangles.push_back({8, 2, 3});
    m.triangles.push_back({0, 8, 3});
    report = checked(m);
    EXPECT_EQ(finding(report, "degenerate").count, 1u);
    EXPECT_EQ(finding(report, "degenerate").verdict, Verdict::usable);
    EXPECT_EQ(finding(report, "closed").verdict, Verdict::fine);
    EXPECT_EQ(report.genus, 0);
    EXPECT_EQ(refusal(m), "");

    // A vertex of which no triangle has an area would have no mass.
    m = tetrahedron();
    m.positions.push_back({0.5, 0, 0});  // on edge 0-1
    m.triangles[0] = {0, 2, 1};
    m.triangles[1] = {0, 1, 3};
    m.triangles.insert(m.triangles.end(), {{0, 1, 4}});
    m.triangles[1] = {0, 4, 3};
    m.triangles.push_back({4, 1, 3});
    EXPECT_EQ(finding(checked(m), "closed").verdict, Verdict::fine);
    EXPECT_EQ(refusal(m), "");
    m = tetrahedron();
    m.positions.push_back({0.5, 0, 0});
    m.positions.push_back({0.75, 0, 0});
    m.triangles[1] = {0, 4, 3};  // 0-4-5-1 along the edge, 5 in flat triangles only
    m.triangles.insert(m.triangles.end(), {{4, 1, 3}, {0, 1, 5}, {0, 5, 4}, {4, 5, 1}});
    report = checked(m);
    EXPECT_EQ(finding(report, "closed").verdict, Verdict::fine);
    EXPECT_EQ(finding(report, "degenerate").verdict, Verdict::unusable);
    expect_mentions(finding(report, "degenerate").first, "vertex 5");
}

TEST(Check, DuplicateTriangles) {
    SurfaceMesh m = cube();
    m.triangles.push_back({3, 0, 2});
    const CheckReport report = checked(m);
    EXPECT_EQ(faults(report), Keys{"duplicate"});
    EXPECT_EQ(finding(report, "duplicate").count, 1u);
    EXPECT_EQ(finding(report, "duplicate").first,
              "triangle 12 (vertices 3, 0, 2) has the vertices of another");
    EXPECT_EQ(report.genus, 0);
    expect_mentions(refusal(m), "1 triangle is there twice");
}

TEST(Check, FoldedPair) {
    SurfaceMesh m = tetrahedron();
    m.positions.push_back({1, 1, 1});
    m.triangles.insert(m.triangles.end(), {{1, 2, 4}, {2, 1, 4}});  // a fin
    const CheckReport report = checked(m);
    EXPECT_EQ(faults(report), Keys{"duplicate"});
    EXPECT_EQ(finding(report, "duplicate").count, 2u);
    EXPECT_EQ(finding(report, "duplicate").first,
              "triangle 4 (vertices 1, 2, 4) lies back to back with another");

    SurfaceMesh pillow{"pillow", tetrahedron().positions, {{1, 2, 3}, {3, 2, 1}}};
    EXPECT_EQ(finding(checked(pillow), "size").verdict, Verdict::unusable);
    expect_mentions(refusal(pillow), "encloses no volume");
}

TEST(Check, CrossingPieces) {
    const SurfaceMesh m = together(tetrahedron(), moved(tetrahedron(), {0.2, 0.2, -0.3}));
    const CheckReport report = checked(m);
    const Finding& f = finding(report, "self_intersections");
    EXPECT_EQ(f.verdict, Verdict::usable);
    EXPECT_GT(f.count, 0u);
    EXPECT_EQ(f.count, report.self_intersections);
    EXPECT_EQ(f.first, "triangles 0 and 5 cross");
    EXPECT_EQ(finding(checked(m, {.self_intersections = false}), "self_intersections").verdict,
              Verdict::fine);
    EXPECT_EQ(checked(m, {.max_pairs = 1}).self_intersections, 1u);
    EXPECT_EQ(refusal(m), "");
}

TEST(Check, TorusHasAHandle) {
    const SurfaceMesh m = torus(20, 10);
    const CheckReport report = checked(m);
    EXPECT_EQ(report.genus, 1);
    EXPECT_EQ(faults(report), Keys{"star_shaped"});
    EXPECT_GT(report.negative_tetrahedra_by_count, 0.3);
    EXPECT_LT(report.negative_tetrahedra_by_volume, report.negative_tetrahedra_by_count);
    EXPECT_EQ(finding(report, "star_shaped").count,
              std::size_t(std::lround(report.negative_tetrahedra_by_count * 400)));
    expect_mentions(finding(report, "star_shaped").advice, "--centre local");
    EXPECT_EQ(checked(together(m, moved(m, {9, 0, 0}))).genus, 2);
}

TEST(Check, OneSidedSurface) {
    // A torus grid glued with a twist is a Klein bottle.
    SurfaceMesh m = torus(12, 8);
    for (std::size_t t = m.triangles.size() - 16; t < m.triangles.size(); ++t)
        for (Index& v : m.triangles[t])
            if (v < 8) v = (8 - v) % 8;
    const CheckReport report = checked(m);
    EXPECT_EQ(finding(report, "closed").verdict, Verdict::fine);
    EXPECT_EQ(finding(report, "oriented").verdict, Verdict::unusable);
    EXPECT_FALSE(report.genus);
    expect_mentions(refusal(m), "one side");
}

TEST(Check, Sizes) {
    EXPECT_EQ(faults(checked(SurfaceMesh{})), Keys{"size"});
    expect_mentions(refusal(SurfaceMesh{"nothing", {}, {}}),
                    "nothing: the size is not usable; the mesh has no triangle");
    EXPECT_EQ(finding(checked(SurfaceMesh{"", {{1, 2, 3}}, {{0, 0, 0}}}), "size").verdict, Verdict::unusable);
    EXPECT_EQ(finding(checked(moved(cube(), {0, 0, 0}, 0)), "size").verdict, Verdict::unusable);
    EXPECT_EQ(finding(checked(moved(cube(), {0, 0, 0}, 1e200)), "size").verdict, Verdict::unusable);
    EXPECT_EQ(finding(checked(moved(cube(), {0, 0, 0}, 1e-200)), "size").verdict, Verdict::unusable);
    EXPECT_EQ(checked(moved(cube(), {0, 0, 0}, 1e-20)).verdict, Verdict::fine);
    EXPECT_EQ(checked(moved(cube(), {0, 0, 0}, 1e20)).verdict, Verdict::fine);
    for (double bad : {std::nan(""), HUGE_VAL}) {
        SurfaceMesh m = cube();
        m.positions[3][1] = bad;
        const CheckReport report = checked(m);
        EXPECT_EQ(finding(report, "size").verdict, Verdict::unusable);
        expect_mentions(finding(report, "size").first, "vertex 3");
        EXPECT_NE(refusal(m), "");
    }
    SurfaceMesh flat = cube();
    for (Vector& p : flat.positions) p[2] = 0;
    EXPECT_EQ(finding(checked(flat), "size").verdict, Verdict::unusable);
}

TEST(Check, UnusedVerticesDoNotCount) {
    SurfaceMesh m = cube();
    m.positions.push_back({100, std::nan(""), 0});
    const CheckReport report = checked(m);
    EXPECT_EQ(report.verdict, Verdict::fine);
    EXPECT_EQ(report.upper, Vector(1, 1, 1));
    EXPECT_EQ(report.genus, 0);
}

TEST(Check, TurningAndMovingChangesNothing) {
    SurfaceMesh m = together(torus(20, 10), moved(ball(2), {2.03, 0.01, 0.87}));
    const CheckReport before = checked(m);
    for (Vector& p : m.positions) p = some_rotation() * p + Vector(300, 200, 100);
    const CheckReport after = checked(m);
    EXPECT_EQ(faults(after), faults(before));
    EXPECT_GT(after.self_intersections, 0u);
    EXPECT_EQ(after.self_intersections, before.self_intersections);
    EXPECT_EQ(after.negative_tetrahedra_by_count, before.negative_tetrahedra_by_count);
    EXPECT_NEAR(after.volume_m3, before.volume_m3, 1e-9);
}

TEST(Check, AnySoupGetsAReport) {
    for (unsigned seed = 1; seed <= 300; ++seed) {
        Dice dice(seed);
        SurfaceMesh m{"soup", {}, {}};
        const int vertices = 1 + int(dice(12)), triangles = int(dice(30));
        for (int i = 0; i < vertices; ++i)
            m.positions.emplace_back(double(dice(4)), double(dice(4)),
                                     seed % 50 == 0 && i == 1 ? std::nan("") : double(dice(3)));
        for (int i = 0; i < triangles; ++i)
            m.triangles.push_back({Index(dice(vertices)), Index(dice(vertices)), Index(dice(vertices))});
        checked(m);
    }
}

TEST(Check, PilesDoNotTakeForever) {
    SurfaceMesh same{"same", tetrahedron().positions, std::vector<Triangle>(100000, Triangle{0, 1, 2})};
    EXPECT_EQ(finding(checked(same), "duplicate").count, 99999u);
    SurfaceMesh book{"book", {{0, 0, 0}, {0, 0, 1}}, {}};  // a hundred thousand pages
    for (Index i = 0; i < 100000; ++i) {
        book.positions.emplace_back(std::cos(i * 5e-5), std::sin(i * 5e-5), 0.5);
        book.triangles.push_back({0, 1, i + 2});
    }
    EXPECT_EQ(finding(checked(book, {.self_intersections = false}), "manifold_edges").count, 1u);
}

}  // namespace
}  // namespace innerspring
