#pragma once
#include <vector>

#include "innerspring/haptic/device.h"
#include "innerspring/record/hand_file.h"

namespace innerspring {

/// A hand on a device: a mass drawn towards where it wants to be by a spring and a damper,
///     m x'' = clip(k_h (x_want - x) + b_h (v_want - v), grip) - b_d v + F.
/// b_d is the friction of the device itself.
struct HandOptions {
    double mass = 0.05;      ///< of hand and device, at the tip [kg]
    double stiffness = 300;  ///< k_h of the grip [N/m]
    double damping = 5;      ///< b_h [N s/m]
    double friction = 0.8;   ///< b_d [N s/m]
    double grip = 10;        ///< the hand gives way beyond this force [N]
    double tremor = 0;       ///< amplitude of what it wants [m], at 8 to 12 Hz
    std::uint64_t seed = 1;  ///< of the tremor
    int substeps = 20;       ///< of a servo period, so that the hand is continuous in time beside it
};

/// A device that is all simulated. Its time goes on by one servo period with each write(), whatever the clock
/// says, so that it always does the same.
class SimulatedHand : public Device {
  public:
    /// `script`: where the hand wants to be, linear between its points, at rest outside.
    SimulatedHand(std::vector<PosePoint> script, double rate, const HandOptions& options = {});
    void open() override;
    void close() noexcept override {}
    const DeviceInfo& info() const override { return info_; }
    bool read(DeviceSample& sample) noexcept override;
    bool write(const Vector& force) noexcept override;
    bool finished() const noexcept override { return time() >= script_.path.back().time; }

    double time() const noexcept { return double(ticks_) * period_; }
    DeviceInfo& description() { return info_; }  ///< to pretend another device

  private:
    Vector wanted(double time) const noexcept;
    Tool script_;  ///< its path only
    double period_;
    HandOptions options_;
    DeviceInfo info_;
    std::uint64_t ticks_ = 0;
    Vector x_ = Vector::Zero(), v_ = Vector::Zero();
    Vector want_ = Vector::Zero();  ///< at the end of the last sub-step
    std::array<Vector, 3> tremor_phase_, tremor_hz_;
};

/// A recorded hand: the poses of a file at the servo's rate, linear between; forces are taken and not felt.
class ReplayDevice : public Device {
  public:
    ReplayDevice(std::vector<HandSample> samples, double rate);
    void open() override { ticks_ = 0, at_ = 0; }
    void close() noexcept override {}
    const DeviceInfo& info() const override { return info_; }
    bool read(DeviceSample& sample) noexcept override;
    bool write(const Vector& force) noexcept override;
    bool finished() const noexcept override;

  private:
    std::vector<HandSample> samples_;
    double period_;
    DeviceInfo info_;
    std::uint64_t ticks_ = 0;
    std::size_t at_ = 0;
};

}  // namespace innerspring
