#pragma once
#include "innerspring/body/refine.h"
#include "innerspring/mesh/live_tree.h"

namespace innerspring {

/// Trees over a body's vertices and triangles at rest. They need no refitting as the body moves: contact asks
/// for what is near a tool in the frame of the homes, with all that vertices are away from home added to the
/// reach. They follow a change of the mesh at its own cost and are built anew where they degrade.
struct ContactTrees {
    LiveTree vertices, triangles;  ///< triangles: once they were asked for
    std::vector<double> longest;   ///< per triangle: side at rest [m]
    double largest = 0;            ///< at least the longest of all [m]
    double unit = 1;               ///< a power of two [m]
    std::int64_t sides = 0;        ///< sum of `longest` in units, rounded one by one: the same in any order

    bool empty() const { return vertices.nodes.empty(); }
    /// The mean of `longest`, rounded down to a number of so few bits that it seldom changes [m].
    double mean_side() const;
};

void build(ContactTrees& trees, const Body& body);
void need_triangles(ContactTrees& trees, const Body& body);
void adapt(ContactTrees& trees, const Body& body, const SurfaceChange& surface, const BodyChange& change);

}  // namespace innerspring
