#pragma once
#include "innerspring/haptic/body_side.h"

namespace innerspring {

/// What a simulated hand does: it comes from outside, presses, holds, slides, and goes; again and again.
struct PressScript {
    Vector direction = -Vector::UnitZ();  ///< of the press, scene
    double depth = 0.2;   ///< the hand wants to go this far beyond the surface, of the body's radius [1]
    double slide = 0.1;   ///< across, of the body's radius [1]
    double period = 4;    ///< [s]: 1/4 in, 1/4 held, 1/4 across and back, 1/4 out and at rest
    double duration = 4;  ///< [s]
};

/// In the device's frame, at 100 points a second with smooth starts and ends. The press is at the surface's
/// farthest point against the direction.
std::vector<PosePoint> press_script(const Body& body, const Tool& tool, const HandMapping& mapping,
                                    const PressScript& script);

}  // namespace innerspring
