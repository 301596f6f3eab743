#pragma once
#include <functional>
#include <optional>

#include "innerspring/body/refine.h"
#include "innerspring/sim/loads.h"
#include "innerspring/sim/state.h"

namespace innerspring {

/// What a refinement of a moving body, or its undoing, changed. Mass and both momenta are the same before and
/// after, to rounding; so is the volume when refining (new vertices lie in their deformed triangles).
struct Transfer {
    SurfaceChange surface;  ///< which triangles went and came, which edge each new vertex halves
    BodyChange body;        ///< which vertices changed their index, and where the body changed
    double kinetic_change_j = 0;
    double elastic_change_j = 0;  ///< inner and surface springs; of a free body about its frame before
    double volume_change_m3 = 0;  ///< of the deformed body; only undoing changes it
};

/// Refines the named triangles of a moving body in place and re-estimates its masses and springs. New
/// vertices lie and move as the middle of their edge does; then a small rigid motion of the refined
/// part makes up for what the new masses changed in the momenta. Old vertices keep their index.
/// Costs as much as the triangles that change (schemes A and B: as the body; a free body: a look at every
/// vertex, for its frame). `history` is the body's, from Subdivision(body.rest). Throws InputError as
/// refine() does and where a virtual tetrahedron is not positive, with all as before but for the order of
/// triangles.
Transfer refine(Body& body, Subdivision& history, State& state, std::span<const Index> triangles,
                int levels = 1, MeanStiffness mean = MeanStiffness::recomputed);

/// Undoes refinement where `keep(corner, corner, corner)` of the parent triangle [m, at rest] does not hold,
/// as far as the triangles around it allow. Vertices that stay keep position and velocity but for a rigid
/// motion, as above. The last vertices take the indices of those that went: see Transfer::body.moved.
Transfer coarsen(Body& body, Subdivision& history, State& state, const Subdivision::Keep& keep,
                 MeanStiffness mean = MeanStiffness::recomputed);

/// Brings loads in line: patch forces are spread anew over the same radius, other forces on a vertex that
/// went act on the ends of its edge in halves, and a new vertex between two of one pin is pinned too.
void carry_over(Loads& loads, const Body& body, const Transfer& transfer);

/// Triangles around a vertex that have a corner within `radius` [m] at rest and a side longer than `longest`
/// [m]; costs as much as there are vertices within the radius.
std::vector<Index> coarse_triangles(const Body& body, Index vertex, double radius, double longest);

}  // namespace innerspring
