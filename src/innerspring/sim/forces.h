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

/// The frame that minimises sum_i K_i |x_i - R q_i - t|^2 (polar decomposition); the identity for a held
/// body. Then the inner springs exert no net force and no net torque.
HomeFrame home_frame(const Body& body, Positions x, Team& team);

// Each force with its energy beside it; every force is minus the gradient of its energy. Forces are added to
// f [N], energies in [J].

/// sum_i K_i |x_i - h_i|^2 / 2. The frame's own change does not matter to first order, as the frame minimises
/// this energy.
double inner_energy(const Body& body, const HomeFrame& frame, Positions x);
void add_inner_forces(const Body& body, const HomeFrame& frame, Positions x, std::span<Vector> f);

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
