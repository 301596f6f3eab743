#pragma once
#include <limits>
#include <utility>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

/// Pairs (a < b) of triangles that cross or overlap: triangles sharing an edge count only if folded onto each
/// other, sharing a vertex only if they meet elsewhere too. At most `max_pairs`, sorted. O(n log n) with a
/// bounding-volume hierarchy.
std::vector<std::pair<Index, Index>> self_intersections(const SurfaceMesh& mesh,
                                                        std::size_t max_pairs = 1000000);

struct SelfIntersections {
    std::vector<std::pair<Index, Index>> pairs;
    bool complete = true;  ///< false: a limit ended the search, there may be more
};

/// The same, looking at no more than `max_tests` pairs of triangles with overlapping boxes (a soup may have
/// n^2 of them).
SelfIntersections search_self_intersections(const SurfaceMesh& mesh, std::size_t max_pairs,
                                            std::size_t max_tests = std::numeric_limits<std::size_t>::max());

}  // namespace innerspring
