#pragma once
#include "innerspring/mesh/surface_mesh.h"
#include "innerspring/mesh/weld.h"

namespace innerspring {

struct Repaired {
    SurfaceMesh mesh;
    std::vector<std::string>
        actions;  ///< what was done, one line each, with counts; empty if nothing was needed
    std::vector<Index> new_from_old;  ///< per old vertex its new index, or no_index
};

/// Only what is safe: weld, drop unused vertices, drop degenerate and duplicate triangles, orient
/// consistently across manifold edges, flip components that are inside out (a component nested inside another
/// is left alone). Never moves a vertex, never closes a hole.
Repaired repair(const SurfaceMesh& mesh, const WeldOptions& options = {});

}  // namespace innerspring
