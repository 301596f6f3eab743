#pragma once
#include "innerspring/haptic/hand.h"
#include "innerspring/haptic/loop.h"
#include "innerspring/haptic/press_script.h"
#include "support/bodies.h"

namespace innerspring::support {

inline constexpr double dt = 0.005;

inline StepOptions stepping() {
    StepOptions options;
    options.dt = dt;
    return options;
}

/// A body, a ball and a simulated hand that presses it.
struct Rig {
    Body body;
    Loads loads{Vector::Zero(), {}, {}, {sphere_tool(0.3, {0, 0, 1.6})}};
    HandMapping mapping;
    LoopOptions options;
    std::vector<PosePoint> script;
    HandOptions hand;
    std::vector<RefineRule> refine;

    explicit Rig(const char* shape, double depth = 0.3) : Rig(make_body(shape), 0.3, depth) {}
    Rig(Body pressed, double radius, double depth) : body(std::move(pressed)) {
        loads.tools[0].radius = radius;
        const DeviceInfo info;
        const CouplingGains gains = passive_gains(info, 1e-3, 0);
        mapping = fit_mapping(body, loads.tools[0], info, gains.stiffness);
        PressScript press;
        press.depth = depth;
        script = press_script(body, loads.tools[0], mapping, press);
        options.realtime = false;
    }
    SimulatedHand device() const { return {script, options.servo.rate, hand}; }
    LoopReport run(Device& device) {
        Loads held = loads;
        BodySide side(body, held, 0, stepping(), mapping, refine);
        return run_haptic(side, dt, mapping, device, options);
    }
};

}  // namespace innerspring::support
