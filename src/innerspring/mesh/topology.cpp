#include "innerspring/mesh/topology.h"

#include <algorithm>

namespace innerspring {

Topology build_topology(std::size_t vertices, Triangles triangles) {
    Topology topology;
    const std::size_t corners = 3 * triangles.size();
    // Corner 3t+k stands for the side (k, k+1) of triangle t. Bucket the sides by their smaller vertex, then
    // sort each bucket.
    auto end = [&](std::size_t corner, unsigned which) {
        return triangles[corner / 3][(corner % 3 + which) % 3];
    };
    auto low = [&](std::size_t corner) { return std::min(end(corner, 0), end(corner, 1)); };
    auto high = [&](std::size_t corner) { return std::max(end(corner, 0), end(corner, 1)); };
    Rows sides =
        rows_by_key(vertices, corners, [&](std::size_t n) { return low(n) == high(n) ? no_index : low(n); });

    topology.triangle_edges.assign(triangles.size(), {no_index, no_index, no_index});
    topology.edge_triangles.start.push_back(0);
    topology.edge_triangles.values.reserve(sides.values.size());
    for (std::size_t v = 0; v < vertices; ++v) {
        auto first = sides.values.begin() + sides.start[v], last = sides.values.begin() + sides.start[v + 1];
        std::sort(first, last,
                  [&](Index p, Index q) { return high(p) != high(q) ? high(p) < high(q) : p < q; });
        for (auto it = first; it != last;) {
            const Index b = high(*it);
            const Index edge = Index(topology.edges.size());
            topology.edges.push_back({Index(v), b});
            for (; it != last && high(*it) == b; ++it) {
                topology.triangle_edges[*it / 3][*it % 3] = edge;
                topology.edge_triangles.values.push_back(*it / 3);
            }
            topology.edge_triangles.start.push_back(Index(topology.edge_triangles.values.size()));
        }
    }

    Rows corners_of = rows_by_key(vertices, corners, [&](std::size_t n) { return triangles[n / 3][n % 3]; });
    for (Index& corner : corners_of.values) corner /= 3;
    topology.vertex_triangles = std::move(corners_of);

    Rows ends_of = rows_by_key(vertices, 2 * topology.edges.size(), [&](std::size_t n) {
        const Edge& e = topology.edges[n / 2];
        return n % 2 == 0 ? e.a : e.b;
    });
    for (Index& item : ends_of.values) item /= 2;
    topology.vertex_edges = std::move(ends_of);
    return topology;
}

void make_set(std::vector<Index>& indices) {
    std::sort(indices.begin(), indices.end());
    indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
}

std::vector<Index> ring(const Topology& topology, Index vertex, int rings) {
    std::vector<Index> found{vertex};
    std::size_t level_begin = 0;
    std::vector<bool> seen(topology.vertex_edges.size(), false);
    seen[vertex] = true;
    for (int level = 0; level < rings; ++level) {
        const std::size_t level_end = found.size();
        for (std::size_t n = level_begin; n < level_end; ++n) {
            const Index v = found[n];
            for (Index e : topology.vertex_edges[v]) {
                const Index w = other_end(topology.edges[e], v);
                if (!seen[w]) {
                    seen[w] = true;
                    found.push_back(w);
                }
            }
        }
        level_begin = level_end;
    }
    return found;
}

}  // namespace innerspring
