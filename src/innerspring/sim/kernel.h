#pragma once
#include "innerspring/sim/forces.h"

namespace innerspring {

/// Sums over weighted points at r moving at v, from which their rigid motion follows.
struct Moments {
    double w = 0;
    Vector x = Vector::Zero(), v = Vector::Zero(), xv = Vector::Zero();  ///< of w r, w v, w r x v
    Eigen::Matrix3d xx = Eigen::Matrix3d::Zero();                        ///< of w r r^T

    void add(double weight, const Vector& r, const Vector& velocity);
    Moments& operator+=(const Moments& other);
};

/// What one symplectic Euler step of length h reads and writes; x and x_out are different arrays.
struct KernelStep {
    const Body& body;
    HomeFrame frame;
    Vector gravity;          ///< [m/s^2]
    double h;                ///< [s]
    const Vector* external;  ///< per vertex [N], or null
    const Vector* x;
    const Vector* v;
    Vector* x_out;  ///< null: velocities only, as a pressure is to come
    Vector* v_out;
};

/// Rigid motion v(x) = linear + angular x (x - centre).
struct RigidMotion {
    Vector centre = Vector::Zero(), linear = Vector::Zero(), angular = Vector::Zero();
};

/// The rigid motion that has the moments v and xv, about their centre; it is also the one nearest to the
/// velocities. No rotation where all weight lies on a line.
RigidMotion rigid_motion(const Moments& moments);

/// Vertices [first, last) of a held body, the whole step:
///     v' = (v + h (F_i / m_i + g)) / (1 + h c_i / m_i),  x' = x + h v',
///     F_i = -K_i (x_i - h_i) + sum_j k_ij (1 - l_ij/|d|) d + f_i
/// with the damping taken implicitly, so that it can only help stability. Returns the first vertex that left
/// the numbers, or no_index.
///
/// Per vertex, six neighbours: 24 B each of x, v, q, x', v' (and f if any), 24 B of K, m, c, 8 B of row
/// start, 6 x 24 B of spokes: about 300 B from memory, and 6 x 24 B gathered from cache; 6 x 14 + 45 = 130
/// flops with 6 square roots and 6 divisions.
Index advance_held(const KernelStep& s, std::size_t first, std::size_t last);

/// The same without damping and without moving: v_out = v + h (F_i / m_i + g). For free bodies, whose damping
/// needs a sum in between.
Index accelerate(const KernelStep& s, std::size_t first, std::size_t last);

/// Second half for free bodies: v' = v_home + (v - v_home) / (1 + h c_i / m_i), x' = x + h v', on v_out in
/// place.
Index damp_and_move(const KernelStep& s, const RigidMotion& home, std::size_t first, std::size_t last);

/// The rigid motion nearest to the velocities v at the positions x, weighted by c_i / (1 + h c_i / m_i):
/// damping against it, as damp_and_move() does, changes neither momentum. h = 0 where the damping force is
/// c_i itself times what is left of v.
RigidMotion rigid_fit(const Body& body, double h, const Vector* x, const Vector* v, Team& team);

}  // namespace innerspring
