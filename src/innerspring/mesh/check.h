#pragma once
#include <optional>

#include "innerspring/mesh/surface_mesh.h"
#include "innerspring/mesh/topology.h"

namespace innerspring {

enum class Verdict { fine, usable, unusable };

/// One finding of check(): what was looked at, how it stands, the first offending element, what to do.
struct Finding {
    std::string what;  ///< stable key: closed, manifold_edges, manifold_vertices, oriented, inside_out,
                       ///< components, degenerate, duplicate, self_intersections, star_shaped, size
    Verdict verdict = Verdict::fine;
    std::size_t count = 0;  ///< offending elements
    std::string first;      ///< the first one, e.g. "edge 12-57 (triangle 9)"; empty when fine
    std::string advice;     ///< what to do ("usable with --fix", "--centre local"); empty when fine
};

struct CheckReport {
    std::vector<Finding> findings;    ///< always all of them, in the order above
    Verdict verdict = Verdict::fine;  ///< the worst
    std::size_t vertices = 0, triangles = 0, edges = 0;
    std::size_t components = 0;
    std::optional<int> genus;  ///< summed over components; only for closed manifold surfaces
    double volume_m3 = 0;      ///< Eq. 4; meaningful for closed surfaces
    double area_m2 = 0;
    Vector lower = Vector::Zero(), upper = Vector::Zero(), centroid = Vector::Zero();  ///< [m]
    double edge_min_m = 0, edge_mean_m = 0, edge_max_m = 0;
    double negative_tetrahedra_by_count =
        0;  ///< share of virtual tetrahedra about the centroid with V_t <= 0
    double negative_tetrahedra_by_volume = 0;  ///< their |V_t| over the sum of |V_t|
    std::size_t self_intersections = 0;        ///< pairs of triangles that cross
};

struct CheckOptions {
    bool self_intersections = true;
    std::size_t max_pairs = 1000000;  ///< stop counting crossing pairs here
};

/// Looks at a welded mesh (see weld.h) and judges whether a body can be built of it. Never throws for a bad
/// mesh.
CheckReport check(const SurfaceMesh& mesh, const CheckOptions& options = {});

/// Throws InputError with the first unusable finding, its element and advice; the gate before build_body().
/// Returns the mesh's topology, which it needed anyway.
Topology require_usable(const SurfaceMesh& mesh);

}  // namespace innerspring
