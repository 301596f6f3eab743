#pragma once
#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

/// A solid of tetrahedra, each with positive volume.
struct TetMesh {
    std::vector<Vector> positions;  ///< [m]
    std::vector<std::array<Index, 4>> tetrahedra;
};

struct TetrahedraOptions {
    double radius_edge_ratio = 1.4;  ///< of the circumscribed ball to the shortest edge, at most; > 1.1
    double largest_volume = 0;       ///< of a tetrahedron [m^3]; 0: as the ratio leaves them
    int patience_s = 120;            ///< then the program is ended [s]
};

/// Fills a closed surface with tetrahedra by TetGen (Si 2015, run as a program; Debian's package tetgen). The
/// first positions are the surface's own vertices, and every one of its triangles is a face: checked. Throws
/// RunError if tetgen is missing or fails, InputError if the surface cannot be filled (self-intersections).
TetMesh fill_with_tetrahedra(const SurfaceMesh& surface, const TetrahedraOptions& options = {});

}  // namespace innerspring
