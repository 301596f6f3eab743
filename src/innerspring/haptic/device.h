#pragma once
#include <string>

#include "innerspring/mesh/bvh.h"
#include "innerspring/mesh/error.h"
#include "innerspring/sim/tool.h"

namespace innerspring {

/// What a device says of itself, in its own frame and units of the hand (metres, newtons).
struct DeviceInfo {
    std::string name;
    Box workspace{Vector::Constant(-0.08), Vector::Constant(0.08)};  ///< usable [m]
    double max_force = 7.9;                                          ///< peak [N]
    double max_continuous_force = 1.75;                              ///< for minutes [N]
    double max_stiffness = 1000;                                     ///< it bears without buzzing [N/m]
    double max_damping = 5;                                          ///< virtual [N s/m]
    double damping =
        0.8;             ///< of device and the lightest grip together [N s/m]: what Colgate's bound rests on
    double mass = 0.05;  ///< apparent, at the tip, at least [kg]
    int input_dof = 6, output_dof = 3;
};

struct DeviceSample {
    double time = 0;                   ///< [s] since open()
    Pose pose;                         ///< [m], device frame
    Vector velocity = Vector::Zero();  ///< [m/s]
    unsigned buttons = 0;              ///< a bit each
};

/// A device could not be opened, or does not answer; one line saying what was looked for and where.
struct DeviceError : RunError {
    using RunError::RunError;
};

/// Why read() or write() said no. Warnings pass by themselves; after a loss only open() helps.
enum class DeviceFault { none, warning, lost };

/// Called in each servo period; false ends the loop.
using ServoTick = bool (*)(void* context) noexcept;

/// Something held in the hand that knows where it is and can push. The only base class of the project: who
/// adds a device writes these functions (docs/haptics.md). read(), write() and fault() are the servo path:
/// they neither allocate, lock, log nor throw.
class Device {
  public:
    virtual ~Device() = default;
    virtual void open() = 0;  ///< again after close(); throws DeviceError
    virtual void close() noexcept = 0;
    virtual const DeviceInfo& info() const = 0;  ///< filled in by open()

    virtual bool read(DeviceSample& sample) noexcept = 0;
    virtual bool write(const Vector& force) noexcept = 0;  ///< [N] on the hand, device frame
    virtual DeviceFault fault() const noexcept { return DeviceFault::none; }  ///< of the last period
    virtual std::string fault_text() const { return {}; }  ///< what it was, for people; not on the servo path

    /// Devices with a clock of their own call tick(context) at `rate` [Hz] until stop(); the others return
    /// false, and the caller keeps time.
    virtual bool start(double /*rate*/, ServoTick, void* /*context*/) { return false; }
    virtual void stop() noexcept {}

    /// No more to come (the end of a replay).
    virtual bool finished() const noexcept { return false; }
};

}  // namespace innerspring
