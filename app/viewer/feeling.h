#pragma once
#include <future>

#include "innerspring/haptic/loop.h"
#include "innerspring/haptic/pointed.h"
#include "session.h"

namespace innerspring::viewer {

/// What is to be seen of a body that is felt, at most 60 times a second. Its hooks belong to the thread of
/// the body; the reader is another.
class FeltView {
  public:
    /// Keeps a reference. `tool`: the one in the hand.
    FeltView(const BodySide& side, std::size_t tool, double dt);
    /// Puts itself behind what the options call after a step and of progress.
    void attach(LoopOptions& options);
    /// Every step from now on, whatever the clock says: for pictures at a given time.
    void see_every_step() { every_step_ = true; }

    bool update() { return buffer_.update(); }
    const Snapshot& latest() const { return buffer_.front(); }

  private:
    void publish(const HandState* hand);

    const BodySide& side_;
    std::size_t tool_;
    double dt_;
    bool every_step_ = false;
    double last_ = -1;  ///< [s]
    std::uint64_t steps_ = 0;
    Capture capture_;
    std::shared_ptr<const LoopReport> report_;
    TripleBuffer<Snapshot> buffer_;
};

/// The haptic loop in a thread of its own beside the window, which shows it and, where the device is a mouse,
/// moves it.
class Feeling {
  public:
    /// Begins at once. `stop` ends it, and is set by finish(). `mouse`: null for other devices.
    Feeling(BodySide& side, std::size_t tool, double dt, Device& device, LoopOptions options,
            std::atomic<bool>& stop, PointedDevice* mouse = nullptr);
    ~Feeling();
    Feeling(const Feeling&) = delete;
    Feeling& operator=(const Feeling&) = delete;

    bool update() { return view_.update(); }
    const Snapshot& latest() const { return view_.latest(); }
    bool ended() const { return ended_.load(std::memory_order_acquire); }
    /// Waits for the loop's end. Throws what it threw. Once.
    LoopReport finish();

    bool has_mouse() const { return mouse_; }
    Vector mouse_start() const { return mapping_.to_scene(mouse_->beginning()); }  ///< [m], scene
    void point(const Vector& place, unsigned buttons) { mouse_->point(mapping_.to_hand(place), buttons); }

  private:
    HandMapping mapping_;
    PointedDevice* mouse_;
    std::atomic<bool>& stop_;
    FeltView view_;
    std::atomic<bool> ended_{false};
    std::future<LoopReport> loop_;  ///< last: everything is there when it starts
};

}  // namespace innerspring::viewer
