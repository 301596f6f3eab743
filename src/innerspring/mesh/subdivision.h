#pragma once
#include <functional>

#include "innerspring/mesh/refine.h"

namespace innerspring {

/// What a refinement or its undoing did to a mesh's arrays. Only what is named here moved.
struct SurfaceChange {
    struct Slot {
        Index triangle;    ///< index in SurfaceMesh::triangles
        Triangle corners;  ///< vertex indices
    };
    struct Middle {
        Index vertex;
        Edge halves;  ///< the edge it halves
    };
    std::vector<Slot> removed;    ///< triangles as they were; a triangle that moved is both removed and added
    std::vector<Slot> added;      ///< triangles as they are now
    std::vector<Middle> created;  ///< new vertices, at the end of the positions; ends come first
    std::vector<Middle> retired;  ///< vertices that no triangle uses any more, still in the positions; those
                                  ///< on an edge whose end is retired too come first
};

/// How a closed surface came to be refined: a forest of triangles, each of whose trees begins with one of the
/// surface as it was, and the edges of all levels. It holds what undoing needs and finds neighbours of any
/// level at once, so that every change costs as much as the triangles that change.
///
/// A node is a triangle of some level: a leaf, shown in the mesh as itself or, if one of its edges is cut
/// from the other side, as two green triangles; or the parent of four red children. A leaf with two cut edges
/// would be split; an edge is cut at most once more than the triangle beside it (so a triangle can be split
/// only after a coarser neighbour).
class Subdivision {
  public:
    /// Of a surface as it stands. With Placement::pn, vertex normals are kept too. Throws InputError if an
    /// edge has not exactly two triangles.
    explicit Subdivision(const SurfaceMesh& mesh, Placement placement = Placement::in_plane);

    /// Room for so many more vertices without moving anything.
    void reserve(std::size_t vertices);

    /// Splits the named triangles of `mesh`, `levels` times, and what must be split with them.
    SurfaceChange split(SurfaceMesh& mesh, std::span<const Index> triangles, int levels);

    /// Takes back every split whose parent triangle is not to be kept, deepest first, as far as the triangles
    /// around it allow. Vertices no longer used are `retired`; take_out() them afterwards.
    using Keep = std::function<bool(const Vector&, const Vector&, const Vector&)>;
    SurfaceChange unsplit(SurfaceMesh& mesh, const Keep& keep);

    /// Vertex `from`, the last, takes the place of `to`, which is retired (or is `from` itself). The caller
    /// moves the position and the corners of triangles.
    void take_out(Index to, Index from);

    /// Takes back the last split.
    SurfaceChange undo_split(SurfaceMesh& mesh);

    /// How often the triangle of the first surface that this one lies in was split around it; the cut of a
    /// green one does not count.
    int depth(Index triangle) const;

    /// Triangles that are split now.
    std::size_t families() const { return families_.size(); }

  private:
    // Vertices are known by a number that never changes; index_ and number_ translate.
    struct EdgeRecord {
        Index a, b;                                       ///< numbers of its ends
        Index middle = no_index;                          ///< number of the vertex that halves it
        std::array<Index, 2> halves{no_index, no_index};  ///< at a, at b
        std::array<Index, 2> nodes{no_index, no_index};   ///< triangles of its own level at either side
        Index parent = no_index;                          ///< the edge of which it is a half
    };
    struct Node {
        Triangle corners;            ///< numbers
        std::array<Index, 3> edges;  ///< side k joins corners k and k+1
        Index parent = no_index;
        Index children = no_index;                       ///< the first of four; no_index: a leaf
        std::array<Index, 2> shown{no_index, no_index};  ///< triangles of the mesh
        std::uint8_t green = 3;                          ///< the side whose cut is shown; 3: none
        bool touched = false, dead = false, going = false;
    };

    bool leaf(Index node) const { return nodes_[node].children == no_index; }
    int cut_sides(Index node) const;
    Index across(Index edge, Index node) const;
    void touch(Index node);
    void attach(Index edge, Index node);
    void detach(Index edge, Index node);
    Index new_edge(Index a, Index b, Index parent);
    Index half_at(Index edge, Index corner) const;
    void halve(SurfaceMesh& mesh, Index edge, SurfaceChange& change);
    void split_node(SurfaceMesh& mesh, Index node, SurfaceChange& change);
    bool may_go(Index node) const;
    void unsplit_node(Index node, SurfaceChange& change);
    template <class Chosen>
    SurfaceChange unsplit_families(SurfaceMesh& mesh, std::size_t first, const Chosen& chosen);
    void close(SurfaceMesh& mesh, SurfaceChange& change);
    void show(SurfaceMesh& mesh, SurfaceChange& change);
    Vector middle(const SurfaceMesh& mesh, Index a, Index b, Index number);

    Placement placement_;
    std::vector<Node> nodes_;
    std::vector<EdgeRecord> edges_;
    std::vector<Index> index_;                                   ///< by number: index in the mesh
    std::vector<Index> number_;                                  ///< by index
    std::vector<Vector> normals_;                                ///< by number, for pn
    std::vector<Index> triangle_node_;                           ///< by triangle of the mesh
    std::vector<Index> families_;                                ///< split nodes, parents before children
    std::size_t families_before_ = 0;                            ///< the last split
    std::vector<Index> free_nodes_, free_edges_, free_numbers_;  ///< free_nodes_: firsts of four
    std::vector<Index> touched_, to_close_, dying_;              ///< of the change at hand
};

}  // namespace innerspring
