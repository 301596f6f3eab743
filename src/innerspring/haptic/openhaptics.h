#pragma once
#include <memory>

#include "innerspring/haptic/device.h"

namespace innerspring {

struct OpenHapticsOptions {
    std::string device;   ///< as named in the vendor's setup; empty: the default one
    std::string library;  ///< a path; empty: libHD.so (hd.dll, HD.framework) where the system looks
    double damping =
        0.8;  ///< of device and lightest grip [N s/m]: the interface does not tell (ours, not measured)
    double mass = 0.045;  ///< apparent, at the tip [kg] (a Phantom Omni's, as its maker states)
};

/// A Phantom, Touch or another device of the OpenHaptics HD interface, whose library is loaded by open(). The
/// servo runs in the scheduler of that library.
std::unique_ptr<Device> make_openhaptics(const OpenHapticsOptions& options = {});

}  // namespace innerspring
