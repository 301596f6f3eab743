#pragma once
#include <vector>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

// Linear elasticity of the solid sphere under normal traction with an axis of symmetry, exactly: Lame's
// series in the form of Lur'e (Three-dimensional problems of the theory of elasticity, 1964). With s = r/R,
// for every n but 1 (which has a net force):
//     u_r = R (A (n+1)(n - 2 + 4 nu) s^(n+1) + B n s^(n-1)) P_n(cos theta)
//     u_theta = R (A (n + 5 - 4 nu) s^(n+1) + B s^(n-1)) dP_n/dtheta
//     sigma_rr = 2G (A (n+1)(n^2 - n - 2 - 2 nu) s^n + B n(n-1) s^(n-2)) P_n
//     sigma_rtheta = 2G (A (n^2 + 2n - 1 + 2 nu) s^n + B (n-1) s^(n-2)) dP_n/dtheta,  G = E/(2(1 + nu))

/// The part of the answer with P_n.
struct SphereMode {
    int n = 0;
    double A = 0, B = 0;
};

/// A solved sphere about the origin.
struct SphereSolution {
    double radius = 1;              ///< [m]
    double poisson = 0.5;           ///< nu; 1/2 is allowed
    Vector axis = Vector::UnitZ();  ///< theta is counted from here
    std::vector<SphereMode> modes;

    /// Displacement [m] at a point x [m], |x| <= R.
    Vector at(const Vector& x) const;
};

/// A and B for a traction p P_n outward, p [Pa], and none along the surface. n is not 1.
SphereMode sphere_mode(int n, double p, double young, double poisson);

/// Two caps of half angle `alpha` [rad] at the ends of the axis, each pressed inward by an even pressure
/// whose force along the axis is F [N]: p = F/(pi R^2 sin^2 alpha).
SphereSolution squeezed_sphere(double alpha, double F, double radius, double young, double poisson,
                               const Vector& axis = Vector::UnitZ());

/// u = C_n p R/E under p P_n at nu = 1/2 (docs/physics.md, law 4): 3n(2n+1)/(2(n-1)(2n^2+4n+3)).
double incompressible_mode(int n);

}  // namespace innerspring
