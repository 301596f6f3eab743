#pragma once
#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

struct WeldOptions {
    double tolerance = 0;  ///< vertices this near are one [same unit as the mesh]; 0: exactly equal
                           ///< coordinates (-0 equals 0)
};

struct Welded {
    SurfaceMesh mesh;  ///< the kept vertices in the order of the old mesh, without those no triangle uses
    std::vector<Index>
        new_from_old;  ///< per old vertex its new index, or no_index where it was dropped as unused
    Index merged = 0;  ///< vertices merged into an earlier one
    Index unused = 0;  ///< vertices dropped because no triangle uses them
};

/// Merges vertices by position and drops those no triangle uses. Triangles keep their order and number,
/// degenerate ones included. Throws InputError if the tolerance is negative or not finite. Within a tolerance
/// each vertex joins the earliest kept vertex no farther than it. Linear time.
Welded weld(const SurfaceMesh& mesh, const WeldOptions& options = {});

}  // namespace innerspring
