#include "innerspring/haptic/pointed.h"

#include <cmath>

namespace innerspring {

namespace {
constexpr double lag = 0.02;     // [s]
constexpr double fastest = 0.5;  // [m/s]
}  // namespace

PointedDevice::PointedDevice(std::string name, double rate) : period_(1 / rate) {
    if (!(rate > 0 && std::isfinite(rate))) throw InputError(name + ": the rate must be positive and finite");
    info_.name = std::move(name);
    info_.output_dof = 0;
    beginning_ = (info_.workspace.lower + info_.workspace.upper) / 2;
    beginning_.z() = info_.workspace.upper.z();
    x_ = beginning_;
    told_.send({beginning_, 0});
}

void PointedDevice::point(const Vector& place, unsigned buttons) noexcept {
    if (!place.allFinite()) return;
    told_.send({place.cwiseMax(info_.workspace.lower).cwiseMin(info_.workspace.upper), buttons});
}

bool PointedDevice::read(DeviceSample& sample) noexcept {
    told_.update();
    sample = {double(ticks_) * period_, {x_}, v_, told_.latest().buttons};
    return true;
}

bool PointedDevice::write(const Vector&) noexcept {
    // x' = (x_told - x) / lag over the period, exactly.
    Vector way = (1 - std::exp(-period_ / lag)) * (told_.latest().place - x_);
    if (const double size = way.norm(), most = fastest * period_; size > most) way *= most / size;
    v_ = way / period_;
    x_ += way;
    ++ticks_;
    return true;
}

}  // namespace innerspring
