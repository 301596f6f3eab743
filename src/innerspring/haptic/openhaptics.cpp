#include "innerspring/haptic/openhaptics.h"

#include <fmt/format.h>

#include <atomic>
#include <cmath>

#include "innerspring/haptic/hd_interface.h"
#include "innerspring/haptic/library.h"

namespace innerspring {

namespace {

#if defined(_WIN32)
constexpr const char* library_names[] = {"hd.dll"};
#elif defined(__APPLE__)
constexpr const char* library_names[] = {"/Library/Frameworks/HD.framework/HD", "libHD.dylib"};
#else
constexpr const char* library_names[] = {"libHD.so", "libHD.so.3", "libHD.so.3.4"};
#endif

constexpr double mm = 1e-3;  // in metres

class OpenHaptics final : public Device {
  public:
    explicit OpenHaptics(const OpenHapticsOptions& options) : options_(options) {}
    ~OpenHaptics() override { close(); }

    void open() override {
        if (open_) return;
        load_library();
        flush_errors();
        handle_ = hd_.InitDevice(options_.device.empty() ? nullptr : options_.device.c_str());
        const hd::ErrorInfo error = hd_.GetError();
        const std::string name = options_.device.empty() ? "the default device" : "'" + options_.device + "'";
        if (handle_ == hd::invalid_handle || error.code != 0) {
            if (handle_ != hd::invalid_handle) hd_.DisableDevice(handle_);
            throw DeviceError(
                fmt::format("OpenHaptics: {} does not open: {}; is it plugged in, switched on and set up "
                            "with the vendor's tool?",
                            name, error.code != 0 ? words(error) : "no such device"));
        }
        open_ = true;
        try {
            hd_.MakeCurrentDevice(handle_);
            require("hdMakeCurrentDevice");
            describe();
            calibrate();
            for (const auto& [what, say] :
                 {std::pair(hd::force_output, "hdEnable(HD_FORCE_OUTPUT)"),
                  std::pair(hd::max_force_clamping, "hdEnable(HD_MAX_FORCE_CLAMPING)"),
                  std::pair(hd::software_force_limit, "hdEnable(HD_SOFTWARE_FORCE_LIMIT)")}) {
                hd_.Enable(what);
                require(say);
            }
        } catch (...) {
            close();
            throw;
        }
        fault_ = DeviceFault::none;
        last_error_.store(0, std::memory_order_relaxed);
        ticks_ = 0;
    }

    void close() noexcept override {
        if (!open_) return;
        stop();
        hd_.Disable(hd::force_output);
        hd_.DisableDevice(handle_);
        flush_errors();
        open_ = false;
        handle_ = hd::invalid_handle;
    }

    const DeviceInfo& info() const override { return info_; }

    bool start(double rate, ServoTick tick, void* context) override {
        tick_ = tick, context_ = context, period_ = 1 / rate;
        hd_.SetSchedulerRate(static_cast<unsigned long>(std::lround(rate)));
        if (const hd::ErrorInfo error = hd_.GetError(); error.code != 0)
            throw DeviceError(
                fmt::format("OpenHaptics: the scheduler does not run at {:g} Hz: {}", rate, words(error)));
        last_error_.store(0, std::memory_order_relaxed);
        fault_ = DeviceFault::none;
        scheduled_ = hd_.ScheduleAsynchronous(&OpenHaptics::callback, this, hd::default_priority);
        require("hdScheduleAsynchronous");
        running_ = true;
        hd_.StartScheduler();
        if (const hd::ErrorInfo error = hd_.GetError(); error.code != 0) {
            stop();
            throw DeviceError("OpenHaptics: hdStartScheduler: " + words(error));
        }
        return true;
    }

    void stop() noexcept override {
        if (!running_) return;
        running_ = false;
        hd_.StopScheduler();
        hd_.Unschedule(scheduled_);
        // The scheduler has ended; no force is left behind.
        const double none[3] = {0, 0, 0};
        hd_.BeginFrame(handle_);
        hd_.SetDoublev(hd::current_force, none);
        hd_.EndFrame(handle_);
        // What stopping says about a lost device is no news.
        flush_errors();
    }

    bool read(DeviceSample& sample) noexcept override {
        double m[16], v[3];
        int buttons = 0;
        hd_.GetDoublev(hd::current_transform, m);
        hd_.GetDoublev(hd::current_velocity, v);
        hd_.GetIntegerv(hd::current_buttons, &buttons);
        if (!good()) return false;
        Eigen::Matrix3d R;  // column-major
        R << m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10];
        sample.time = double(ticks_) * period_;
        sample.pose.position = mm * Vector(m[12], m[13], m[14]);
        sample.pose.rotation = Eigen::Quaterniond(R).normalized();
        sample.velocity = mm * Vector(v[0], v[1], v[2]);
        sample.buttons = static_cast<unsigned>(buttons);
        return true;
    }

    bool write(const Vector& force) noexcept override {
        if (!open_) return false;
        const double f[3] = {force.x(), force.y(), force.z()};
        if (in_frame_) {
            hd_.SetDoublev(hd::current_force, f);
            return good();
        }
        return false;  // only the scheduler's thread sends forces
    }

    DeviceFault fault() const noexcept override { return fault_; }
    std::string fault_text() const override {
        const hd::Error code = last_error_.load(std::memory_order_relaxed);
        return code == 0 ? "" : fmt::format("{} (0x{:04x})", hd::describe(code), code);
    }

  private:
    static hd::CallbackCode INNERSPRING_HD_CALL callback(void* context) {
        return static_cast<OpenHaptics*>(context)->frame();
    }

    hd::CallbackCode frame() noexcept {
        fault_ = DeviceFault::none;
        hd_.BeginFrame(handle_);
        in_frame_ = true;
        good();
        if (carried_ != 0) note(carried_);  // said when the last frame ended
        const bool more = tick_(context_);
        in_frame_ = false;
        hd_.EndFrame(handle_);
        const hd::Error late = hd_.GetError().code;
        carried_ = late;
        if (late != 0) last_error_.store(late, std::memory_order_relaxed);
        ++ticks_;
        return more ? hd::callback_continue : hd::callback_done;
    }

    /// No error since the last call; else it is a fault of this period.
    bool good() noexcept {
        const hd::ErrorInfo error = hd_.GetError();
        if (error.code != 0) note(error.code);
        return error.code == 0;
    }

    void note(hd::Error code) noexcept {
        last_error_.store(code, std::memory_order_relaxed);
        // 0x02xx: too fast, too warm, too much: passes. A device or a license does not.
        const bool passes = code < 0x0300;
        if (fault_ != DeviceFault::lost) fault_ = passes ? DeviceFault::warning : DeviceFault::lost;
    }

    std::string words(const hd::ErrorInfo& error) const {
        const char* vendor = hd_.GetErrorString(error.code);
        return fmt::format("{} (0x{:04x}, internal {}{}{})", hd::describe(error.code), error.code,
                           error.internal_code, vendor && *vendor ? ": " : "", vendor ? vendor : "");
    }

    void require(const char* call) {
        if (const hd::ErrorInfo error = hd_.GetError(); error.code != 0)
            throw DeviceError(fmt::format("OpenHaptics: {}: {}", call, words(error)));
    }

    void flush_errors() noexcept {
        for (int n = 0; n < 100 && hd_.GetError().code != 0; ++n) {
        }
    }

    void load_library() {
        if (library_.loaded()) return;
        library_.load(options_.library, library_names,
                      "install the vendor's driver and SDK, or name the library with --library");
#define INNERSPRING_HD_LOAD(result, name, arguments) library_.bind(hd_.name, "hd" #name);
        INNERSPRING_HD_FUNCTIONS(INNERSPRING_HD_LOAD)
#undef INNERSPRING_HD_LOAD
    }

    void describe() {
        info_ = {};
        const char* model = hd_.GetString(hd::device_model_type);
        require("hdGetString(HD_DEVICE_MODEL_TYPE)");
        info_.name = model && *model ? model : "OpenHaptics device";
        double box[6];
        get(hd::usable_workspace, box, "HD_USABLE_WORKSPACE_DIMENSIONS");
        info_.workspace = {mm * Vector(box[0], box[1], box[2]), mm * Vector(box[3], box[4], box[5])};
        get(hd::nominal_max_force, &info_.max_force, "HD_NOMINAL_MAX_FORCE");
        get(hd::nominal_max_continuous_force, &info_.max_continuous_force, "HD_NOMINAL_MAX_CONTINUOUS_FORCE");
        double stiffness = 0;  // N/mm is 0 to 1 per unit in some drivers; see docs/haptics.md
        get(hd::nominal_max_stiffness, &stiffness, "HD_NOMINAL_MAX_STIFFNESS");
        info_.max_stiffness = stiffness < 10 ? stiffness * 1000 : stiffness;
        double damping = 0;
        get(hd::nominal_max_damping, &damping, "HD_NOMINAL_MAX_DAMPING");
        info_.max_damping = damping < 0.1 ? damping * 1000 : damping;
        hd_.GetIntegerv(hd::input_dof, &info_.input_dof);
        require("hdGetIntegerv(HD_INPUT_DOF)");
        hd_.GetIntegerv(hd::output_dof, &info_.output_dof);
        require("hdGetIntegerv(HD_OUTPUT_DOF)");
        info_.damping = options_.damping;
        info_.mass = options_.mass;
        const bool possible = (info_.workspace.lower.array() < info_.workspace.upper.array()).all() &&
                              info_.max_force > 0 && info_.max_force < 1000 &&
                              info_.max_continuous_force > 0 && info_.max_stiffness > 0 &&
                              info_.max_damping >= 0;
        if (!possible) throw DeviceError("OpenHaptics: the device says impossible limits of itself");
    }

    void get(hd::Enum what, double* value, const char* name) {
        hd_.GetDoublev(what, value);
        require(name);
        if (!std::isfinite(*value)) throw DeviceError(fmt::format("OpenHaptics: {} is not a number", name));
    }

    void calibrate() {
        hd::Enum state = hd_.CheckCalibration();
        require("hdCheckCalibration");
        if (state == hd::calibration_needs_update) {
            int style = 0;
            hd_.GetIntegerv(hd::calibration_style, &style);
            require("hdGetIntegerv(HD_CALIBRATION_STYLE)");
            hd_.UpdateCalibration(style & hd::calibration_auto      ? hd::calibration_auto
                                  : style & hd::calibration_inkwell ? hd::calibration_inkwell
                                                                    : hd::calibration_encoder_reset);
            require("hdUpdateCalibration");
            state = hd_.CheckCalibration();
            require("hdCheckCalibration");
        }
        if (state != hd::calibration_ok)
            throw DeviceError(
                "OpenHaptics: the device is not calibrated; put the stylus into the inkwell, or hold "
                "the arm at its reset position, and start again");
    }

    OpenHapticsOptions options_;
    VendorLibrary library_{"OpenHaptics"};
    hd::Functions hd_;
    DeviceInfo info_;
    hd::Handle handle_ = hd::invalid_handle;
    hd::SchedulerHandle scheduled_ = 0;
    bool open_ = false, running_ = false;
    // Of the scheduler's thread while it runs.
    ServoTick tick_ = nullptr;
    void* context_ = nullptr;
    double period_ = 1e-3;
    bool in_frame_ = false;
    DeviceFault fault_ = DeviceFault::none;
    hd::Error carried_ = 0;
    std::uint64_t ticks_ = 0;
    std::atomic<hd::Error> last_error_{0};
};

}  // namespace

std::unique_ptr<Device> make_openhaptics(const OpenHapticsOptions& options) {
    return std::make_unique<OpenHaptics>(options);
}

}  // namespace innerspring
