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

/// One surface spring seen from a vertex: what the step kernel reads per neighbour.
struct Spoke {
    double k;         ///< [N/m]
    double rest;      ///< [m]
    Index neighbour;  ///< vertex at the other end
    Index edge;       ///< index into Body::topology.edges
};

/// A soft solid, constant during a step. SI units; arrays are per vertex unless said otherwise.
struct Body {
    SurfaceMesh rest;  ///< q_i [m], closed and outward oriented
    Topology topology;
    Material material;  ///< resolved: mass and surface are concrete
    Scheme scheme = Scheme::C;
    Centre centre;
    bool free = false;
    double volume = 0;  ///< V at rest [m^3]
    double radius = 0;  ///< R = (3V/4pi)^(1/3) [m]

    std::vector<double> L;            ///< distance to the vertex's centre [m]
    std::vector<double> m;            ///< mass [kg], Eqs. 1-2; all > 0
    std::vector<double> K;            ///< inner spring [N/m], Eq. 3; all > 0
    std::vector<double> c;            ///< damping 2 zeta sqrt(K m) [N s/m]
    std::vector<double> k;            ///< per edge: surface spring [N/m], Van Gelder 1998
    std::vector<double> rest_length;  ///< per edge [m]
    std::vector<Index> spoke_start;   ///< vertices + 1
    std::vector<Spoke> spokes;        ///< grouped by vertex, in increasing neighbour

    std::size_t vertices() const { return rest.positions.size(); }
};

/// Estimates masses and springs of `mesh` from its own geometry. The mesh must be closed, manifold and
/// outward oriented. Throws InputError: unusable mesh (with the element), bad material, or a centre about
/// which some m_i or K_i is not positive (with the number of such vertices, the first, and what to ask for
/// instead).
Body build_body(SurfaceMesh mesh, const Material& material = {}, const BodyOptions& options = {});

}  // namespace innerspring
