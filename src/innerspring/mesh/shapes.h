#pragma once
#include <span>
#include <string_view>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

/// A built-in shape by specification "NAME" or "NAME:key=value,key=value", e.g.
/// "sphere:vertices=2000,seed=1,irregularity=3". Every shape is closed, manifold, outward oriented, free of
/// self-intersections, generated anew (never on disk) and the same bits for the same specification. Lengths
/// in metres.
///
/// Common keys: vertices (about so many; 12 .. 5e6), seed.
///  sphere      irregular vertex density, denser towards +z; irregularity = ratio of densest to coarsest
///  (default 3); every vertex
///              at distance exactly radius (default 1) of the origin
///  icosphere   subdivided icosahedron, every vertex at distance radius (default 1); vertices gives the
///  nearest 10 n^2 + 2 ellipsoid   a, b, c semi-axes (default ratio 2:1:1) breast      smooth asymmetric dome
///  on a flat back with a nipple and dense vertices around it capsule     aspect = total length / diameter
///  (default 2) torus       ratio = major / minor radius (default 2.5) dumbbell    two balls and a neck; neck
///  = neck radius / ball radius (default 0.5) plate       rounded flat slab; aspect = width / thickness
///  (default 6) organ       bumpy concave solid, not star-shaped; bumpiness (default 1)
/// All but sphere and icosphere have volume radius 1 m and their volume centroid at the origin unless radius=
/// says otherwise. Throws InputError: unknown shape or key (naming the nearest known one), value out of
/// range.
SurfaceMesh make_shape(std::string_view specification);

/// True if `specification` names a built-in shape (the part before ':').
bool is_shape(std::string_view specification);

std::span<const std::string_view> shape_names();

}  // namespace innerspring
