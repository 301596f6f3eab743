#pragma once
#include "innerspring/sim/loads.h"
#include "innerspring/sim/state.h"

namespace innerspring {

/// One row of the series.
struct Measures {
    double time = 0;                            ///< [s]
    double volume = 0;                          ///< Eq. 4 [m^3]
    double volume_variation_percent = 0;        ///< 100 (V/V_0 - 1)
    double kinetic = 0;                         ///< [J]
    double elastic = 0;                         ///< inner and surface springs, volume term [J]
    double potential = 0;                       ///< gravity and loads, zero at the rest position [J]
    double max_displacement = 0;                ///< largest |x_i - q_i| [m]
    Vector mean_displacement = Vector::Zero();  ///< [m]
    Vector std_displacement = Vector::Zero();   ///< per axis [m]
    double pressure = 0;                        ///< of the volume term [Pa]; see pressure()
    std::vector<double> force;                  ///< per load: |force| now [N]
    std::vector<Vector> tool_force;             ///< on each tool [N]: not measure()'s to know, zero
};

Measures measure(const Body& body, const Loads& loads, const State& state);

}  // namespace innerspring
