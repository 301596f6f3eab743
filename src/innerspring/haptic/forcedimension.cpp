#include "innerspring/haptic/forcedimension.h"

#include <fmt/format.h>

#include <chrono>

#include "innerspring/haptic/library.h"

namespace innerspring {

namespace {

// What is used of the DHD interface 3, in declarations of our own: metres and newtons; a result below 0 is an
// error, 1 says that the last value was given again. The frame is x to the user, y right, z up.
#if defined(_WIN32)
#define INNERSPRING_DHD_CALL __stdcall  // not verified with the vendor's header
constexpr const char* library_names[] = {"dhd64.dll", "dhd.dll"};
#elif defined(__APPLE__)
#define INNERSPRING_DHD_CALL
constexpr const char* library_names[] = {"libdhd.dylib"};
#else
#define INNERSPRING_DHD_CALL
constexpr const char* library_names[] = {"libdhd.so.3", "libdhd.so"};
#endif
/// X(return type, name without "dhd", arguments)
#define INNERSPRING_DHD_FUNCTIONS(X)                             \
    X(int, Open, ())                                             \
    X(int, Close, (char))                                        \
    X(int, EnableForce, (unsigned char, char))                   \
    X(int, GetPosition, (double*, double*, double*, char))       \
    X(int, GetLinearVelocity, (double*, double*, double*, char)) \
    X(int, GetOrientationFrame, (double(*)[3], char))            \
    X(unsigned, GetButtonMask, (char))                           \
    X(int, SetForce, (double, double, double, char))             \
    X(const char*, GetSystemName, (char))                        \
    X(const char*, ErrorGetLastStr, ())
struct Functions {
#define INNERSPRING_DHD_MEMBER(result, name, arguments) \
    result(INNERSPRING_DHD_CALL* name) arguments = nullptr;
    INNERSPRING_DHD_FUNCTIONS(INNERSPRING_DHD_MEMBER)
#undef INNERSPRING_DHD_MEMBER
};

/// From the frame of the device to x right, y up, z to the user.
Vector turned(const Vector& d) {
    return {d.y(), d.z(), d.x()};
}

class ForceDimension final : public Device {
  public:
    explicit ForceDimension(const ForceDimensionOptions& options) : options_(options) {}
    ~ForceDimension() override { close(); }

    void open() override {
        if (id_ >= 0) return;
        library_.load(options_.library, library_names,
                      "install the vendor's SDK, or name the library with --library");
#define INNERSPRING_DHD_LOAD(result, name, arguments) library_.bind(dhd_.name, "dhd" #name);
        INNERSPRING_DHD_FUNCTIONS(INNERSPRING_DHD_LOAD)
#undef INNERSPRING_DHD_LOAD
        id_ = dhd_.Open();
        if (id_ < 0)
            throw DeviceError("Force Dimension: no device opens: " + words() +
                              "; is it plugged in, switched on and calibrated?");
        started_ = Clock::now();
        lost_ = false;
        const char* name = dhd_.GetSystemName(id());
        info_.name = name && *name ? name : "Force Dimension device";
        info_.workspace = options_.workspace;
        info_.max_force = options_.max_force, info_.max_continuous_force = options_.max_continuous_force;
        info_.max_stiffness = options_.max_stiffness;
        info_.damping = options_.damping, info_.mass = options_.mass;
        DeviceSample sample;
        const bool answers = read(sample), pushes = answers && dhd_.EnableForce(1, id()) >= 0;
        if (!pushes) {
            const std::string why = words();
            close();
            throw DeviceError(fmt::format("Force Dimension: {} {}: {}", info_.name,
                                          answers ? "does not switch its motors on" : "does not answer",
                                          why));
        }
    }

    void close() noexcept override {
        if (id_ < 0) return;
        dhd_.SetForce(0, 0, 0, id());
        dhd_.EnableForce(0, id());
        dhd_.Close(id());
        id_ = -1;
    }

    const DeviceInfo& info() const override {
        return info_;
    }

    bool read(DeviceSample& sample) noexcept override {
        Vector x = Vector::Zero(), v = Vector::Zero();
        double R[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        lost_ = id_ < 0 || dhd_.GetPosition(&x[0], &x[1], &x[2], id()) < 0 ||
                dhd_.GetLinearVelocity(&v[0], &v[1], &v[2], id()) < 0 ||
                dhd_.GetOrientationFrame(R, id()) < 0;
        if (lost_) return false;
        constexpr int of[] = {1, 2, 0};
        Eigen::Matrix3d frame;
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) frame(i, k) = R[of[i]][of[k]];
        sample.time = std::chrono::duration<double>(Clock::now() - started_).count();
        sample.pose = {turned(x), Eigen::Quaterniond(frame).normalized()};
        sample.velocity = turned(v);
        sample.buttons = dhd_.GetButtonMask(id());
        return true;
    }

    bool write(const Vector& force) noexcept override {
        const bool sent = id_ >= 0 && dhd_.SetForce(force.z(), force.x(), force.y(), id()) >= 0;
        lost_ = lost_ || !sent;
        return sent;
    }

    DeviceFault fault() const noexcept override {
        return lost_ ? DeviceFault::lost : DeviceFault::none;
    }
    std::string fault_text() const override {
        return lost_ && library_.loaded() ? words() : "";
    }

  private:
    using Clock = std::chrono::steady_clock;
    char id() const {
        return static_cast<char>(id_);
    }
    std::string words() const {
        const char* text = dhd_.ErrorGetLastStr();
        return text && *text ? text : "no reason given";
    }

    ForceDimensionOptions options_;
    VendorLibrary library_{"Force Dimension"};
    Functions dhd_;
    DeviceInfo info_;
    int id_ = -1;
    bool lost_ = false;
    Clock::time_point started_;
};

}  // namespace

std::unique_ptr<Device> make_forcedimension(const ForceDimensionOptions& options) {
    return std::make_unique<ForceDimension>(options);
}

}  // namespace innerspring
