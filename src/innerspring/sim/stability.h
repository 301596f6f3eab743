#pragma once
#include "innerspring/body/refine.h"

namespace innerspring {

/// An upper bound of the largest eigenvalue [1/s^2] of M^-1 H over every deformation of the body.
///
/// A spring's Hessian never exceeds k times the identity (k along it, k (1 - l/|d|) < k across), nor a moving
/// home's K_i (of an anisotropic body: its largest eigenvalue), so H <= diag(K) + sum_e k_e (b_a - b_b)(b_a -
/// b_b)^T. For the entry-wise absolute value B of M^-1 times that matrix and any positive w, the largest
/// eigenvalue is at most max_i (B w)_i / w_i (Collatz-Wielandt; w = 1 is Gershgorin's bound). w is a few
/// power iterations from 1, which never raise the bound and make it a matter of each vertex's neighbourhood:
/// 4 bring it within 7 % of the best there is on every shape tried (20 within 1.5 %, none within 55 %).
struct StabilityBound {
    static constexpr int iterations = 4;
    double value = 0;                               ///< the bound [1/s^2]
    Index worst = 0;                                ///< the vertex that sets it
    std::vector<double> ratio;                      ///< per vertex: (B w)_i / w_i [1/s^2]
    std::array<std::vector<double>, iterations> w;  ///< per vertex, after each iteration, times powers of
    double scale = 1;                               ///< this power of two
    double stiffest = 1;                            ///< largest eigenvalue of K_i + N_i over K_i
};
StabilityBound stability_bound(const Body& body);

/// The same bound, to the same bits, after a refinement or its undoing; as costly as the change.
void update(StabilityBound& bound, const Body& body, const SurfaceChange& surface, const BodyChange& change);

/// Largest step [s] at which symplectic Euler is stable: 2 / sqrt(bound).
double largest_stable_step(const StabilityBound& bound);
inline double largest_stable_step(const Body& body) {
    return largest_stable_step(stability_bound(body));
}

/// Sub-steps are kept to this share of the largest stable step, where the energy error of the fastest spring
/// stays small.
inline constexpr double step_safety = 0.5;

}  // namespace innerspring
