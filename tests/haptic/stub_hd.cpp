// A stand-in for the vendor's libHD.so: the same C interface, its own callback thread, and faults on demand.
// Built as a shared library; nothing of innerspring is linked into it.
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <string_view>
#include <thread>

#include "innerspring/haptic/hd_interface.h"

using namespace innerspring;

namespace {

constexpr int room = 8;

struct Stub {
    // What tests say.
    std::atomic<int> fail_call{-1};  ///< the call, counted from 0, that leaves an error behind
    std::atomic<unsigned> fail_code{0x0302};
    std::atomic<unsigned> always{0};  ///< an error every frame leaves behind
    std::atomic<bool> no_device{false}, stalled{false};
    std::atomic<unsigned> calibration{hd::calibration_ok};
    std::atomic<double> speed{0};  ///< of the stylus along z [mm/s]
    std::atomic<double> z{0};      ///< where it is [mm]
    // What they ask.
    std::atomic<int> calls{0};
    std::atomic<double> force{0}, largest{0};           ///< as last and most set [N]
    std::atomic<double> fault_time{-1}, zero_time{-1};  ///< [s]: of the fault, of the first zero force after
    std::atomic<int> fail_in_stop{-1};  ///< the call from hdStopScheduler() on that leaves an error behind
    std::atomic<int> open{0}, closed{0}, frames{0}, in_frame{0}, bad_frames{0}, wrong_thread{0};
    // Its own.
    unsigned errors[room]{};
    int error_count = 0;
    hd::Callback callback = nullptr;
    void* context = nullptr;
    std::atomic<bool> running{false};
    std::atomic<unsigned long> rate{1000};
    std::thread thread;
    std::atomic<std::thread::id> servo{};
    std::atomic_flag lock = ATOMIC_FLAG_INIT;
} stub;

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Guard {
    Guard() {
        while (stub.lock.test_and_set(std::memory_order_acquire)) std::this_thread::yield();
    }
    ~Guard() { stub.lock.clear(std::memory_order_release); }
};

void leave(unsigned code) {
    Guard guard;
    if (stub.error_count < room) stub.errors[stub.error_count++] = code;
    double none = -1;
    stub.fault_time.compare_exchange_strong(none, now());
}

/// Each call comes by here; true if it is the one to fail.
bool call() {
    if (stub.calls.fetch_add(1) != stub.fail_call.load()) return false;
    leave(stub.fail_code);
    return true;
}

}  // namespace

extern "C" {

hd::Handle hdInitDevice(const char*) {
    if (call()) return hd::invalid_handle;
    if (stub.no_device) return leave(0x0300), hd::invalid_handle;
    ++stub.open;
    return 7;
}
void hdDisableDevice(hd::Handle) {
    call();
    --stub.open;
    ++stub.closed;
}
void hdMakeCurrentDevice(hd::Handle) {
    call();
}
void hdBeginFrame(hd::Handle) {
    call();
    if (stub.in_frame++ != 0) ++stub.bad_frames;
}
void hdEndFrame(hd::Handle) {
    call();
    if (--stub.in_frame != 0) ++stub.bad_frames;
    ++stub.frames;
}
void hdEnable(hd::Enum) {
    call();
}
void hdDisable(hd::Enum) {
    call();
}
void hdGetDoublev(hd::Enum what, double* out) {
    if (call()) return;  // and leaves the numbers as they were
    switch (what) {
        case hd::current_transform: {
            const double m[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, stub.z, 1};
            std::memcpy(out, m, sizeof m);
            break;
        }
        case hd::current_velocity:
            out[0] = out[1] = 0, out[2] = stub.speed;
            break;
        case hd::usable_workspace: {
            const double box[6] = {-80, -60, -35, 80, 60, 35};
            std::memcpy(out, box, sizeof box);
            break;
        }
        case hd::nominal_max_force:
            *out = 7.9;
            break;
        case hd::nominal_max_continuous_force:
            *out = 1.75;
            break;
        case hd::nominal_max_stiffness:
            *out = 1.0;
            break;
        case hd::nominal_max_damping:
            *out = 0.005;
            break;
        default:
            leave(0x0100);
    }
}
void hdGetIntegerv(hd::Enum what, int* out) {
    if (call()) return;
    *out = what == hd::input_dof ? 6 : what == hd::output_dof ? 3 : what == hd::calibration_style ? 2 : 0;
}
const char* hdGetString(hd::Enum) {
    return call() ? nullptr : "Stub Phantom";
}
void hdSetDoublev(hd::Enum what, const double* f) {
    if (what != hd::current_force) return leave(0x0100);
    if (stub.running && stub.servo.load() != std::this_thread::get_id()) ++stub.wrong_thread;
    if (stub.in_frame == 0) leave(0x0400);
    const double size = std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
    stub.force = size;
    if (!(size <= stub.largest)) stub.largest = size;
    if (size == 0 && stub.fault_time >= 0) {
        double none = -1;
        stub.zero_time.compare_exchange_strong(none, now());
    }
    call();
}
hd::ErrorInfo hdGetError() {
    Guard guard;
    if (stub.error_count == 0) return {0, 0, 7};
    const unsigned code = stub.errors[0];
    std::memmove(stub.errors, stub.errors + 1, sizeof(unsigned) * (room - 1));
    --stub.error_count;
    return {code, 42, 7};
}
const char* hdGetErrorString(hd::Error) {
    return "stub";
}
void hdStartScheduler() {
    if (call() || stub.running) return;
    stub.running = true;
    stub.thread = std::thread([] {
        stub.servo = std::this_thread::get_id();
        auto next = std::chrono::steady_clock::now();
        while (stub.running) {
            if (!stub.stalled && stub.callback) {
                if (stub.always != 0) leave(stub.always);
                stub.z = stub.z + stub.speed * 1e-3;
                if (stub.callback(stub.context) == hd::callback_done) stub.callback = nullptr;
            }
            next += std::chrono::nanoseconds(1000000000ul / stub.rate);
            std::this_thread::sleep_until(next);
        }
    });
}
void hdStopScheduler() {
    stub.running = false;
    if (stub.thread.joinable()) stub.thread.join();
    if (stub.fail_in_stop >= 0) stub.fail_call = stub.calls + stub.fail_in_stop.exchange(-1);
    call();
}
void hdSetSchedulerRate(unsigned long rate) {
    if (!call()) stub.rate = rate;
}
hd::SchedulerHandle hdScheduleAsynchronous(hd::Callback callback, void* context, unsigned short) {
    if (call()) return 0;
    stub.callback = callback, stub.context = context;
    return 3;
}
void hdUnschedule(hd::SchedulerHandle) {
    call();
    stub.callback = nullptr;
}
hd::Enum hdCheckCalibration() {
    return call() ? 0 : stub.calibration.load();
}
void hdUpdateCalibration(hd::Enum) {
    if (!call()) stub.calibration = hd::calibration_ok;
}

// The test's side.
void stub_reset() {
    stub.fail_call = -1, stub.fail_code = 0x0302, stub.always = 0;
    stub.no_device = stub.stalled = false;
    stub.calibration = hd::calibration_ok;
    stub.speed = stub.z = 0;
    stub.calls = 0;
    stub.force = stub.largest = 0;
    stub.fault_time = stub.zero_time = -1;
    stub.fail_in_stop = -1, stub.closed = 0;
    stub.open = stub.frames = stub.in_frame = stub.bad_frames = stub.wrong_thread = 0;
    Guard guard;
    stub.error_count = 0;
}
void stub_set(const char* name, double value) {
    const std::string_view key(name);
    if (key == "fail_call") stub.fail_call = int(value), stub.fault_time = stub.zero_time = -1;
    if (key == "fail_next") stub.fault_time = stub.zero_time = -1, stub.fail_call = stub.calls + int(value);
    if (key == "fail_code") stub.fail_code = unsigned(value);
    if (key == "always") stub.fault_time = stub.zero_time = -1, stub.always = unsigned(value);
    if (key == "no_device") stub.no_device = value != 0;
    if (key == "fail_in_stop") stub.fail_in_stop = int(value);
    if (key == "stalled") stub.stalled = value != 0;
    if (key == "calibration") stub.calibration = unsigned(value);
    if (key == "speed") stub.speed = value;
    if (key == "z") stub.z = value;
}
double stub_get(const char* name) {
    const std::string_view key(name);
    if (key == "calls") return stub.calls;
    if (key == "force") return stub.force;
    if (key == "largest") return stub.largest;
    if (key == "fault_time") return stub.fault_time;
    if (key == "zero_time") return stub.zero_time;
    if (key == "open") return stub.open;
    if (key == "closed") return stub.closed;
    if (key == "frames") return stub.frames;
    if (key == "bad_frames") return stub.bad_frames;
    if (key == "wrong_thread") return stub.wrong_thread;
    return -1;
}
}
