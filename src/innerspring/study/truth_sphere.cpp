#include "innerspring/study/truth_sphere.h"

#include <cmath>
#include <numbers>

namespace innerspring {

namespace {

/// The pole's displacement is known to about 1e-5 of itself for caps of 0.1 rad: the terms fall as n^-2.5.
constexpr int squeeze_terms = 1000;

}  // namespace

Vector SphereSolution::at(const Vector& x) const {
    const double r = x.norm();
    if (r == 0) return Vector::Zero();  // by symmetry: there is no mode 1
    const Vector outward = x / r;
    const double c = outward.dot(axis), sine = axis.cross(outward).norm(), s = r / radius;
    double radial = 0, along = 0;
    double before = 1, P = c;  // P_0, P_1
    int k = 1;                 // P = P_k, before = P_(k-1)
    for (const SphereMode& m : modes) {
        for (; k < m.n; ++k) {
            const double next = ((2 * k + 1) * c * P - k * before) / (k + 1);  // Bonnet
            before = P;
            P = next;
        }
        const double n = m.n, P_n = m.n == 0 ? 1 : P;
        // dP_n/dtheta = -n (P_(n-1) - c P_n)/sin theta; it vanishes on the axis.
        const double slope = m.n == 0 || sine < 1e-12 ? 0 : -n * (before - c * P) / sine;
        const double high = std::pow(s, n + 1), low = m.n == 0 ? 0 : std::pow(s, n - 1);
        radial += (m.A * (n + 1) * (n - 2 + 4 * poisson) * high + m.B * n * low) * P_n;
        along += (m.A * (n + 5 - 4 * poisson) * high + m.B * low) * slope;
    }
    // theta grows away from the axis.
    const Vector away = sine < 1e-12 ? Vector(Vector::Zero()) : Vector((c * outward - axis) / sine);
    return radius * (radial * outward + along * away);
}

SphereMode sphere_mode(int n, double p, double young, double poisson) {
    const double d = n, shear = young / (2 * (1 + poisson));
    const double rr_A = (d + 1) * (d * d - d - 2 - 2 * poisson), rr_B = d * (d - 1);
    const double rt_A = d * d + 2 * d - 1 + 2 * poisson, rt_B = d - 1;
    if (n == 0) return {0, p / (2 * shear) / rr_A, 0};
    // rr_A A + rr_B B = p/2G,  rt_A A + rt_B B = 0
    const double A = p / (2 * shear) / (rr_A - rr_B * rt_A / rt_B);
    return {n, A, -A * rt_A / rt_B};
}

SphereSolution squeezed_sphere(double alpha, double F, double radius, double young, double poisson,
                               const Vector& axis) {
    const double c = std::cos(alpha),
                 p = F / (std::numbers::pi * radius * radius * std::sin(alpha) * std::sin(alpha));
    SphereSolution solution{radius, poisson, axis, {}};
    solution.modes.push_back(sphere_mode(0, -p * (1 - c), young, poisson));
    // The even pressure on both caps is the sum of p_n P_n, n even, p_n = P_(n-1)(c) - P_(n+1)(c).
    double before = 1, P = c;
    for (int n = 1; n < squeeze_terms; ++n) {
        const double next = ((2 * n + 1) * c * P - n * before) / (n + 1);
        if (n % 2 == 0) solution.modes.push_back(sphere_mode(n, -p * (before - next), young, poisson));
        before = P;
        P = next;
    }
    return solution;
}

double incompressible_mode(int n) {
    const double d = n;
    return 3 * d * (2 * d + 1) / (2 * (d - 1) * (2 * d * d + 4 * d + 3));
}

}  // namespace innerspring
