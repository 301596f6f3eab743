#pragma once
#include "innerspring/haptic/device.h"
#include "innerspring/haptic/mailbox.h"

namespace innerspring {

/// A device that goes where another thread points: a mouse in the window. It follows with a lag of 20 ms and
/// at 0.5 m/s at most, so that what jumps from frame to frame moves evenly at the servo's rate. Forces are
/// taken and not felt. Its time goes on by one servo period with each write().
class PointedDevice : public Device {
  public:
    /// It begins at the face of the workspace before the user.
    PointedDevice(std::string name, double rate);
    const Vector& beginning() const { return beginning_; }  ///< [m], device frame
    /// From one other thread. Places outside the workspace are brought to its nearest face.
    void point(const Vector& place, unsigned buttons = 0) noexcept;  ///< [m], device frame

    void open() override {}
    void close() noexcept override {}
    const DeviceInfo& info() const override { return info_; }
    bool read(DeviceSample& sample) noexcept override;
    bool write(const Vector& force) noexcept override;

  private:
    struct Target {
        Vector place = Vector::Zero();
        unsigned buttons = 0;
    };
    DeviceInfo info_;
    double period_;
    Vector beginning_;
    Mailbox<Target> told_;
    std::uint64_t ticks_ = 0;
    Vector x_, v_ = Vector::Zero();
};

}  // namespace innerspring
