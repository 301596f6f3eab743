#pragma once
#include "innerspring/body/body.h"

namespace innerspring {

/// An upper bound of the largest eigenvalue [1/s^2] of M^-1 H over every deformation of the body.
///
/// A spring's Hessian never exceeds k times the identity (k along it, k (1 - l/|d|) < k across), nor a moving
/// home's K_i, so H <= diag(K) + sum_e k_e (b_a - b_b)(b_a - b_b)^T. For the entry-wise absolute value B of
/// M^-1 times that matrix and any positive w, the largest eigenvalue is at most max_i (B w)_i / w_i
/// (Collatz-Wielandt; w = 1 is Gershgorin's bound); w is improved by power iteration, which never raises the
/// bound.
double largest_eigenvalue_bound(const Body& body, int iterations = 20);

/// Largest step [s] at which symplectic Euler is stable: 2 / sqrt(largest_eigenvalue_bound).
double largest_stable_step(const Body& body);

/// Sub-steps are kept to this share of the largest stable step, where the energy error of the fastest spring
/// stays small.
inline constexpr double step_safety = 0.5;

}  // namespace innerspring
