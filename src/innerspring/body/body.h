#pragma once
#include "innerspring/body/centre.h"
#include "innerspring/body/material.h"
#include "innerspring/mesh/topology.h"

namespace innerspring {

/// A: m_i = M/N, K_i = mean K.  B: m_i by Eqs. 1-2, K_i = mean K.  C: Eqs. 1-3, the paper's proposal.
/// The mean is that of scheme C's K_i on the mesh at hand.
enum class Scheme { A, B, C };

std::string_view to_string(Scheme scheme);
Scheme parse_scheme(std::string_view text);  ///< "A", "B" or "C", either case; throws InputError

struct BodyOptions {
    Scheme scheme = Scheme::C;
    CentreOption centre;
    bool free = false;  ///< false: homes stay at the rest positions; true: homes follow the body (R q_i + t)
};

/// Where a vertex keeps its spokes: Body::spokes[first .. first + count), with room to grow in place.
struct SpokeRow {
    Index first = 0;
    std::uint16_t count = 0, room = 0;
};

/// One surface spring seen from a vertex: what the step kernel reads per neighbour.
struct Spoke {
    double k;         ///< [N/m]
    double rest;      ///< [m]
    Index neighbour;  ///< vertex at the other end
    Index edge;       ///< index into Body::edges
};

/// A soft solid, constant during a step. SI units; arrays are per vertex unless said otherwise.
struct Body {
    SurfaceMesh rest;                                  ///< q_i [m], closed and outward oriented
    std::vector<Edge> edges;                           ///< a < b
    std::vector<std::array<Index, 2>> edge_triangles;  ///< per edge, in increasing order
    std::vector<std::array<Index, 3>> triangle_edges;  ///< per triangle, sides (0,1), (1,2), (2,0)
    Material material;                                 ///< resolved: mass and surface are concrete
    Scheme scheme = Scheme::C;
    Centre centre;
    bool free = false;
    double volume = 0;  ///< V at rest [m^3]
    double radius = 0;  ///< R = (3V/4pi)^(1/3) [m]

    double stiffness_sum = 0;  ///< sum of scheme C's K_i [N/m], of which A and B take the mean

    std::vector<double> L;     ///< distance to the vertex's centre [m]
    std::vector<double> m;     ///< mass [kg], Eqs. 1-2; all > 0
    std::vector<double> K;     ///< inner spring [N/m], Eq. 3; all > 0
    std::vector<Symmetric> N;  ///< anisotropic: the spring as a matrix is K_i I + N_i [N/m]; else empty
    std::vector<double> c;     ///< damping 2 zeta sqrt(K m) [N s/m]
    std::vector<double> k;     ///< per edge: surface spring [N/m], Van Gelder 1998
    std::vector<double> rest_length;  ///< per edge [m]
    std::vector<SpokeRow> rows;       ///< per vertex
    std::vector<Spoke> spokes;        ///< a vertex's are together, in increasing neighbour

    std::size_t vertices() const { return rest.positions.size(); }
    std::span<const Spoke> spokes_of(std::size_t i) const {
        return {spokes.data() + rows[i].first, rows[i].count};
    }
};

/// Estimates masses and springs of `mesh` from its own geometry. The mesh must be closed, manifold and
/// outward oriented. Throws InputError: unusable mesh (with the element), bad material, or a centre about
/// which some m_i or K_i is not positive (with the number of such vertices, the first, and what to ask for
/// instead).
Body build_body(SurfaceMesh mesh, const Material& material = {}, const BodyOptions& options = {});

/// `vertex` and those connected to it within `radius` [m], straight at rest: what lies behind a thin wall
/// does not count. Costs as much as they are many.
std::vector<Index> vertices_around(const Body& body, Index vertex, double radius);

/// c = 2 zeta sqrt(K m) [N s/m].
double damping(const Material& material, double m, double K);

/// k_e = E_s sum_{t at e} A_t / |e|^2 (Van Gelder 1998) and the rest length of one edge, from its triangles.
void set_surface_spring(Body& body, Index edge);

}  // namespace innerspring
