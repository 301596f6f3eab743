#pragma once
#include <cstdint>
#include <functional>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

/// What the mesher must know of a smooth closed surface. Behind make_shape(); not for use elsewhere.
struct ShapeSurface {
    /// A point near the surface. u in [0,1] runs from pole to pole (or once round a handle if `cyclic`), phi
    /// in [0,2pi) round the axis.
    std::function<Vector(double u, double phi)> place;
    std::function<Vector(const Vector&)>
        project;  ///< the surface point near a point that is near the surface
    std::function<double(const Vector&)>
        density;  ///< wanted vertices per area, relative; empty means uniform
    /// Projectors onto smoother surfaces to pass through first, nearest to the placed points first; they keep
    /// a bumpy surface from folding.
    std::vector<std::function<Vector(const Vector&)>> approach = {};
    bool cyclic = false;  ///< genus 1: u = 1 is u = 0
};

/// An unstructured mesh of exactly `vertices` vertices, triangles close to Delaunay and none a sliver.
SurfaceMesh mesh_shape(const ShapeSurface& surface, Index vertices, std::uint64_t seed);

/// First step of mesh_shape(): rings of nearly equal spacing, zipped together. Outward oriented.
SurfaceMesh ring_mesh(const ShapeSurface& surface, Index vertices, std::uint64_t seed);

/// Second step: scatters the vertices in the surface, then flips edges and smooths until no triangle is a
/// sliver.
void scatter_and_relax(const ShapeSurface& surface, std::uint64_t seed, SurfaceMesh& mesh);

/// In between: projects the vertices, then flips edges and smooths once.
void settle(const ShapeSurface& surface, SurfaceMesh& mesh);

/// Projector onto f = 0 by Newton steps along the gradient (central differences over `step`); f about a
/// distance near its zero.
std::function<Vector(const Vector&)> implicit_projector(std::function<double(const Vector&)> f,
                                                        double step = 1e-5);

}  // namespace innerspring
