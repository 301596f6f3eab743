#pragma once
#include "innerspring/mesh/topology.h"

namespace innerspring {

// What check() reports and repair() acts on.

/// What is wrong with a triangle by itself. repair() drops all but `none` and `flat`.
enum class Flaw : std::uint8_t {
    none,
    degenerate,  ///< a vertex twice, or no area and not needed to keep the surface closed
    flat,        ///< no area, but the surface would be open without it
    duplicate,   ///< the same vertices as an earlier triangle
    folded       ///< back to back with another triangle, enclosing nothing
};

/// One per triangle. Of triangles with the same vertices, as many as face opposite ways cancel and the first
/// of the others stays. If all cancel, they are `folded`, unless they are the sole cover of their place in
/// the surface (a surface doubled by its reverse): then the first stays and the others are `duplicate`.
std::vector<Flaw> find_flaws(Positions x, Triangles triangles);

/// Triangles that hang together across edges of exactly two triangles.
struct Piece {
    Index first = 0;  ///< its first triangle
    Index triangles = 0;
    Index against = 0;       ///< how many face against the majority
    bool closed = true;      ///< every edge has exactly two triangles
    bool one_sided = false;  ///< no orientation is consistent (a Moebius strip, a Klein bottle)
    bool nested = false;     ///< lies inside an odd number of other closed pieces
    double volume = 0;       ///< [m^3] as the majority faces
};

struct Pieces {
    std::vector<Piece> pieces;          ///< by first triangle
    std::vector<Index> piece_of;        ///< per triangle
    std::vector<std::uint8_t> against;  ///< per triangle: 1 if it faces against the majority of its piece
};

Pieces find_pieces(Positions x, Triangles triangles, const Topology& topology);

/// True if `p` should be turned round as a whole.
inline bool inside_out(const Piece& p) {
    return p.closed && !p.one_sided && !p.nested && p.volume < 0;
}

/// `t` seen from the other side.
inline Triangle reversed(const Triangle& t) {
    return {t[0], t[2], t[1]};
}

/// The triangles as repair() would turn them.
std::vector<Triangle> oriented(Triangles triangles, const Pieces& pieces);

/// Parts that have no edge in common; per part its first triangle, in increasing order.
std::vector<Index> component_starts(Triangles triangles, const Topology& topology);

/// Vertices whose triangles do not hang together across edges at the vertex (two cones tip to tip), in
/// increasing order.
std::vector<Index> non_manifold_vertices(Triangles triangles, const Topology& topology);

}  // namespace innerspring
