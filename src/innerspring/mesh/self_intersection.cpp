#include "innerspring/mesh/self_intersection.h"

#include <algorithm>

#include "innerspring/mesh/bvh.h"
#include "innerspring/mesh/triangle_intersection.h"

namespace innerspring {

SelfIntersections search_self_intersections(const SurfaceMesh& mesh, std::size_t max_pairs,
                                            std::size_t max_tests) {
    const auto& x = mesh.positions;
    std::vector<Box> boxes;
    std::vector<Index> triangle;  // per box; all but those with a coordinate that is not finite
    boxes.reserve(mesh.triangles.size());
    triangle.reserve(mesh.triangles.size());
    for (Index n = 0; n < mesh.triangles.size(); ++n) {
        const auto& [i, j, k] = mesh.triangles[n];
        if (!x[i].allFinite() || !x[j].allFinite() || !x[k].allFinite()) continue;
        boxes.push_back({x[i].cwiseMin(x[j]).cwiseMin(x[k]), x[i].cwiseMax(x[j]).cwiseMax(x[k])});
        triangle.push_back(n);
    }
    SelfIntersections found;
    std::size_t tests = 0;
    found.complete = for_each_self_overlap(build_box_tree(boxes), [&](Index p, Index q) {
        if (tests++ == max_tests || found.pairs.size() >= max_pairs) return false;
        const auto [a, b] = std::minmax(triangle[p], triangle[q]);
        if (triangles_cross(x, mesh.triangles[a], mesh.triangles[b])) found.pairs.emplace_back(a, b);
        return true;
    });
    std::sort(found.pairs.begin(), found.pairs.end());
    return found;
}

std::vector<std::pair<Index, Index>> self_intersections(const SurfaceMesh& mesh, std::size_t max_pairs) {
    return search_self_intersections(mesh, max_pairs).pairs;
}

}  // namespace innerspring
