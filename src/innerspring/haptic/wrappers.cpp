#include "innerspring/haptic/wrappers.h"

#include <fmt/format.h>

#include <cmath>

namespace innerspring {

TurnedDevice::TurnedDevice(Device& inner, double scale, const Eigen::Quaterniond& rotation)
    : WrappedDevice(inner), scale_(scale), rotation_(rotation.normalized()) {
    if (!(scale > 0 && std::isfinite(scale)) || !(rotation.norm() > 0 && std::isfinite(rotation.norm())))
        throw InputError(
            fmt::format("device scale is {:g}; it must be positive and finite, and the rotation a "
                        "rotation",
                        scale));
    describe();
}

void TurnedDevice::open() {
    inner_.open();
    describe();
}

void TurnedDevice::describe() {
    info_ = inner_.info();
    const Box box = info_.workspace;
    for (int corner = 0; corner < 8; ++corner) {
        const Vector x(corner & 1 ? box.upper.x() : box.lower.x(), corner & 2 ? box.upper.y() : box.lower.y(),
                       corner & 4 ? box.upper.z() : box.lower.z());
        const Vector y = scale_ * (rotation_ * x);
        info_.workspace = corner == 0 ? Box{y, y} : join(info_.workspace, Box{y, y});
    }
    info_.max_force /= scale_, info_.max_continuous_force /= scale_;
    for (double* each : {&info_.max_stiffness, &info_.max_damping, &info_.damping, &info_.mass})
        *each /= scale_ * scale_;
}

bool TurnedDevice::read(DeviceSample& sample) noexcept {
    if (!inner_.read(sample)) return false;
    sample.pose.position = scale_ * (rotation_ * sample.pose.position);
    sample.pose.rotation = rotation_ * sample.pose.rotation;
    sample.velocity = scale_ * (rotation_ * sample.velocity);
    return true;
}

bool TurnedDevice::write(const Vector& force) noexcept {
    return inner_.write(scale_ * (rotation_.conjugate() * force));
}

bool ClutchedDevice::read(DeviceSample& sample) noexcept {
    if (!inner_.read(sample)) return false;
    held_ = (sample.buttons & button_) != 0;
    if (held_) {
        offset_ = last_ - sample.pose.position;
        sample.velocity.setZero();
    }
    sample.pose.position += offset_;
    last_ = sample.pose.position;
    return true;
}

bool ClutchedDevice::write(const Vector& force) noexcept {
    return inner_.write(held_ ? Vector(Vector::Zero()) : force);
}

bool RecordedDevice::read(DeviceSample& sample) noexcept {
    if (!inner_.read(sample)) return false;
    if (sample.time + offset_ <= last_) offset_ = last_ + 1e-3 - sample.time;
    last_ = sample.time + offset_;
    sample_ = {last_, sample.pose, sample.buttons, Vector::Zero()};
    heard_ = true;
    return true;
}

bool RecordedDevice::write(const Vector& force) noexcept {
    sample_.force = force;
    if (heard_) ring_.push(sample_);
    heard_ = false;
    return inner_.write(force);
}

}  // namespace innerspring
