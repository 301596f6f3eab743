#pragma once
#include <span>
#include <utility>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

using Positions = std::span<const Vector>;
using Triangles = std::span<const Triangle>;

/// Signed volume [m^3] of a closed surface (Eq. 4), positive when the triangles are seen counter-clockwise
/// from outside. Right for convex and concave surfaces; summed about the first vertex so that far-away meshes
/// lose no digits.
double volume(Positions x, Triangles triangles);
inline double volume(const SurfaceMesh& mesh) {
    return volume(mesh.positions, mesh.triangles);
}

/// Centroid [m] of the enclosed solid. Needs a non-zero volume.
Vector volume_centroid(Positions x, Triangles triangles);

/// Mean of the vertices [m].
Vector vertex_mean(Positions x);

/// Twice the area vector (unnormalised outward normal) of a triangle [m^2].
inline Vector double_area_vector(Positions x, const Triangle& t) {
    return (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]);
}

/// Area of each triangle [m^2].
std::vector<double> triangle_areas(Positions x, Triangles triangles);

/// A_i: a third of the area of the triangles at each vertex [m^2].
std::vector<double> vertex_areas(Positions x, Triangles triangles);

/// Area-weighted unit normal of each vertex; zero where the triangles cancel.
std::vector<Vector> vertex_normals(Positions x, Triangles triangles);

/// The vertex nearest to a point, the first of several. Needs a vertex.
Index nearest_vertex(Positions x, const Vector& point);

/// Lower and upper corner of the bounding box [m].
std::pair<Vector, Vector> bounding_box(Positions x);

/// R = (3|V|/4pi)^(1/3) [m], the radius of the ball of the same volume.
double volume_radius(double volume_m3);

/// Moves the volume centroid to the origin and scales to volume radius `radius`; returns the factor applied
/// to lengths.
double normalize(SurfaceMesh& mesh, double radius = 1.0);

}  // namespace innerspring
