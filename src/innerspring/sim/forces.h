#pragma once
#include <Eigen/Core>
#include <span>

#include "innerspring/body/body.h"
#include "innerspring/mesh/team.h"
#include "innerspring/sim/loads.h"

namespace innerspring {

/// Where the homes are: h_i = R q_i + t. The identity for a held body.
struct HomeFrame {
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Vector t = Vector::Zero();
};

/// The frame that minimises the energy of the inner springs, sum_i K_i |x_i - R q_i - t|^2 / 2 (polar
/// decomposition); the identity for a held body. Then the inner springs exert no net force and no net torque.
/// For an anisotropic body that energy is sum_i r_i . (K_i + N_i) r_i / 2, r_i = R^T (x_i - t) - q_i, from
/// there on by Newton's method in the six numbers of the frame.
HomeFrame home_frame(const Body& body, Positions x, Team& team);

// Each force with its energy beside it; every force is minus the gradient of its energy. Forces are added to
// f [N], energies in [J].

/// Force of the inner spring of a vertex that is `u` away from its home [m]: -K_i u, and for an anisotropic
/// body -R N_i R^T u, N_i turning with the frame.
inline Vector inner_force(const Body& body, const HomeFrame& frame, std::size_t i, const Vector& u) {
    if (body.N.empty()) return -body.K[i] * u;
    if (!body.free) return -(body.K[i] * u + body.N[i] * u);
    const Vector local = frame.R.transpose() * u;
    return -(frame.R * (body.K[i] * local + body.N[i] * local));
}

/// sum_i u_i . (K_i + R N_i R^T) u_i / 2, u_i = x_i - h_i. The frame's own change does not matter to first
/// order, as the frame minimises this energy.
double inner_energy(const Body& body, const HomeFrame& frame, Positions x);
void add_inner_forces(const Body& body, const HomeFrame& frame, Positions x, std::span<Vector> f);

/// The part of an anisotropic body's inner springs that springs of K_i are not: sum_i u_i . R N_i R^T u_i
/// / 2. Adds its gradient to g where not `fixed` and returns the energy; the same bits for any number of
/// threads.
double add_deviation(const Body& body, const HomeFrame& frame, Positions x, const std::vector<bool>& fixed,
                     std::span<Vector> g, Team& team);
/// q_i += R N_i R^T p_i where not fixed; returns what that adds to p . q [J].
double multiply_deviation(const Body& body, const HomeFrame& frame, std::span<const Vector> p,
                          const std::vector<bool>& fixed, std::span<Vector> q, Team& team);
/// sum_i N_i [N/m].
Eigen::Matrix3d deviation_sum(const Body& body);

/// sum_e k_e (|x_a - x_b| - l_e)^2 / 2.
double surface_energy(const Body& body, Positions x);
void add_surface_forces(const Body& body, Positions x, std::span<Vector> f);

/// -sum_i m_i g . (x_i - q_i): zero in the rest position.
double gravity_energy(const Body& body, const Vector& gravity, Positions x);
void add_gravity(const Body& body, const Vector& gravity, std::span<Vector> f);

/// -sum over loads of w_i F(time) . (x_i - q_i).
double load_energy(const Body& body, const Loads& loads, double time, Positions x);
void add_loads(const Loads& loads, double time, std::span<Vector> f);

/// Force of the surface springs on vertex i: sum_j k_ij (1 - l_ij / |d|) d, d = x_j - x_i. Nothing from a
/// spring of no length, whose direction is not known.
inline Vector surface_force(const Body& body, const Vector* x, std::size_t i) {
    const Vector x_i = x[i];
    Vector f = Vector::Zero();
    for (const Spoke& spoke : body.spokes_of(i)) {
        const Vector d = x[spoke.neighbour] - x_i;
        const double length = d.norm();
        if (length > 0) f += spoke.k * (1 - spoke.rest / length) * d;
    }
    return f;
}

}  // namespace innerspring
