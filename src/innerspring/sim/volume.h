#pragma once
#include "innerspring/body/refine.h"
#include "innerspring/mesh/team.h"
#include "innerspring/sim/contact.h"
#include "innerspring/sim/newton.h"
#include "innerspring/sim/state.h"

namespace innerspring {

/// The neighbour after the one across `edge` in the fan around i, counter-clockwise from outside.
Index next_in_fan(const Body& body, Index i, Index edge);

/// The volume of the whole body as a property of its material (ours). For 0 < nu < 1/2 an energy
///     U = (kappa/2) (V - V_0)^2 / V_0,   kappa = 2 nu E / (3 (1 - 2 nu)),
/// V by Eq. 4: a pressure P = -kappa (V - V_0) / V_0 that pulls vertex i with P a_i, where
///     a_i = dV/dx_i = 1/6 sum over the triangles (i, j, k) at i of (x_j - x_i) x (x_k - x_i).
/// The a_i add up to no force and no torque. nu = 1/2: V = V_0, with P whatever that takes, a multiplier.
/// nu = 0, the paper: nothing.
class VolumeTerm {
  public:
    using Field = std::vector<Vector>;
    explicit VolumeTerm(const Body& body);

    /// Goes on with the body: as costly as the change, unless it was everywhere.
    void adapt(const BodyChange& change);

    bool active() const { return poisson_ > 0; }
    bool hard() const { return poisson_ == 0.5; }
    double rest_volume() const { return body_.volume; }
    double compliance() const { return compliance_; }  ///< V_0 / kappa [m^3/Pa]; 0 if hard

    /// V - V_0 [m^3] and a_i [m^2] at x; the same bits for any number of threads. The first call walks around
    /// every vertex.
    double find(const Field& x, Field& a, Team& team) const;

    /// The same in parts, after prepare(): a_i of the vertices [first, last). Returns their share of 18 V.
    double find(const Field& x, Field& a, std::size_t first, std::size_t last) const;
    void prepare() const;

    /// Minus the change of the force P a_i with x, by the vertices' motion p: out_i -= P da_i(p).
    void add_curvature(double P, const Field& x, const Field& p, const std::vector<bool>& fixed, Field& out,
                       Team& team) const;

  private:
    void walk_around(Index i) const;

    const Body& body_;
    double poisson_ = 0, compliance_ = 0;
    /// Beside Body::spokes: neighbours of a vertex, counter-clockwise; empty until they are asked for.
    mutable std::vector<Index> fan_;
    mutable std::vector<double> blocks_;
};

/// P [Pa] of a body at rest in `state`. Of a hard constraint: what balances springs, gravity and loads best,
/// the vertices weighted by 1/K, without those that are pinned or in `touched`.
double pressure(const Body& body, const Loads& loads, const State& state,
                std::span<const VertexContact> touched = {});

/// A minimum problem with the volume term in it: what Net's Phi, its gradient, its Hessian H and a
/// preconditioner M^-1 of that become. A hard constraint is an augmented Lagrangian,
///     U = -lambda (V - V_0) + rho (V - V_0)^2 / 2,  P = lambda - rho (V - V_0).
class VolumePart {
  public:
    using Field = std::vector<Vector>;
    explicit VolumePart(const Body& body) : term(body) {}
    VolumeTerm term;
    double lambda = 0;     ///< [Pa]
    double stiffness = 0;  ///< rho, or 1 / compliance [Pa/m^3]

    /// Returns the energy [J] and adds its gradient, where not fixed.
    double add_gradient(const Field& x, const std::vector<bool>& fixed, Field& g, Team& team);
    double pressure() const { return lambda - stiffness * excess; }
    double noise() const { return 1e-14 * std::abs(pressure()) * term.rest_volume(); }  ///< of the energy [J]

    /// Keeps a at x for what follows; `solve(r, z)` is z = M^-1 r, and returns r . z.
    template <class Solve>
    void linearise(const Field& x, const std::vector<bool>& fixed, Team& team, Solve&& solve) {
        x_ = x;
        excess = term.find(x, a, team);
        pressure_ = pressure();
        clear(fixed, a);
        response.resize(a.size());
        give = solve(a, response);
    }
    /// 1 / compliance, or for a hard constraint a rho that lets errors of V fall by so much with each new
    /// lambda.
    void stiffen(double fall) {
        stiffness = !term.hard() ? 1 / term.compliance() : give > 0 ? fall / give : 0;
    }
    /// q += stiffness a (a . p) - P da(p); returns what that adds to p . q.
    double add_product(const Field& p, const std::vector<bool>& fixed, Field& q, Team& team);
    /// z from M^-1 r to (M + stiffness a a^T)^-1 r (Sherman & Morrison 1950); returns what that adds to r .
    /// z.
    double correct(const Field& r, Field& z) const;

    double excess = 0;  ///< V - V_0 at the last place looked at [m^3]
    Field a;            ///< at the place of linearise() [m^2]
    Field response;     ///< M^-1 a
    double give = 0;    ///< a . M^-1 a
  private:
    static void clear(const std::vector<bool>& fixed, Field& a);
    Field x_, now_;
    double pressure_ = 0;  ///< at x_ [Pa]
};

}  // namespace innerspring
