#pragma once
#include <algorithm>
#include <cstdint>

#include "innerspring/haptic/device.h"

namespace innerspring {

/// The body as the hand feels it until its next step, in the device's frame and the hand's units: a plane
/// that yields,
///     F = (k n . (s - p) - b n . p') n,   F . n >= 0,     on the tool at p.
struct LocalContact {
    Vector rest = Vector::Zero();     ///< s: where the force is zero [m]
    Vector normal = Vector::UnitZ();  ///< n: out of the body
    double stiffness = 0;             ///< k [N/m]; 0: nothing is touched
    double damping = 0;               ///< b [N s/m]
    double friction = 0;              ///< Coulomb's coefficient [1]
    double period = 0;                ///< until the next one is expected [s]
    std::uint64_t step = 0;           ///< number of the body step; 0: none yet
};

/// Virtual coupling (Colgate, Stanley & Brown 1995): k (x_proxy - x) + b (v_proxy - v).
struct CouplingGains {
    double stiffness = 0;  ///< k [N/m]
    double damping = 0;    ///< b [N s/m]
};

/// Colgate & Schenkel (1997): a sampled spring and damper are passive on a device of damping b_d if
///     b_d > K (T/2 + t_d) + b.
/// Gives the largest K the device, too, bears (times `share`), with b a quarter of what is left over.
CouplingGains passive_gains(const DeviceInfo& info, double period, double delay, double share = 0.8);

/// The largest K of that bound alone, with b = 0 [N/m].
double passive_limit(const DeviceInfo& info, double period, double delay);

struct CoupledForce {
    Vector force = Vector::Zero();  ///< on the hand [N]
    Vector proxy = Vector::Zero();  ///< where the tool is in the body [m]
    double stiffness = 0;           ///< felt: k_c k / (k_c + k) [N/m]; 0: free
    double energy = 0;              ///< in both springs [J]
};

/// What the body's spring holds with the tool at p [J].
double stored(const LocalContact& contact, const Vector& p) noexcept;

/// The god-object (Zilles & Salisbury 1995) on a plane that yields: a tool without mass between the coupling
/// and the body. Along n the two balance, over a period T by implicit Euler,
///     k_c (x - p) + k (s - p) - b (p - p_before) / T = 0,
/// and the body does not pull; across n it follows the hand
/// without friction, and with it stays where it was as long as the coupling pulls less than mu times the
/// normal force. The coupling's own damper acts along n on the share 1 - dp/dx of the hand's velocity, p'
/// being that of the balance at rest; it turns no force around.
class GodObject {
  public:
    /// Allocates nothing, keeps the last proxy.
    CoupledForce feel(const LocalContact& contact, const CouplingGains& gains, const Vector& x,
                      const Vector& v, double period) noexcept;
    const Vector& proxy() const noexcept { return proxy_; }
    void release() noexcept { touching_ = false; }

  private:
    bool touching_ = false;
    Vector proxy_ = Vector::Zero();
};

/// A change of the contact spread over the time until the next is expected, so that the hand feels no steps.
class ContactBlend {
  public:
    void aim(const LocalContact& target, double period) noexcept;
    const LocalContact& advance() noexcept;  ///< one servo period
    const LocalContact& now() const noexcept { return now_; }
    void forget() noexcept { now_ = target_ = LocalContact{}, left_ = 0; }

  private:
    LocalContact now_, target_;
    std::uint64_t left_ = 0;  ///< periods
};

/// Passivity observer and controller (Hannaford & Ryu 2002), with the energy as the motors give it: the force
/// is held over a period, so
///     E(n) = E(n-1) - F(n-1) . (x(n) - x(n-1))
/// is what the hand has put in and not got back. The controller looks one period ahead: the force F is
/// reduced to l F, where
///     l (F . v) T + l^2 |F|^2 T^2 / m <= E(n),
/// the second term being how far the force, and a hand that gives way as much, can drive the device's mass m.
/// It never adds to a force and never turns it. What is more than the springs could have stored has been lost
/// as heat and is not given back: E is held at cap(), so that a long quiet time is no credit for a later
/// fault. What the body itself does to a hand at rest (it sags onto the tool; the force comes back after a
/// fault) changes what the springs hold without the hand; that is lent to E, but no faster than a given
/// power.
class PassivityObserver {
  public:
    void observe(const Vector& x) noexcept;                                    ///< at the start of a period
    void cap(double energy) noexcept { energy_ = std::min(energy_, energy); }  ///< [J]
    /// The springs hold `change` [J] more, not by the hand; at most `most` [J] of what is owed is lent now.
    void lend(double change, double most) noexcept {
        owed_ = std::max(0.0, owed_ + change);
        const double now = std::min(owed_, most);
        owed_ -= now, energy_ += now, lent_ += now;
    }
    Vector limit(const Vector& force, const Vector& v, double period, double mass) const noexcept;
    void hold(const Vector& force) noexcept { held_ = force; }  ///< what was sent
    double energy() const noexcept { return energy_; }          ///< [J]
    double least() const noexcept { return least_; }            ///< [J]
    double total() const noexcept { return total_; }            ///< put in by the hand, without cap [J]
    double lent() const noexcept { return lent_; }              ///< [J]
    void restart() noexcept { started_ = false, energy_ = owed_ = 0, held_.setZero(); }

  private:
    bool started_ = false;
    Vector x_ = Vector::Zero(), held_ = Vector::Zero();
    double energy_ = 0, least_ = 0, total_ = 0, owed_ = 0, lent_ = 0;
};

struct SafetyOptions {
    double peak = 0;           ///< [N]; 0: the device's
    double continuous = 0;     ///< [N]; 0: the device's
    double heat_time = 10;     ///< of the motors [s]
    double rise = 0;           ///< of the force [N/s]; 0: to the peak in 20 ms
    double ramp = 0.5;         ///< from nothing to all at the start and after a fault [s]
    double fade = 0.005;       ///< to nothing when the body stalls, and back if it was for a moment [s]
    double body_power = 0.02;  ///< the body by itself does no more work on the hand than this [W]
};

/// What stands between a force and the motors, in this order: finite or zero; ramp; peak and continuous
/// clamp; slew. A force may fall as fast as it likes.
class ForceGuard {
  public:
    ForceGuard(const DeviceInfo& info, const SafetyOptions& options);
    /// `share`: of the watchdog's fade [1]. Sets clamped() if the force had to be made smaller.
    Vector pass(const Vector& force, double share, double period) noexcept;
    void sent(const Vector& force, double period) noexcept;  ///< what the motors got in the end
    void restart() noexcept { ramp_ = 0, last_.setZero(); }  ///< after a fault
    bool clamped() const noexcept { return clamped_; }
    const SafetyOptions& options() const noexcept { return options_; }

  private:
    SafetyOptions options_;
    double ramp_ = 0;  ///< [1]
    double heat_ = 0;  ///< mean of |F|^2 over heat_time [N^2]
    Vector last_ = Vector::Zero();
    bool clamped_ = false;
};

}  // namespace innerspring
