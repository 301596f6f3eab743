#pragma once
#include <gtest/gtest.h>

#include "support/bodies.h"

// What holds of every body, however it came to be.
namespace innerspring::support {

/// Edges, spokes and triangles agree with each other and with the surface; sums are as Eqs. 1-3 want them.
inline void expect_sound(const Body& body) {
    const auto& triangles = body.rest.triangles;
    const std::size_t n = body.vertices(), edges = body.edges.size();
    ASSERT_EQ(2 * edges, 3 * triangles.size());
    for (const auto* list : {&body.L, &body.m, &body.K, &body.c}) ASSERT_EQ(list->size(), n);
    ASSERT_EQ(body.rows.size(), n);
    ASSERT_EQ(body.k.size(), edges);
    ASSERT_EQ(body.rest_length.size(), edges);
    ASSERT_EQ(body.edge_triangles.size(), edges);
    ASSERT_EQ(body.triangle_edges.size(), triangles.size());
    const Topology topology = build_topology(n, triangles);
    ASSERT_EQ(topology.edges.size(), edges);
    std::vector<int> seen(edges, 0);
    std::size_t wrong = 0;
    for (Index i = 0; i < n; ++i) {
        const auto spokes = body.spokes_of(i);
        wrong += spokes.size() != topology.vertex_edges[i].size();
        for (std::size_t s = 0; s < spokes.size(); ++s) {
            const Spoke& spoke = spokes[s];
            ASSERT_LT(spoke.edge, edges);
            ++seen[spoke.edge];
            wrong += spoke.k != body.k[spoke.edge] || spoke.rest != body.rest_length[spoke.edge];
            wrong += other_end(body.edges[spoke.edge], i) != spoke.neighbour;
            wrong += s > 0 && !(spoke.neighbour > spokes[s - 1].neighbour);
        }
    }
    EXPECT_EQ(wrong, 0u) << "spokes";
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) {
            const Index u = triangles[t][k], v = triangles[t][(k + 1) % 3], e = body.triangle_edges[t][k];
            ASSERT_LT(e, edges);
            wrong += body.edges[e].a != std::min(u, v) || body.edges[e].b != std::max(u, v);
            wrong += std::ranges::count(body.edge_triangles[e], Index(t)) != 1;
        }
    EXPECT_EQ(wrong, 0u) << "triangles";
    for (std::size_t e = 0; e < edges; ++e) {
        wrong += seen[e] != 2 || !(body.edge_triangles[e][0] < body.edge_triangles[e][1]);
        double area = 0;
        for (Index t : body.edge_triangles[e])
            area += double_area_vector(body.rest.positions, triangles[t]).norm() / 2;
        const double length =
            (body.rest.positions[body.edges[e].a] - body.rest.positions[body.edges[e].b]).norm();
        wrong += std::abs(body.rest_length[e] - length) > 1e-15 * length;
        wrong += std::abs(body.k[e] - body.material.surface * area / (length * length)) > 1e-12 * body.k[e];
    }
    EXPECT_EQ(wrong, 0u) << "edges";
    for (std::size_t i = 0; i < n; ++i) {
        ASSERT_GT(body.m[i], 0) << i;
        ASSERT_GT(body.K[i], 0) << i;
        ASSERT_NEAR(body.c[i], 2 * body.material.damping * std::sqrt(body.K[i] * body.m[i]),
                    1e-14 * body.c[i]);
    }
    EXPECT_NEAR(sum(body.m), body.material.mass, 1e-12 * body.material.mass);
    if (body.scheme == Scheme::C) {
        EXPECT_NEAR(sum(body.K), body.stiffness_sum, 1e-11 * sum(body.K));
    }
}

}  // namespace innerspring::support
