#pragma once
#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "rig.h"
#include "snapshot.h"

namespace innerspring::viewer {

/// Three buffers, so that one thread can always write and another always read the newest without either
/// waiting.
template <class T>
class TripleBuffer {
  public:
    T& back() { return buffers_[back_]; }
    void publish() { back_ = middle_.exchange(back_ | fresh, std::memory_order_acq_rel) & ~fresh; }
    /// The newest; true if it is another one than before.
    bool update() {
        if (!(middle_.load(std::memory_order_relaxed) & fresh)) return false;
        front_ = middle_.exchange(front_, std::memory_order_acq_rel) & ~fresh;
        return true;
    }
    const T& front() const { return buffers_[front_]; }

  private:
    static constexpr unsigned fresh = 4;
    std::array<T, 3> buffers_;
    std::atomic<unsigned> middle_{1};
    unsigned back_ = 0, front_ = 2;
};

/// A rig stepping in its own thread at the pace of a clock. Where it cannot keep up it slows down rather than
/// fall behind. What it is told takes effect between steps; what it shows is read without waiting.
class Session {
  public:
    explicit Session(std::unique_ptr<Rig> rig);
    ~Session();
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    /// To all bodies, or to one.
    void send(Command command, std::optional<std::size_t> only = {});
    void pause(bool paused);
    void single_step();
    /// Seconds simulated per second; 1 is real time.
    void set_speed(double speed);
    /// Calls `task` in the session's thread between two steps; what it returns, if anything, is shown as
    /// message.
    void ask(std::function<std::string(const Rig&)> task);

    /// True if there is a newer snapshot than at the last call. For one reader.
    bool update() { return buffer_.update(); }
    const Snapshot& latest() const { return buffer_.front(); }

  private:
    struct Control {
        bool paused = false;
        int single_steps = 0;
        double speed = 1;
    };
    void loop();
    void change(const std::function<void(Control&)>& how);
    void publish();
    void take_step();
    void measure_pace(double now);

    std::unique_ptr<Rig> rig_;
    TripleBuffer<Snapshot> buffer_;

    std::mutex mutex_;  ///< held only to move what follows
    std::condition_variable wake_;
    std::vector<std::function<std::string(Rig&)>> inbox_;
    Control asked_;
    bool changed_ = false, quit_ = false;

    // Of the thread.
    Control control_;
    Capture capture_;
    std::string message_;
    bool told_ = false;  ///< how a replay ended
    std::uint64_t said_ = 0, taken_ = 0;
    double step_ms_ = 0;
    double pace_from_ = 0, factor_ = 0, rate_ = 0;  ///< seconds; of the last half second
    std::uint64_t pace_ticks_ = 0;

    std::thread thread_;  ///< last: everything is there when it starts
};

}  // namespace innerspring::viewer
