#include "innerspring/mesh/topology.h"

#include <algorithm>

namespace innerspring {

Topology build_topology(std::size_t vertices, Triangles triangles) {
    Topology topology;
    const std::size_t corners = 3 * triangles.size();
    // Corner 3t+k stands for the side (k, k+1) of triangle t. Bucket the sides by their smaller vertex, with
    // the other one at hand, then sort each bucket.
    struct Side {
        Index high, corner;
    };
    std::vector<Index> next(vertices + 1, 0);  // where a vertex's bucket begins, then ends
    const auto each_side = [&](auto&& visit) {
        for (std::size_t t = 0; t < triangles.size(); ++t)
            for (Index k = 0; k < 3; ++k) {
                const Index a = triangles[t][k], b = triangles[t][k == 2 ? 0 : k + 1];
                if (a != b) visit(std::min(a, b), std::max(a, b), Index(3 * t + k));
            }
    };
    each_side([&](Index low, Index, Index) { ++next[low + 1]; });
    for (std::size_t v = 0; v < vertices; ++v) next[v + 1] += next[v];
    std::vector<Side> sides(next[vertices]);
    each_side([&](Index low, Index high, Index corner) { sides[next[low]++] = {high, corner}; });

    topology.triangle_edges.assign(triangles.size(), {no_index, no_index, no_index});
    topology.edges.reserve(sides.size() / 2);
    topology.edge_triangles.start.reserve(sides.size() / 2 + 1);
    topology.edge_triangles.start.push_back(0);
    topology.edge_triangles.values.reserve(sides.size());
    for (std::size_t v = 0, from = 0; v < vertices; from = next[v++]) {
        const auto first = sides.begin() + std::ptrdiff_t(from), last = sides.begin() + next[v];
        std::sort(first, last, [](const Side& p, const Side& q) {
            return p.high != q.high ? p.high < q.high : p.corner < q.corner;
        });
        for (auto it = first; it != last;) {
            const Index b = it->high;
            const Index edge = Index(topology.edges.size());
            topology.edges.push_back({Index(v), b});
            for (; it != last && it->high == b; ++it) {
                topology.triangle_edges[it->corner / 3][it->corner % 3] = edge;
                topology.edge_triangles.values.push_back(it->corner / 3);
            }
            topology.edge_triangles.start.push_back(Index(topology.edge_triangles.values.size()));
        }
    }
    sides = {}, next = {};

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
