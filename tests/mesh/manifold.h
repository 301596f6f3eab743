#pragma once
#include <gtest/gtest.h>

#include "innerspring/mesh/topology.h"

namespace innerspring {

/// Euler characteristic; fails unless every edge lies between two triangles that run it in opposite
/// directions.
inline long check_manifold(const SurfaceMesh& mesh) {
    const Topology topology = build_topology(mesh.positions.size(), mesh.triangles);
    std::size_t not_two = 0, not_opposite = 0, unused = 0;
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
        int direction = 0;
        for (Index t : topology.edge_triangles[e])
            for (int k = 0; k < 3; ++k)
                if (topology.triangle_edges[t][k] == e)
                    direction += mesh.triangles[t][k] == topology.edges[e].a ? 1 : -1;
        not_two += topology.edge_triangles[e].size() != 2;
        not_opposite += direction != 0;
    }
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        // One fan of triangles: as many neighbours as triangles, and the neighbours are linked in one ring.
        const auto fan = topology.vertex_triangles[v];
        unused += fan.empty() || fan.size() != topology.vertex_edges[v].size();
    }
    EXPECT_EQ(not_two, 0u);
    EXPECT_EQ(not_opposite, 0u);
    EXPECT_EQ(unused, 0u);
    return long(mesh.positions.size()) - long(topology.edges.size()) + long(mesh.triangles.size());
}

}  // namespace innerspring
