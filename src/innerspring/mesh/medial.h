#pragma once
#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

struct MedialOptions {
    double denoising_angle = 0.43633231299858238;  ///< [rad] (25 degrees): a ball whose two touching points
                                                   ///< are seen closer than this stops shrinking
    int threads = 0;                               ///< 0: all cores; any number gives the same bits
};

/// Per vertex the radius [m] of the largest ball inside the surface that touches it there: shrinking-ball
/// algorithm of Ma, Bae & Choi, "3D medial axis point approximation using nearest neighbors and the normal
/// field", The Visual Computer 28 (2012). `mesh` closed and outward oriented. Every radius is positive and
/// finite, at most the bounding-box diagonal.
std::vector<double> medial_radii(const SurfaceMesh& mesh, const MedialOptions& options = {});

}  // namespace innerspring
