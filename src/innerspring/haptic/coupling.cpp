#include "innerspring/haptic/coupling.h"

#include <cmath>

namespace innerspring {

double passive_limit(const DeviceInfo& info, double period, double delay) {
    return info.damping / (period / 2 + delay);
}

CouplingGains passive_gains(const DeviceInfo& info, double period, double delay, double share) {
    const double k = share * std::min(info.max_stiffness, passive_limit(info, period, delay));
    const double left = info.damping - k * (period / 2 + delay);
    return {k, std::clamp(left / 4, 0.0, info.max_damping)};
}

double stored(const LocalContact& c, const Vector& p) noexcept {
    const double depth = std::max(0.0, c.normal.dot(c.rest - p));
    return c.stiffness * depth * depth / 2;
}

CoupledForce GodObject::feel(const LocalContact& c, const CouplingGains& gains, const Vector& x,
                             const Vector& v, double period) noexcept {
    const Vector& n = c.normal;
    if (!touching_) proxy_ = x;
    const double drag = c.damping / period;
    const double sum = gains.stiffness + c.stiffness + drag;
    // n . (p - x), from the balance.
    const double depth = (c.stiffness * n.dot(c.rest - x) + drag * n.dot(proxy_ - x)) / sum;
    if (!(c.stiffness > 0) || !(depth > 0) || !(gains.stiffness > 0)) {
        touching_ = false;
        proxy_ = x;
        return {Vector::Zero(), x, 0, 0};
    }
    const double normal = gains.stiffness * depth;
    Vector across = Vector::Zero();  // of p - x
    if (touching_ && c.friction > 0) {
        across = proxy_ - x;
        across -= n.dot(across) * n;
        const double most = c.friction * normal / gains.stiffness;
        if (const double size = across.norm(); size > most) across *= most / size;
    }
    touching_ = true;
    proxy_ = x + depth * n + across;
    Vector force = normal * n + gains.stiffness * across;
    const double share = c.stiffness / (gains.stiffness + c.stiffness);
    force += std::clamp(-gains.damping * share * n.dot(v), -normal, normal) * n;
    const double energy = stored(c, proxy_) + gains.stiffness * (proxy_ - x).squaredNorm() / 2;
    return {force, proxy_, gains.stiffness * share, energy};
}

void ContactBlend::aim(const LocalContact& target, double period) noexcept {
    target_ = target;
    const double periods = period > 0 ? target.period / period : 0;
    left_ = periods > 1 ? std::uint64_t(std::min(periods + 0.5, 1e6)) : 1;
    // From or to nothing there is no plane to blend with: the other's, with no stiffness.
    if (!(now_.stiffness > 0) && target.stiffness > 0) {
        now_ = target_;
        now_.stiffness = now_.damping = 0;
    } else if (!(target.stiffness > 0)) {
        target_.rest = now_.rest, target_.normal = now_.normal;
        target_.stiffness = target_.damping = 0;
    }
}

const LocalContact& ContactBlend::advance() noexcept {
    if (left_ == 0) return now_;
    const double s = 1.0 / double(left_--);
    const Vector n = now_.normal + s * (target_.normal - now_.normal);
    const double size = n.norm();
    now_.rest += s * (target_.rest - now_.rest);
    now_.stiffness += s * (target_.stiffness - now_.stiffness);
    now_.damping += s * (target_.damping - now_.damping);
    now_.normal = size > 1e-3 ? Vector(n / size) : target_.normal;
    now_.friction = target_.friction, now_.period = target_.period, now_.step = target_.step;
    if (left_ == 0) now_ = target_;
    return now_;
}

void PassivityObserver::observe(const Vector& x) noexcept {
    if (started_) {
        const double put_in = -held_.dot(x - x_);
        energy_ += put_in, total_ += put_in;
        least_ = std::min(least_, energy_);
    }
    started_ = true;
    x_ = x;
}

Vector PassivityObserver::limit(const Vector& force, const Vector& v, double period,
                                double mass) const noexcept {
    const double a = force.squaredNorm() * period * period / mass, b = force.dot(v) * period;
    constexpr double reserve = 1e-7;  // [J]: the hand's own acceleration within a period
    const double e = std::max(energy_ - reserve, 0.0);
    if (a + b <= e) return force;
    // The positive root of a l^2 + b l = e.
    const double root = std::sqrt(b * b + 4 * a * e);
    const double l = b > 0 ? (root + b > 0 ? 2 * e / (root + b) : 0) : (a > 0 ? (root - b) / (2 * a) : 0);
    return std::clamp(l, 0.0, 1.0) * force;
}

ForceGuard::ForceGuard(const DeviceInfo& info, const SafetyOptions& options) : options_(options) {
    SafetyOptions& o = options_;
    o.peak = o.peak > 0 ? std::min(o.peak, info.max_force) : info.max_force;
    o.continuous = o.continuous > 0 ? std::min(o.continuous, info.max_continuous_force)
                                    : std::min(info.max_continuous_force, o.peak);
    if (!(o.rise > 0)) o.rise = o.peak / 0.02;
}

Vector ForceGuard::pass(const Vector& force, double share, double period) noexcept {
    clamped_ = false;
    if (!force.allFinite()) {
        restart();
        return Vector::Zero();
    }
    ramp_ = options_.ramp > 0 ? std::min(1.0, ramp_ + period / options_.ramp) : 1;
    Vector f = ramp_ * std::clamp(share, 0.0, 1.0) * force;
    // The motors warm as the mean square of the force; what they may give falls with it, so that a force
    // held ends at the continuous one: |F|^2 = Fc^2 + (Fp^2 - Fc^2)(1 - |F|^2 / Fc^2) only for |F| = Fc.
    const double c2 = options_.continuous * options_.continuous, p2 = options_.peak * options_.peak;
    const double most = std::sqrt(c2 + (p2 - c2) * std::max(0.0, 1 - heat_ / c2));
    if (const double size = f.norm(); size > most) {
        f *= most / size;
        clamped_ = true;
    }
    // Slew: a change that makes the force larger is limited.
    const Vector change = f - last_;
    if (const double size = change.norm(), step = options_.rise * period; size > step) {
        const Vector slow = last_ + step / size * change;
        if (slow.norm() < f.norm()) {
            f = slow;
            clamped_ = true;
        }
    }
    return f;
}

void ForceGuard::sent(const Vector& force, double period) noexcept {
    last_ = force;
    heat_ += std::min(1.0, period / options_.heat_time) * (force.squaredNorm() - heat_);
}

}  // namespace innerspring
