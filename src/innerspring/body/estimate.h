#pragma once
#include "innerspring/body/body.h"

namespace innerspring {

struct Quartiles {
    double min = 0, lower = 0, median = 0, upper = 0, max = 0;
};
Quartiles quartiles(std::vector<double> values);

/// The groups on which the answer depends; F is the force of interest. Written beside every result.
struct Groups {
    double weight = 0;   ///< M g / (E R^2)
    double surface = 0;  ///< E_s / (E R)
    double force = 0;    ///< F / (E R^2)
};
Groups dimensionless_groups(const Body& body, double gravity_m_s2, double force_n);

/// What build_body() found, summed up.
struct Estimate {
    Quartiles m, K, k, L;      ///< kg, N/m, N/m, m
    double mass_sum = 0;       ///< sum of m_i [kg]; M in every scheme
    double stiffness_sum = 0;  ///< sum of K_i [N/m]
    double stiffness_theory =
        0;  ///< the integral of E/L over the area, sum E A_i / L_i [N/m]; 4 pi E R on a sphere
    Vector mass_shift = Vector::Zero();  ///< centre of the masses minus the volume centroid [m]; Eq. 2 gives
                                         ///< less to the farther vertex
    double sag = 0;                      ///< M g R^2 / (3 V E) [m]: law 1
};
Estimate estimate(const Body& body, double gravity_m_s2 = 9.81);

}  // namespace innerspring
