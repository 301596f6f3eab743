#pragma once
#include <optional>

#include "innerspring/body/refine.h"

namespace innerspring {

/// Nested dissection of a surface (George 1973) by planes through the vertices at rest: a separator is
/// eliminated after the two sides that it keeps apart. The tree of separators is the elimination tree of a
/// Cholesky factor of any matrix with the surface's edges as pattern, a node's vertices its columns, taken as
/// dense. Vertices have a place that never changes while they exist.
struct Dissection {
    struct Segment {
        int node;         ///< the ancestor
        int first, last;  ///< rows[first .. last) are its columns
    };
    struct Updater {
        int node, segment;  ///< a descendant with rows among our columns
    };
    struct Node {
        int parent = -1;
        std::vector<int> children, columns;  ///< columns: places, increasing
        std::vector<int> rows;               ///< places of ancestors with entries below, in their order
        std::vector<Segment> segments;       ///< of rows
        std::vector<Updater> updaters;       ///< increasing
        std::size_t cut = 0;                 ///< columns when it was cut
    };
    std::vector<Node> nodes;       ///< children first
    std::vector<int> node_of;      ///< per place; -1: empty
    std::vector<int> place_of;     ///< per vertex
    std::vector<Index> vertex_of;  ///< per place
};

Dissection dissect(const Body& body);

/// Brings the tree in line with a refinement or its undoing. Returns the nodes whose columns, rows or values
/// changed and all above them, increasing; nothing if the tree had better be made anew (too many new vertices
/// in one node). A new vertex goes to the lower of the two nodes that hold the ends of the edge it halves:
/// the corners of a triangle always lie on one path to the root, and so do all vertices between them.
std::optional<std::vector<int>> update(Dissection& tree, const Body& body, const SurfaceChange& surface,
                                       const BodyChange& change);

}  // namespace innerspring
