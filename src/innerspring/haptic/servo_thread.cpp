#include "innerspring/haptic/servo_thread.h"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#if defined(__linux__)
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#endif

namespace innerspring {

namespace {

using Clock = std::chrono::steady_clock;

std::chrono::nanoseconds period_of(double rate) {
    return std::chrono::nanoseconds(std::llround(1e9 / rate));
}

}  // namespace

void sleep_until(Clock::time_point start, double seconds) {
    std::this_thread::sleep_until(
        start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)));
}

std::string ask_for_realtime() noexcept {
#if defined(__linux__)
    sched_param parameter{};
    parameter.sched_priority = sched_get_priority_max(SCHED_FIFO) - 1;
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
    return error == 0 ? "" : std::strerror(error);
#else
    return "not known on this system";
#endif
}

ServoThread::ServoThread(Device& device, Servo& servo, bool realtime)
    : device_(device),
      servo_(servo),
      realtime_(realtime),
      told_every_(std::uint64_t(std::ceil(servo.options().rate / 10))) {
    if (!realtime) return;
#if defined(__linux__)
    // What is there now; later pages too where the limit allows it.
    if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
        notes_.push_back(fmt::format("memory is not locked ({}); raise ulimit -l", std::strerror(errno)));
    } else {
        locked_ = true;
    }
#else
    notes_.push_back("memory is not locked: not known on this system");
#endif
}

ServoThread::~ServoThread() {
    stop();
#if defined(__linux__)
    if (locked_) munlockall();
#endif
}

bool ServoThread::tick() noexcept {
    const auto woken = Clock::now();
    ServoStatistics& s = servo_.statistics();
    const auto period = period_of(servo_.options().rate);
    if (!first_) {
        const auto took = woken - last_;
        s.period_error.add(std::uint64_t(std::abs((took - period).count())));
        if (took > period + period / 2) {
            ++s.missed;
            s.missed_by_us += work_ > std::uint64_t(period.count());
        }
    }
    first_ = false;
    last_ = woken;
    const bool more = servo_.tick();
    work_ = std::uint64_t((Clock::now() - woken).count());
    s.work.add(work_);
    if (s.ticks % told_every_ == 0) servo_.progress().send(s);
    return more;
}

void ServoThread::keep_time() noexcept {
    if (realtime_) refused_ = ask_for_realtime();
    const auto period = period_of(servo_.options().rate);
    auto next = Clock::now();
    while (!quit_.load(std::memory_order_relaxed)) {
        if (!tick()) break;
        next += period;
        // After a missed period the times are counted from now: no burst of late ones.
        if (const auto now = Clock::now(); next < now) next = now;
        std::this_thread::sleep_until(next);
    }
    device_.write(Vector::Zero());
}

void ServoThread::start() {
    quit_ = false;
    first_ = true;
    by_device_ = device_.start(
        servo_.options().rate, [](void* self) noexcept { return static_cast<ServoThread*>(self)->tick(); },
        this);
    if (!by_device_) thread_ = std::thread([this] { keep_time(); });
    running_ = true;
}

void ServoThread::stop() noexcept {
    if (!running_) return;
    running_ = false;
    quit_ = true;
    if (by_device_) device_.stop();
    if (thread_.joinable()) thread_.join();
    if (!refused_.empty() && notes_.size() < 2)
        notes_.push_back(fmt::format("no real-time priority for the servo ({}); raise ulimit -r", refused_));
    refused_.clear();
}

EmptyLoop::EmptyLoop(double rate, bool realtime) {
    thread_ = std::thread([this, rate, realtime] {
        if (realtime) ask_for_realtime();
        const auto period = period_of(rate);
        auto next = Clock::now(), last = next;
        while (!quit_.load(std::memory_order_relaxed)) {
            next += period;
            if (const auto now = Clock::now(); next < now) next = now;
            std::this_thread::sleep_until(next);
            const auto now = Clock::now();
            missed_ += now - last > period + period / 2;
            last = now;
        }
    });
}

std::uint64_t EmptyLoop::stop() noexcept {
    quit_ = true;
    if (thread_.joinable()) thread_.join();
    return missed_;
}

}  // namespace innerspring
