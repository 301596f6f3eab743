#pragma once
#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "innerspring/haptic/servo.h"

namespace innerspring {

/// Sleeps until start + seconds of the steady clock.
void sleep_until(std::chrono::steady_clock::time_point start, double seconds);

/// Asks for the highest real-time priority less one for this thread; what was refused, or nothing.
std::string ask_for_realtime() noexcept;

/// Calls Servo::tick() at its rate: in a thread of its own, or from the device's, if that keeps the time.
/// Measures both the periods and the work.
class ServoThread {
  public:
    ServoThread(Device& device, Servo& servo, bool realtime);
    ~ServoThread();
    ServoThread(const ServoThread&) = delete;
    ServoThread& operator=(const ServoThread&) = delete;

    void start();  ///< throws DeviceError
    /// The last thing sent is no force. Idempotent.
    void stop() noexcept;
    const std::vector<std::string>& notes() const { return notes_; }  ///< what was not granted

  private:
    void keep_time() noexcept;
    bool tick() noexcept;

    Device& device_;
    Servo& servo_;
    bool realtime_;
    std::uint64_t told_every_;  ///< periods between reports of progress
    std::thread thread_;
    std::atomic<bool> quit_{false};
    bool running_ = false, by_device_ = false, locked_ = false;
    // Of the servo's thread.
    std::chrono::steady_clock::time_point last_;
    std::uint64_t work_ = 0;
    bool first_ = true;
    std::string refused_;  ///< read after the thread has ended
    std::vector<std::string> notes_;
};

/// A loop at the same rate that does nothing: the periods it misses, the machine has missed.
class EmptyLoop {
  public:
    EmptyLoop(double rate, bool realtime);
    ~EmptyLoop() { stop(); }
    std::uint64_t stop() noexcept;  ///< how many were missed

  private:
    std::atomic<bool> quit_{false};
    std::uint64_t missed_ = 0;
    std::thread thread_;
};

}  // namespace innerspring
