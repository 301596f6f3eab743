#pragma once
#include <cstdint>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

// What make_shape() chooses from; keys already validated, see shapes.h for their meaning.

SurfaceMesh icosphere(Index vertices, double radius);
SurfaceMesh irregular_sphere(Index vertices, std::uint64_t seed, double irregularity, double radius);

// Any size and place; make_shape() normalises.
SurfaceMesh ellipsoid(Index vertices, std::uint64_t seed, double a, double b, double c);
SurfaceMesh breast(Index vertices, std::uint64_t seed);
SurfaceMesh capsule(Index vertices, std::uint64_t seed, double aspect);
SurfaceMesh torus(Index vertices, std::uint64_t seed, double ratio);
SurfaceMesh dumbbell(Index vertices, std::uint64_t seed, double neck);
SurfaceMesh plate(Index vertices, std::uint64_t seed, double aspect);
SurfaceMesh organ(Index vertices, std::uint64_t seed, double bumpiness);

}  // namespace innerspring
