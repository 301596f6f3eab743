#pragma once
#include <memory>

#include "innerspring/haptic/device.h"

namespace innerspring {

/// The library does not tell what a device bears; the defaults are below an omega.3's data sheet (12 N,
/// 14.5 N/mm), and its damping and mass are assumed, not measured.
struct ForceDimensionOptions {
    std::string library;                              ///< a path; empty: libdhd.so.3 where the system looks
    double max_force = 10, max_continuous_force = 5;  ///< [N]
    double max_stiffness = 3000;                      ///< [N/m]
    double damping = 1, mass = 0.2;                   ///< of device and lightest grip [N s/m], [kg]
    Box workspace{Vector(-0.06, -0.06, -0.04), Vector(0.06, 0.06, 0.04)};  ///< right, up, to the user [m]
};

/// An omega, delta, sigma or Falcon by the DHD interface, whose library is loaded by open(). The caller keeps
/// the time.
std::unique_ptr<Device> make_forcedimension(const ForceDimensionOptions& options = {});

}  // namespace innerspring
