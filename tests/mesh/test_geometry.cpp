#include "innerspring/mesh/geometry.h"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>
#include <set>

#include "innerspring/mesh/bvh.h"
#include "innerspring/mesh/topology.h"
#include "small_meshes.h"

namespace innerspring {
namespace {

using namespace innerspring::testing;

double sum(const std::vector<double>& v) {
    return std::accumulate(v.begin(), v.end(), 0.0);
}

TEST(Geometry, VolumesOfSimpleSolids) {
    EXPECT_DOUBLE_EQ(volume(tetrahedron()), 1.0 / 6);
    EXPECT_DOUBLE_EQ(volume(cube()), 1);
    EXPECT_DOUBLE_EQ(volume(reversed(cube())), -1);
    EXPECT_EQ(volume(SurfaceMesh{}), 0);
    const double ball_volume = 4 * std::numbers::pi / 3;
    EXPECT_NEAR(volume(ball(4)), ball_volume, 0.01 * ball_volume);
    EXPECT_NEAR(volume(torus(200, 100)), 4 * std::numbers::pi * std::numbers::pi, 0.05);
}

TEST(Geometry, FarAwayLosesNoDigits) {
    const SurfaceMesh far = moved(cube(), {1e6, -2e6, 3e6});
    EXPECT_NEAR(volume(far), 1, 1e-9);
    EXPECT_LT(
        (volume_centroid(far.positions, far.triangles) - Vector(1e6 + 0.5, -2e6 + 0.5, 3e6 + 0.5)).norm(),
        1e-8);
}

TEST(Geometry, RotationChangesNothing) {
    SurfaceMesh m = torus(24, 12);
    const double v = volume(m), a = sum(triangle_areas(m.positions, m.triangles));
    const Vector c = volume_centroid(m.positions, m.triangles);
    for (Vector& p : m.positions) p = some_rotation() * p;
    EXPECT_NEAR(volume(m), v, 1e-12 * v);
    EXPECT_NEAR(sum(triangle_areas(m.positions, m.triangles)), a, 1e-12 * a);
    EXPECT_LT((volume_centroid(m.positions, m.triangles) - some_rotation() * c).norm(), 1e-12);
}

TEST(Geometry, CentroidOfShiftedCube) {
    const SurfaceMesh m = moved(cube(), {2, -3, 5}, 4);
    EXPECT_LT((volume_centroid(m.positions, m.triangles) - Vector(4, -1, 7)).norm(), 1e-13);
    EXPECT_LT((vertex_mean(m.positions) - Vector(4, -1, 7)).norm(), 1e-13);
    EXPECT_LT(
        (volume_centroid(tetrahedron().positions, tetrahedron().triangles) - Vector(0.25, 0.25, 0.25)).norm(),
        1e-15);
}

TEST(Geometry, AreasAddUp) {
    const SurfaceMesh m = ball(3);
    const double area = sum(triangle_areas(m.positions, m.triangles));
    EXPECT_NEAR(area, 4 * std::numbers::pi, 0.02 * area);
    EXPECT_NEAR(sum(vertex_areas(m.positions, m.triangles)), area, 1e-12 * area);
    EXPECT_DOUBLE_EQ(sum(triangle_areas(cube().positions, cube().triangles)), 6);
    Vector closed = Vector::Zero();  // the area vectors of a closed surface cancel
    for (const Triangle& t : m.triangles) closed += double_area_vector(m.positions, t);
    EXPECT_LT(closed.norm(), 1e-13);
}

TEST(Geometry, NormalsLookOutwards) {
    const SurfaceMesh m = ball(3);
    const std::vector<Vector> normals = vertex_normals(m.positions, m.triangles);
    for (std::size_t v = 0; v < normals.size(); ++v) {
        EXPECT_NEAR(normals[v].norm(), 1, 1e-14);
        EXPECT_GT(normals[v].dot(m.positions[v]), 0.99);
    }
    const SurfaceMesh both = {"", tetrahedron().positions, {{0, 1, 2}, {0, 2, 1}}};
    EXPECT_EQ(vertex_normals(both.positions, both.triangles)[0], Vector::Zero());
}

TEST(Geometry, BoundingBoxAndRadius) {
    const auto [lower, upper] = bounding_box(moved(cube(), {-1, 2, 3}, 2).positions);
    EXPECT_EQ(lower, Vector(-1, 2, 3));
    EXPECT_EQ(upper, Vector(1, 4, 5));
    EXPECT_DOUBLE_EQ(volume_radius(4 * std::numbers::pi / 3 * 8), 2);
    SurfaceMesh m = moved(torus(20, 10), {7, 8, 9}, 0.3);
    const double size = (m.positions[1] - m.positions[0]).norm(), factor = normalize(m, 1.5);
    EXPECT_NEAR(volume_radius(volume(m)), 1.5, 1e-12);
    EXPECT_LT(volume_centroid(m.positions, m.triangles).norm(), 1e-12);
    EXPECT_NEAR((m.positions[1] - m.positions[0]).norm(), factor * size, 1e-12);
}

/// What holds for every closed manifold surface.
void expect_closed(const SurfaceMesh& m, std::ptrdiff_t euler) {
    const Topology topology = build_topology(m.positions.size(), m.triangles);
    EXPECT_EQ(std::ptrdiff_t(m.positions.size() + m.triangles.size()) - std::ptrdiff_t(topology.edges.size()),
              euler)
        << m.name;
    EXPECT_EQ(2 * topology.edges.size(), 3 * m.triangles.size());
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
        const auto [a, b] = topology.edges[e];
        EXPECT_LT(a, b);
        ASSERT_EQ(topology.edge_triangles[e].size(), 2u);
        EXPECT_LT(topology.edge_triangles[e][0], topology.edge_triangles[e][1]);
        for (Index t : topology.edge_triangles[e])
            EXPECT_EQ(std::ranges::count(topology.triangle_edges[t], Index(e)), 1);
    }
    for (std::size_t t = 0; t < m.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) {
            const auto [a, b] = topology.edges[topology.triangle_edges[t][k]];
            EXPECT_EQ((std::set<Index>{a, b}),
                      (std::set<Index>{m.triangles[t][k], m.triangles[t][(k + 1) % 3]}));
        }
    for (Index v = 0; v < m.positions.size(); ++v) {
        EXPECT_EQ(topology.vertex_edges[v].size(), topology.vertex_triangles[v].size());  // a closed fan
        EXPECT_TRUE(std::ranges::is_sorted(topology.vertex_edges[v]));
        EXPECT_TRUE(std::ranges::is_sorted(topology.vertex_triangles[v]));
        for (Index t : topology.vertex_triangles[v]) EXPECT_EQ(std::ranges::count(m.triangles[t], v), 1);
        for (Index e : topology.vertex_edges[v]) EXPECT_NE(other_end(topology.edges[e], v), v);
    }
}

TEST(Topology, ClosedSurfaces) {
    expect_closed(tetrahedron(), 2);
    expect_closed(cube(), 2);
    expect_closed(ball(2), 2);
    expect_closed(torus(7, 5), 0);
    expect_closed(together(torus(7, 5), tetrahedron()), 2);
}

TEST(Topology, Rings) {
    const SurfaceMesh m = cube();
    const Topology topology = build_topology(8, m.triangles);
    EXPECT_EQ(ring(topology, 0, 0), std::vector<Index>{0});
    const std::vector<Index> one = ring(topology, 0);
    EXPECT_EQ(one[0], 0u);
    EXPECT_EQ(std::set<Index>(one.begin(), one.end()), (std::set<Index>{0, 1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(ring(topology, 0, 2).size(), 8u);
    EXPECT_EQ(ring(topology, 0, 2).back(), 7u);
}

TEST(Topology, DegenerateEdgesAreLeftOut) {
    const std::vector<Triangle> triangles{{0, 1, 1}, {0, 1, 2}};
    const Topology topology = build_topology(4, triangles);
    EXPECT_EQ(topology.edges.size(), 3u);
    EXPECT_EQ(topology.triangle_edges[0][1], no_index);
    EXPECT_TRUE(topology.vertex_edges[3].empty());
}

TEST(BoxTree, FindsWhatLookingAtAllFinds) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        Dice dice(seed);
        std::vector<Box> boxes;
        for (int n = int(dice(200)); n > 0; --n) {
            const Vector lower(double(dice(20)), double(dice(20)), double(dice(3)));
            boxes.push_back({lower, lower + Vector(double(dice(4)), double(dice(4)), double(dice(4)))});
        }
        const BoxTree tree = build_box_tree(boxes);
        std::set<std::pair<Index, Index>> found, expected;
        const auto note = [&](Index a, Index b) { return found.insert(std::minmax(a, b)).second; };
        EXPECT_TRUE(for_each_self_overlap(tree, note)) << "a pair was met twice";
        for (Index a = 0; a < boxes.size(); ++a) {
            std::set<Index> by_tree, by_hand;
            for_each_overlap(tree, boxes[a], [&](Index b) { return by_tree.insert(b).second; });
            for (Index b = 0; b < boxes.size(); ++b) {
                if (!overlap(boxes[a], boxes[b])) continue;
                by_hand.insert(b);
                if (a < b) expected.emplace(a, b);
            }
            EXPECT_EQ(by_tree, by_hand);
        }
        EXPECT_EQ(found, expected);
    }
    EXPECT_TRUE(for_each_overlap(build_box_tree({}), Box{}, [](Index) { return false; }));
}

TEST(BoxTree, IsFastWhereAllButOneLieInASpeck) {
    // Boxes in a row that do not touch, in one cell of any grid over the whole.
    std::vector<Box> boxes{{Vector::Constant(1e30), Vector::Constant(1e30)}};
    for (int n = 0; n < 5000; ++n) {
        const Vector p(double(n * 1237 % 5000), 0, 0);
        boxes.push_back({p, p + Vector::Constant(0.5)});
    }
    const BoxTree tree = build_box_tree(boxes);
    EXPECT_TRUE(for_each_self_overlap(tree, [](Index, Index) { return false; }));
    // Leaves that are compact: side by side they are as long as the row.
    double length = 0;
    for (const BoxTree::Node& node : tree.nodes)
        if (node.count > 0 && node.box.upper.x() < 1e6) length += node.box.upper.x() - node.box.lower.x();
    EXPECT_LT(length, 5000);
}

TEST(BoxTree, TakesTheLargestNumbers) {
    const double most = std::numeric_limits<double>::max();
    std::vector<Box> boxes;
    for (double x : {-most, -1.0, 0.0, 1e-300, 1.0, most})
        boxes.push_back({Vector::Constant(x), Vector::Constant(x)});
    const BoxTree tree = build_box_tree(boxes);
    for (Index n = 0; n < boxes.size(); ++n) {
        std::vector<Index> found;
        for_each_overlap(tree, boxes[n], [&](Index i) {
            found.push_back(i);
            return true;
        });
        EXPECT_EQ(found, std::vector<Index>{n});
    }
}

TEST(Topology, RowsByKeyKeepTheOrderAndLeaveOut) {
    const std::vector<Index> keys{2, 0, no_index, 2, 2, 0};
    const Rows rows = rows_by_key(4, keys.size(), [&](std::size_t n) { return keys[n]; });
    EXPECT_EQ(rows.start, (std::vector<Index>{0, 2, 2, 5, 5}));
    EXPECT_EQ(rows.values, (std::vector<Index>{1, 5, 0, 3, 4}));
}

TEST(BoxTree, StopsWhenTold) {
    const std::vector<Box> same(1000, Box{});
    int calls = 0;
    EXPECT_FALSE(for_each_overlap(build_box_tree(same), Box{}, [&](Index) { return ++calls < 7; }));
    EXPECT_EQ(calls, 7);
    EXPECT_FALSE(for_each_self_overlap(build_box_tree(same), [&](Index, Index) { return ++calls < 20; }));
    EXPECT_EQ(calls, 20);
}

}  // namespace
}  // namespace innerspring
