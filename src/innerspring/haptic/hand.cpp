#include "innerspring/haptic/hand.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "innerspring/mesh/random.h"

namespace innerspring {

SimulatedHand::SimulatedHand(std::vector<PosePoint> script, double rate, const HandOptions& options)
    : period_(1 / rate), options_(options) {
    script_.name = "hand script", script_.radius = 1;
    script_.path = std::move(script);
    require_valid(script_);
    const auto refuse = [](const char* what) { throw InputError(fmt::format("simulated hand: {}", what)); };
    if (!(rate > 0 && std::isfinite(rate))) refuse("the rate must be positive and finite");
    const HandOptions& o = options_;
    if (!(o.mass > 0 && std::isfinite(o.mass))) refuse("mass must be positive and finite [kg]");
    for (double each : {o.stiffness, o.damping, o.friction, o.grip, o.tremor})
        if (!(each >= 0 && std::isfinite(each)))
            refuse("stiffness, damping, friction, grip and tremor must be finite and not negative");
    if (o.substeps < 1) refuse("at least one sub-step is needed");
    // Semi-implicit Euler of the hand alone: stable for h (k h + b) < 2 m or so.
    const double h = period_ / o.substeps;
    if (h * (o.stiffness * h + 2 * (o.damping + o.friction)) > 2 * o.mass)
        refuse("too stiff for its sub-steps; take more mass, more sub-steps or a higher rate");
    info_.name = "simulated hand";
    info_.damping = o.friction;
    info_.mass = o.mass;
    Random random(o.seed);
    for (int n = 0; n < 3; ++n)
        for (int axis = 0; axis < 3; ++axis) {
            tremor_hz_[n][axis] = random.uniform(8, 12);
            tremor_phase_[n][axis] = random.uniform(0, 2 * std::numbers::pi);
        }
    SimulatedHand::open();
}

void SimulatedHand::open() {
    ticks_ = 0;
    x_ = want_ = wanted(0);
    v_.setZero();
}

Vector SimulatedHand::wanted(double time) const noexcept {
    Vector x = pose_at(script_, time).position;
    if (options_.tremor > 0)
        for (int n = 0; n < 3; ++n)
            for (int axis = 0; axis < 3; ++axis)
                x[axis] +=
                    options_.tremor / 3 *
                    std::sin(2 * std::numbers::pi * tremor_hz_[n][axis] * time + tremor_phase_[n][axis]);
    return x;
}

bool SimulatedHand::read(DeviceSample& sample) noexcept {
    sample = {time(), {x_, pose_at(script_, time()).rotation}, v_, 0};
    return true;
}

bool SimulatedHand::write(const Vector& force) noexcept {
    const HandOptions& o = options_;
    const double h = period_ / o.substeps;
    for (int n = 0; n < o.substeps; ++n) {
        const Vector want = wanted(time() + (n + 1) * h);
        Vector pull = o.stiffness * (want - x_) + o.damping * ((want - want_) / h - v_);
        if (const double size = pull.norm(); size > o.grip) pull *= o.grip / size;
        v_ += h / o.mass * (pull - o.friction * v_ + force);
        x_ += h * v_;
        want_ = want;
    }
    ++ticks_;
    return true;
}

ReplayDevice::ReplayDevice(std::vector<HandSample> samples, double rate)
    : samples_(std::move(samples)), period_(1 / rate) {
    if (samples_.empty()) throw InputError("replay: no poses");
    if (!(rate > 0 && std::isfinite(rate))) throw InputError("replay: the rate must be positive and finite");
    info_.name = "replay";
}

bool ReplayDevice::finished() const noexcept {
    return samples_.front().time + double(ticks_) * period_ >= samples_.back().time;
}

bool ReplayDevice::read(DeviceSample& sample) noexcept {
    const double time = samples_.front().time + double(ticks_) * period_;
    while (at_ + 2 < samples_.size() && samples_[at_ + 1].time <= time) ++at_;
    const HandSample &a = samples_[at_], &b = samples_[std::min(at_ + 1, samples_.size() - 1)];
    const double span = b.time - a.time;
    const double s = span > 0 ? std::clamp((time - a.time) / span, 0.0, 1.0) : 0;
    sample.time = double(ticks_) * period_;
    sample.pose = {a.pose.position + s * (b.pose.position - a.pose.position),
                   a.pose.rotation.slerp(s, b.pose.rotation)};
    sample.velocity =
        span > 0 && s < 1 ? Vector((b.pose.position - a.pose.position) / span) : Vector(Vector::Zero());
    sample.buttons = s < 1 ? a.buttons : b.buttons;
    return true;
}

bool ReplayDevice::write(const Vector&) noexcept {
    ++ticks_;
    return true;
}

}  // namespace innerspring
