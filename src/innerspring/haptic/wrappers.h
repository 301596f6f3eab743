#pragma once
#include "innerspring/haptic/device.h"
#include "innerspring/haptic/ring.h"
#include "innerspring/record/hand_file.h"

namespace innerspring {

/// A device seen through another: passes everything on. Holds a reference; the inner device must outlive it.
class WrappedDevice : public Device {
  public:
    explicit WrappedDevice(Device& inner) : inner_(inner) {}
    void open() override { inner_.open(); }
    void close() noexcept override { inner_.close(); }
    const DeviceInfo& info() const override { return inner_.info(); }
    bool read(DeviceSample& sample) noexcept override { return inner_.read(sample); }
    bool write(const Vector& force) noexcept override { return inner_.write(force); }
    DeviceFault fault() const noexcept override { return inner_.fault(); }
    std::string fault_text() const override { return inner_.fault_text(); }
    bool start(double rate, ServoTick tick, void* context) override {
        return inner_.start(rate, tick, context);
    }
    void stop() noexcept override { inner_.stop(); }
    bool finished() const noexcept override { return inner_.finished(); }

  protected:
    Device& inner_;
};

/// The device turned and enlarged: x' = s R x, v' = s R v, and F = s R^T F', so that no power is won or lost,
/// F . v = F' . v'. Its limits change with it: forces by 1/s, stiffness, damping and mass by 1/s^2.
class TurnedDevice : public WrappedDevice {
  public:
    TurnedDevice(Device& inner, double scale, const Eigen::Quaterniond& rotation);
    void open() override;
    const DeviceInfo& info() const override { return info_; }
    bool read(DeviceSample& sample) noexcept override;
    bool write(const Vector& force) noexcept override;

  private:
    void describe();
    double scale_;
    Eigen::Quaterniond rotation_;
    DeviceInfo info_;
};

/// While a button is held, the hand moves and the tool stays, and no force acts: to go on where the workspace
/// ends, as one lifts a mouse.
class ClutchedDevice : public WrappedDevice {
  public:
    ClutchedDevice(Device& inner, unsigned button) : WrappedDevice(inner), button_(button) {}
    bool read(DeviceSample& sample) noexcept override;
    bool write(const Vector& force) noexcept override;

  private:
    unsigned button_;
    bool held_ = false;
    Vector offset_ = Vector::Zero(), last_ = Vector::Zero();
};

/// Puts every sample with the force that answered it into a ring, which another thread writes to a file.
class RecordedDevice : public WrappedDevice {
  public:
    RecordedDevice(Device& inner, Ring<HandSample>& ring) : WrappedDevice(inner), ring_(ring) {}
    bool read(DeviceSample& sample) noexcept override;
    bool write(const Vector& force) noexcept override;

  private:
    Ring<HandSample>& ring_;
    HandSample sample_;
    bool heard_ = false;             ///< since the last force
    double last_ = -1, offset_ = 0;  ///< [s]: times go on when the device is opened again
};

}  // namespace innerspring
