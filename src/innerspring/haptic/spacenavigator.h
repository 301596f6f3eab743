#pragma once
#include <memory>

#include "innerspring/haptic/device.h"

namespace innerspring {

struct SpaceNavigatorOptions {
    std::string library;  ///< a path; empty: libspnav.so.0 where the system looks
    double rate = 1000;   ///< of the servo [Hz]
    double speed = 0.1;   ///< at full deflection, 350 counts as spacenavd gives them [m/s]
    double dead = 0.05;   ///< deflections below this share of the full one do nothing [1]
};

/// A 3Dconnexion SpaceNavigator or SpaceMouse by way of spacenavd. Its deflection is the velocity of the
/// tool; it feels nothing. The library is loaded by open(), and read in a thread of its own.
std::unique_ptr<Device> make_spacenavigator(const SpaceNavigatorOptions& options = {});

}  // namespace innerspring
