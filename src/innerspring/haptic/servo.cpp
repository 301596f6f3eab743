#include "innerspring/haptic/servo.h"

#include <fmt/format.h>

#include <cmath>

namespace innerspring {

namespace {

bool sound(const LocalContact& c) {
    return c.rest.allFinite() && std::abs(c.normal.squaredNorm() - 1) < 1e-6 && c.stiffness >= 0 &&
           std::isfinite(c.stiffness) && c.damping >= 0 && std::isfinite(c.damping) && c.friction >= 0 &&
           std::isfinite(c.friction) && c.period >= 0 && std::isfinite(c.period);
}

bool sound(const DeviceSample& s) {
    return s.pose.position.allFinite() && s.velocity.allFinite() && s.pose.rotation.coeffs().allFinite();
}

}  // namespace

Servo::Servo(Device& device, const ServoOptions& options)
    : device_(device),
      info_(device.info()),
      options_(options),
      period_(1 / options.rate),
      guard_(info_, options.safety) {
    const ServoOptions& o = options_;
    const auto refuse = [](const std::string& what) { throw InputError("haptic: " + what); };
    if (!(o.rate >= 30 && o.rate <= 4000))
        refuse(fmt::format("the rate is {:g} Hz; it must be 30 to 4000", o.rate));
    if (!(o.stiffness >= 0 && std::isfinite(o.stiffness)))
        refuse(fmt::format("the coupling stiffness is {:g} N/m; it must be finite and not negative",
                           o.stiffness));
    if (!std::isfinite(o.damping)) refuse("the coupling damping must be finite");
    if (!(o.stall > 0 && std::isfinite(o.stall))) refuse("the stall time must be positive and finite");
    const SafetyOptions& s = o.safety;
    for (const double each : {s.peak, s.continuous, s.rise, s.ramp, s.fade})
        if (!(each >= 0 && std::isfinite(each))) refuse("safety limits must be finite and not negative");
    if (!(s.heat_time > 0 && std::isfinite(s.heat_time))) refuse("the heat time must be positive and finite");
    if (!(info_.max_force > 0 && info_.max_continuous_force > 0 && info_.max_stiffness > 0 &&
          info_.damping >= 0 && info_.mass > 0))
        throw DeviceError(fmt::format("{}: says it bears no force or no stiffness", info_.name));
    gains_ = passive_gains(info_, period_, 0);
    if (o.stiffness > 0) gains_.stiffness = o.stiffness;
    if (o.damping >= 0) gains_.damping = o.damping;
    if (!(gains_.stiffness > 0))
        refuse("no stiffness is passive on a device without damping; give the coupling stiffness");
}

void Servo::begin_anew() noexcept {
    guard_.restart();
    god_object_.release();
    observer_.restart();
    ramped_ = 0;
}

void Servo::send(const Vector& force, ServoHealth health) noexcept {
    Vector got = force;
    if (!device_.write(force)) {  // what the motors made of it is not known: nothing, and from the start
        device_.write(Vector::Zero());
        got.setZero();
        begin_anew();
        if (health == ServoHealth::good || health == ServoHealth::stalled)
            health = device_.fault() == DeviceFault::lost ? ServoHealth::lost : ServoHealth::faulty;
    }
    if (health != health_ && health != ServoHealth::good)
        ++(health == ServoHealth::stalled ? statistics_.stalls : statistics_.faults);
    health_ = health;
    observer_.hold(got);
    guard_.sent(got, period_);
    ServoStatistics& s = statistics_;
    s.force_max = std::max(s.force_max, got.norm());
    s.observer_least = observer_.least(), s.observer_total = observer_.total();
    s.observer_lent = observer_.lent();
    hand_.tick = ++s.ticks;
    hand_.time = double(s.ticks) * period_;
    hand_.force = got;
    hand_.health = health;
    hand_.finished = device_.finished();
    hands_.send(hand_);
}

void Servo::fail(ServoHealth health) noexcept {
    begin_anew();
    blend_.forget();
    send(Vector::Zero(), health);
}

/// The watchdog: whether no step of the body has come for too long. What a step may take depends on the body
/// (30 Hz and 1 kHz are both right), so it is held against the mean of those before.
bool Servo::late(const LocalContact& contact, bool news) noexcept {
    if (contact.step == 0) return false;
    ++since_contact_;
    const double silent = double(since_contact_) * period_;
    if (!news) return silent > std::max(options_.stall, 2 * usual_) + 0.5 * period_;
    constexpr double most = 0.1;  // [s]: a stall is not usual
    const double took = std::min(steps_ > 0 ? silent : contact.period, most);
    steps_ = std::min(steps_ + 1, 16);
    usual_ += (took - usual_) / steps_;
    since_contact_ = 0;
    return false;
}

bool Servo::tick() noexcept {
    if (recovered_.exchange(false, std::memory_order_acq_rel)) begin_anew();
    const bool news = contacts_.update();
    DeviceSample sample;
    const bool heard = device_.read(sample);
    if (!heard || device_.fault() != DeviceFault::none || !sound(sample)) {
        fail(device_.fault() == DeviceFault::lost ? ServoHealth::lost : ServoHealth::faulty);
        return !hand_.finished;
    }
    const Vector& x = sample.pose.position;
    hand_.pose = sample.pose;
    hand_.buttons = sample.buttons;
    hand_.proxy = x;

    const LocalContact& contact = contacts_.latest();
    if (!sound(contact)) {
        fail(ServoHealth::faulty);
        return !hand_.finished;
    }
    if (news) blend_.aim(contact, period_);
    const bool stalled = late(contact, news);
    const double fade_step = guard_.options().fade > 0 ? period_ / guard_.options().fade : 1;
    if (stalled) {
        fade_ -= fade_step;
        if (fade_ < 1e-9) fade_ = 0;  // steps that do not sum to one are no reason to wait
    } else if (fade_ > 0) {           // it was for a moment
        fade_ = std::min(1.0, fade_ + fade_step);
    } else {  // back: ramp up as at the start
        fade_ = 1;
        guard_.restart();
        ramped_ = 0;
    }

    observer_.observe(x);
    const double before = ramped_ == 0 ? 0 : stored(blend_.now(), god_object_.proxy());
    const LocalContact& now = blend_.advance();
    const CoupledForce coupled = god_object_.feel(now, gains_, x, sample.velocity, period_);
    // What the body's spring gained while the tool stood still, the hand has not put in.
    const double after = ramped_ == 0 ? coupled.energy : stored(now, last_proxy_);
    observer_.lend(after - before, guard_.options().body_power * period_);
    last_proxy_ = hand_.proxy = coupled.proxy;
    // Springs that stiffen as they are pressed, F ~ d^2, hold 4/3 of what their tangent says; four times it
    // leaves room.
    observer_.cap(4 * coupled.energy);

    Vector force = guard_.pass(coupled.force, fade_, period_);
    if (guard_.clamped() && double(ramped_) * period_ > guard_.options().ramp) ++statistics_.clamped;
    ++ramped_;
    if (options_.controller) {
        const Vector limited = observer_.limit(force, sample.velocity, period_, info_.mass);
        statistics_.braked += limited.squaredNorm() < force.squaredNorm() * (1 - 1e-9);
        force = limited;
    }
    if (stalled && fade_ == 0) force.setZero();
    statistics_.stiffness_max = std::max(statistics_.stiffness_max, coupled.stiffness);
    send(force, stalled ? ServoHealth::stalled : ServoHealth::good);
    return !hand_.finished;
}

}  // namespace innerspring
