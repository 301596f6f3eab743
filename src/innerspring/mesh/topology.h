#pragma once
#include <span>

#include "innerspring/mesh/geometry.h"
#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

/// An undirected edge a < b and its incident triangles (CSR into Topology::edge_triangles).
struct Edge {
    Index a, b;
};

/// Compressed rows: the items of row i are values[start[i] .. start[i+1]).
struct Rows {
    std::vector<Index> start;
    std::vector<Index> values;
    std::span<const Index> operator[](std::size_t i) const {
        return {values.data() + start[i], start[i + 1] - start[i]};
    }
    std::size_t size() const { return start.empty() ? 0 : start.size() - 1; }
};

/// Rows by counting: `count` items, item n belongs to row key(n) (skipped when no_index); items stay in
/// increasing order. Linear time.
template <class Key>
Rows rows_by_key(std::size_t rows, std::size_t count, Key key) {
    Rows r;
    // start[i + 2] counts row i; summed up, start[i + 1] is where row i begins, and filling moves it to its
    // end.
    r.start.assign(rows + 2, 0);
    for (std::size_t n = 0; n < count; ++n)
        if (const Index i = key(n); i != no_index) ++r.start[i + 2];
    for (std::size_t i = 0; i < rows; ++i) r.start[i + 2] += r.start[i + 1];
    r.values.resize(r.start[rows + 1]);
    for (std::size_t n = 0; n < count; ++n)
        if (const Index i = key(n); i != no_index) r.values[r.start[i + 1]++] = Index(n);
    r.start.pop_back();
    return r;
}

struct Topology {
    std::vector<Edge> edges;  ///< sorted by (a, b); degenerate edges (a == b) left out
    Rows edge_triangles;      ///< per edge, its triangles in increasing order
    std::vector<std::array<Index, 3>>
        triangle_edges;     ///< per triangle, edges (0,1), (1,2), (2,0); no_index if degenerate
    Rows vertex_triangles;  ///< per vertex, its triangles in increasing order
    Rows vertex_edges;      ///< per vertex, its edges in increasing order
};

/// Edges, incidences and rings; linear time (counting sorts).
Topology build_topology(std::size_t vertices, Triangles triangles);

/// The vertex of `e` that is not `v`.
inline Index other_end(const Edge& e, Index v) {
    return e.a == v ? e.b : e.a;
}

/// Sorts and drops repetitions.
void make_set(std::vector<Index>& indices);

/// Vertices within `rings` edges of `vertex`, breadth first, `vertex` itself first.
std::vector<Index> ring(const Topology& topology, Index vertex, int rings = 1);

}  // namespace innerspring
