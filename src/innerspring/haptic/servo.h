#pragma once
#include <atomic>

#include "innerspring/haptic/coupling.h"
#include "innerspring/haptic/histogram.h"
#include "innerspring/haptic/mailbox.h"

namespace innerspring {

struct ServoOptions {
    double rate = 1000;      ///< [Hz], 30 to 4000
    double stiffness = 0;    ///< of the coupling [N/m]; 0: what is passive (coupling.h)
    double damping = -1;     ///< of the coupling [N s/m]; negative: the same
    bool controller = true;  ///< passivity controller; off only for experiments
    /// The watchdog acts where a body step comes later than after twice its usual period, which is measured,
    /// but not before this [s].
    double stall = 0.005;
    SafetyOptions safety;
};

/// What a servo has seen. Read it when the servo is at rest, or through Servo::progress().
struct ServoStatistics {
    std::uint64_t ticks = 0;
    Histogram period_error, work;  ///< |period - 1/rate|, time from wake to force sent
    std::uint64_t missed = 0;      ///< periods longer than 1.5 / rate
    std::uint64_t missed_by_us =
        0;                      ///< of those, where the work of the period before took longer than 1/rate
    std::uint64_t clamped = 0;  ///< forces made smaller by the guard after the first ramp
    std::uint64_t braked = 0;   ///< by the passivity controller
    std::uint64_t faults = 0;   ///< from well to not well
    std::uint64_t stalls = 0;   ///< of the body, where the watchdog acted
    double force_max = 0;       ///< [N]
    double observer_least = 0, observer_total = 0, observer_lent = 0;  ///< [J]
    double stiffness_max = 0;                                          ///< felt [N/m]
};

enum class ServoHealth { good, stalled, faulty, lost };

/// From the servo to the body and whoever looks, each period.
struct HandState {
    std::uint64_t tick = 0;
    double time = 0;                ///< ticks / rate [s]
    Pose pose;                      ///< device frame
    Vector proxy = Vector::Zero();  ///< device frame [m]
    Vector force = Vector::Zero();  ///< on the hand [N]
    unsigned buttons = 0;
    ServoHealth health = ServoHealth::good;
    bool finished = false;  ///< the device has no more to come
};

/// One period of the haptic loop: reads the device, feels the body's last local contact, sends a force. Knows
/// no clock and no thread: it does the same for the same input.
class Servo {
  public:
    /// The device must be open. Throws InputError for options that cannot be.
    Servo(Device& device, const ServoOptions& options);

    /// Never allocates, locks, logs or throws. False when the device has no more to come.
    bool tick() noexcept;

    /// The device was opened again after a loss.
    void recover() noexcept { recovered_.store(true, std::memory_order_release); }

    Mailbox<LocalContact>& contacts() { return contacts_; }  ///< the body writes
    Mailbox<HandState>& hands() { return hands_; }           ///< the body reads
    ServoStatistics& statistics() { return statistics_; }
    Mailbox<ServoStatistics>& progress() {
        return progress_;
    }  ///< its thread writes, about ten times a second
    const CouplingGains& gains() const { return gains_; }
    const ServoOptions& options() const { return options_; }
    const SafetyOptions& safety() const { return guard_.options(); }
    double period() const { return period_; }

  private:
    void send(const Vector& force, ServoHealth health) noexcept;
    void fail(ServoHealth health) noexcept;
    void begin_anew() noexcept;

    Device& device_;
    DeviceInfo info_;
    ServoOptions options_;
    double period_;
    CouplingGains gains_;
    ForceGuard guard_;
    ContactBlend blend_;
    GodObject god_object_;
    PassivityObserver observer_;
    Mailbox<LocalContact> contacts_;
    Mailbox<HandState> hands_;
    Mailbox<ServoStatistics> progress_;
    ServoStatistics statistics_;
    HandState hand_;
    ServoHealth health_ = ServoHealth::good;
    bool late(const LocalContact& contact, bool news) noexcept;

    std::uint64_t since_contact_ = 0;  ///< ticks
    double usual_ = 0;                 ///< mean period of the body's last 16 steps or so [s]
    int steps_ = 0;                    ///< in that mean
    double fade_ = 1;
    Vector last_proxy_ = Vector::Zero();
    std::uint64_t ramped_ = 0;  ///< ticks since the last restart
    std::atomic<bool> recovered_{false};
};

}  // namespace innerspring
