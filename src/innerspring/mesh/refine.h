#pragma once
#include <functional>
#include <span>

#include "innerspring/mesh/topology.h"

namespace innerspring {

/// Where the vertex that halves an edge goes.
enum class Placement {
    in_plane,  ///< the middle of the edge: volume, area and all sums over triangles stay as they are
    pn         ///< the middle of the edge's cubic PN curve (Vlachos et al. 2001): smooth, changes the volume
};

inline constexpr int most_levels = 10;

struct RefineOptions {
    int levels = 1;  ///< each cuts the chosen triangles into four once more; 1 .. most_levels
    Placement placement = Placement::in_plane;
};

/// Triangles with a point within `radius` [m] of `point`, straight through space.
std::vector<Index> triangles_near(const SurfaceMesh& mesh, const Vector& point, double radius);

/// Triangles with a corner within `radius` [m] of `vertex` along the surface (fast marching, Kimmel & Sethian
/// 1998).
std::vector<Index> triangles_along(const SurfaceMesh& mesh, const Topology& topology, Index vertex,
                                   double radius);

/// Triangles with a corner within `rings` edges of `vertex`; 0: those at the vertex.
std::vector<Index> triangles_in_ring(const SurfaceMesh& mesh, const Topology& topology, Index vertex,
                                     int rings);

/// Triangles for which `chosen(corner, corner, corner)` holds.
std::vector<Index> triangles_where(
    const SurfaceMesh& mesh, const std::function<bool(const Vector&, const Vector&, const Vector&)>& chosen);

/// A refined surface. Old vertices keep their index; new vertex n (from old_vertices on) halves the edge
/// halves[n - old_vertices], whose ends come before it.
struct RefinedMesh {
    SurfaceMesh mesh;
    std::size_t old_vertices = 0;
    std::vector<Edge> halves;
    double volume_change_m3 = 0;  ///< exactly zero in_plane
};

/// Cuts the triangles named by index into four, `levels` times (red), and those beside them so that no edge
/// meets a vertex in its middle: a triangle with one cut edge into two (green), one with more into four. No
/// green triangle is ever cut again; where that is wanted its parent becomes red. So, in_plane, no angle
/// falls below atan(tan(alpha)/3), alpha the least before, whatever the levels: red triangles have their
/// parents' shape, and a median makes angles of cotangent 2 cot C + cot A <= 3 cot alpha with the sides it
/// starts between. Throws InputError: an edge without exactly two triangles, a triangle out of range, levels
/// out of range, more than 1e8 triangles.
RefinedMesh refine(const SurfaceMesh& mesh, std::span<const Index> triangles,
                   const RefineOptions& options = {});

/// The checks of refine(), for those who subdivide in place.
void require_refinable(const SurfaceMesh& mesh, std::span<const Index> triangles, int levels);

}  // namespace innerspring
