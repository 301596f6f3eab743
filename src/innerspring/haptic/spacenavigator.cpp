#include "innerspring/haptic/spacenavigator.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "innerspring/haptic/library.h"
#include "innerspring/haptic/pointed.h"

namespace innerspring {

namespace {

// What is used of libspnav 1.0 (Debian libspnav0), in declarations of our own. Events are a union of structs
// that begin with their type, the largest of 48 bytes: there is room here for more.
constexpr int motion_event = 1, button_event = 2;
struct MotionEvent {
    int type, x, y, z, rx, ry, rz;
    unsigned period;
    int* data;
};
struct ButtonEvent {
    int type, press, number;
};
union Event {
    int type;
    MotionEvent motion;
    ButtonEvent button;
    char room[256];
};
constexpr double full = 350;  // counts

class SpaceNavigator final : public PointedDevice {
  public:
    explicit SpaceNavigator(const SpaceNavigatorOptions& options)
        : PointedDevice("SpaceNavigator", options.rate), options_(options) {
        if (!(options.speed > 0 && std::isfinite(options.speed) && options.dead >= 0 && options.dead < 1))
            throw InputError("SpaceNavigator: the speed must be positive, the dead share from 0 to 1");
    }
    ~SpaceNavigator() override { close(); }

    void open() override {
        if (thread_.joinable()) return;
        constexpr const char* names[] = {"libspnav.so.0", "libspnav.so"};
        library_.load(options_.library, names, "install libspnav0 and spacenavd, or name it with --library");
        library_.bind(open_, "spnav_open");
        library_.bind(close_, "spnav_close");
        library_.bind(poll_, "spnav_poll_event");
        if (open_() == -1)
            throw DeviceError(
                "SpaceNavigator: spacenavd does not answer; is it running, and the device plugged in?");
        quit_ = false;
        thread_ = std::thread([this] { follow(); });
    }

    void close() noexcept override {
        if (!thread_.joinable()) return;
        quit_ = true;
        thread_.join();
        close_();
    }

  private:
    /// Counts to a share of the full deflection, none within the dead zone and without a step at its end.
    double share(int counts) const {
        const double s = std::clamp(counts / full, -1.0, 1.0), free = std::abs(s) - options_.dead;
        return free > 0 ? std::copysign(free / (1 - options_.dead), s) : 0;
    }

    /// x right, y up, z to the user, as spacenavd has it but for the sign of z.
    void follow() {
        using Clock = std::chrono::steady_clock;
        constexpr double dt = 0.004;  // [s]
        Vector place = beginning(), velocity = Vector::Zero();
        unsigned buttons = 0;
        auto next = Clock::now();
        while (!quit_.load(std::memory_order_relaxed)) {
            Event event;
            for (int n = 0; n < 100 && poll_(&event) != 0; ++n) {
                if (event.type == motion_event)
                    velocity = options_.speed *
                               Vector(share(event.motion.x), share(event.motion.y), -share(event.motion.z));
                if (event.type == button_event && event.button.number >= 0 && event.button.number < 8) {
                    const unsigned bit = 1u << event.button.number;
                    buttons = event.button.press ? buttons | bit : buttons & ~bit;
                }
            }
            place = (place + dt * velocity).cwiseMax(info().workspace.lower).cwiseMin(info().workspace.upper);
            point(place, buttons);
            next += std::chrono::microseconds(std::llround(1e6 * dt));
            if (const auto now = Clock::now(); next < now) next = now;
            std::this_thread::sleep_until(next);
        }
    }

    SpaceNavigatorOptions options_;
    VendorLibrary library_{"SpaceNavigator"};
    int (*open_)() = nullptr;
    int (*close_)() = nullptr;
    int (*poll_)(void*) = nullptr;  ///< of an Event
    std::atomic<bool> quit_{false};
    std::thread thread_;
};

}  // namespace

std::unique_ptr<Device> make_spacenavigator(const SpaceNavigatorOptions& options) {
    return std::make_unique<SpaceNavigator>(options);
}

}  // namespace innerspring
