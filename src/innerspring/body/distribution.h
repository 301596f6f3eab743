#pragma once
#include "innerspring/body/centre.h"

namespace innerspring {

/// What Eqs. 1-3 distribute, for one choice of centre.
struct Distribution {
    std::vector<double> L;    ///< per vertex: distance to its centre [m]
    std::vector<double> V_t;  ///< per triangle: virtual tetrahedron [m^3]; sums to V
    std::vector<double> m;    ///< per vertex, for M = 1 kg: Eqs. 1-2 [1]
    std::vector<double> K;    ///< per vertex, for E = 1 Pa: Eq. 3 [m]
    double scale = 1;         ///< s of distribute_locally()
};

/// Virtual tetrahedron [m^3] under a triangle: about one centre (q_i-c).((q_j-c)x(q_k-c))/6, locally
/// s A_t mean(L)/3.
double virtual_tetrahedron(const Centre& centre, Positions q, std::span<const double> L, const Triangle& t);

/// C_i^t = (L_t - L_i) / (2 L_t), which sums to 1 over a triangle (Eq. 2).
inline double share(double L_t, double L_i) {
    return (L_t - L_i) / (2 * L_t);
}

/// About one centre: L_i = |q_i - c|, V_t = (q_i-c).((q_j-c)x(q_k-c))/6.
Distribution distribute_about(const SurfaceMesh& mesh, const Vector& centre);

/// Each vertex about its medial ball: L_i its radius, V_t = s A_t mean(L)/3 with one s so that the V_t sum to
/// V. All positive. s is 1 on a sphere and 3 in a slab, whose columns do not taper; K_i is then s times the
/// column E A_i / L_i.
Distribution distribute_locally(const SurfaceMesh& mesh);

/// The vertex least positive in m_i or K_i, measured against a spring of full height: the smaller of K_i L_i
/// / A_i and 3 m_i V / (A_i L_i) (both 1 on a sphere about its centre).
struct LeastPositive {
    double value;       ///< the least
    Index vertex;       ///< where
    std::size_t count;  ///< vertices with m_i <= 0 or K_i <= 0
};
LeastPositive least_positive(const SurfaceMesh& mesh, const Distribution& d);

}  // namespace innerspring
