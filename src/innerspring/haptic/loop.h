#pragma once
#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "innerspring/haptic/body_side.h"
#include "innerspring/haptic/wrappers.h"

namespace innerspring {

struct LoopOptions {
    ServoOptions servo;
    double duration = 10;  ///< [s]; 0: until the device has no more, or stop
    /// One thread, no clock: servo periods and body steps in fixed turns, so that the same device gives the
    /// same forces to the bit.
    bool lockstep = false;
    bool realtime = true;     ///< ask for SCHED_FIFO and locked memory
    bool empty_loop = false;  ///< run a loop that does nothing beside, to see what the machine misses
    double reopen = 0.5;      ///< between attempts to open a lost device [s]
    std::string record;       ///< a file for poses and forces; empty: none
    std::function<void(std::uint64_t)> before_step;  ///< of the body: its number
    std::function<void(const HandState&, const Touch&)> after_step;
    std::function<void(const struct LoopReport&)> progress;  ///< about ten times a second, between body steps
    const std::atomic<bool>* stop = nullptr;
};

struct LoopReport {
    ServoStatistics servo;
    DeviceInfo device;
    CouplingGains gains;
    HandMapping mapping;
    double rate_hz = 0;  ///< of the servo, measured
    double seconds = 0;
    std::uint64_t body_steps = 0;
    double body_steps_per_second = 0;
    double body_time = 0;  ///< [s] the body went on: less than `seconds` if it cannot keep up
    Histogram body_work;
    int body_resets = 0;
    std::size_t vertices = 0;        ///< of the body, now
    int refinements = 0;             ///< of its mesh, and undoings
    std::uint64_t missed_empty = 0;  ///< by the empty loop
    bool has_empty = false;
    std::uint64_t reopened = 0, lost_samples = 0;  ///< samples a recording had no room for
    std::vector<std::string> notes;                ///< what was not granted, what went wrong
    std::string failure;                           ///< the device is gone and did not come back
};

/// Opens nothing: the device must be open (mapping and coupling depend on it), and is open or closed after.
/// The body steps in the calling thread, at its dt by the clock or as fast as it can; the servo in its own,
/// or in the device's. Throws InputError for options that cannot be.
LoopReport run_haptic(BodySide& body, double dt, const HandMapping& mapping, Device& device,
                      const LoopOptions& options);

/// Keys: rate_hz, period_error_ms{p50,p99,p99_9,max}, work_ms{...}, missed, clamped, observer_energy_min_j,
/// force_max_n, body_steps_per_second, and more (docs/formats.md).
std::string to_json(const LoopReport& report);

}  // namespace innerspring
