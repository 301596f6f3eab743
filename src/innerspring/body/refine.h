#pragma once
#include "innerspring/body/body.h"
#include "innerspring/mesh/subdivision.h"

namespace innerspring {

/// The mean stiffness of schemes A and B after refinement. Scheme C has none.
enum class MeanStiffness {
    recomputed,  ///< the mean of scheme C's K_i on the refined mesh (the study's A_total)
    kept         ///< that of the mesh before (A_node)
};

/// What restructure() changed beside the surface.
struct BodyChange {
    std::vector<Index> touched;                  ///< vertices with other mass, springs or edges; increasing
    std::vector<std::pair<Index, Index>> moved;  ///< (from, to), in this order: the last vertex took a place
    bool everywhere = false;                     ///< schemes A and B: the means changed at every vertex
    Index not_positive = no_index;               ///< a vertex whose mass or stiffness is not: undo it
};

/// Brings a body in line with a change that `history` made in body.rest, in place: edges, springs, and masses
/// by the formulas of build_body(), about the same centre and with the same mass. With local centres a new
/// vertex takes the mean L of its edge, which keeps every sum. Vertices that were retired are taken out, the
/// last ones moving into their places. Costs as much as the triangles that changed; in schemes A and B, whose
/// means belong to every vertex, as much as the body.
BodyChange restructure(Body& body, Subdivision& history, const SurfaceChange& change,
                       MeanStiffness mean = MeanStiffness::recomputed);

/// Room for so many more vertices, so that nothing has to move when they come.
void reserve(Body& body, std::size_t vertices);

/// The body with the named triangles refined (see mesh/refine.h) and re-estimated. In the plane only: on a
/// smooth surface the volume changes, and with it everything. Old vertices keep their index. Throws
/// InputError as refine() does, and where a virtual tetrahedron to be cut is not positive.
Body refined(const Body& body, std::span<const Index> triangles, int levels = 1,
             MeanStiffness mean = MeanStiffness::recomputed);

/// Throws InputError saying that a virtual tetrahedron at `place` is not positive, and what to do.
[[noreturn]] void refuse_refinement(const Body& body, const Vector& place);

}  // namespace innerspring
