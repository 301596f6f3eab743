#include "feeling.h"

#include <chrono>

namespace innerspring::viewer {

namespace {

constexpr double frame = 1.0 / 60;  ///< [s] between snapshots

double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

FeltView::FeltView(const BodySide& side, std::size_t tool, double dt) : side_(side), tool_(tool), dt_(dt) {
    publish(nullptr);
    buffer_.update();
}

void FeltView::attach(LoopOptions& options) {
    options.after_step = [this, before = std::move(options.after_step)](const HandState& hand,
                                                                        const innerspring::Touch& touch) {
        if (before) before(hand, touch);
        ++steps_;
        const double now = seconds();
        if (!every_step_ && now - last_ < frame) return;
        last_ = now;
        publish(&hand);
    };
    options.progress = [this, before = std::move(options.progress)](const LoopReport& report) {
        if (before) before(report);
        report_ = std::make_shared<const LoopReport>(report);
    };
}

void FeltView::publish(const HandState* hand) {
    Snapshot& into = buffer_.back();
    capture_(side_, tool_, into);
    into.dt = dt_;
    into.ticks = steps_;
    const HandMapping& m = side_.mapping();
    into.felt.emplace();
    into.felt->report = report_;
    if (hand) {
        into.felt->device = m.to_scene(hand->pose.position);
        into.felt->proxy = m.to_scene(hand->proxy);
        into.felt->force = m.rotation * hand->force;
        into.felt->health = hand->health;
        into.felt->heard = true;
    }
    if (report_ && report_->servo.work.count() > 0) {  // not in lockstep, which has no clock
        into.steps_per_second = report_->body_steps_per_second;
        into.real_time_factor = report_->seconds > 0 ? report_->body_time / report_->seconds : 0;
        into.bodies[0].step_ms = report_->body_work.quantile_ms(0.5);
    }
    ++into.taken;
    buffer_.publish();
}

Feeling::Feeling(BodySide& side, std::size_t tool, double dt, Device& device, LoopOptions options,
                 std::atomic<bool>& stop, PointedDevice* mouse)
    : mapping_(side.mapping()), mouse_(mouse), stop_(stop), view_(side, tool, dt) {
    view_.attach(options);
    options.stop = &stop;
    loop_ = std::async(std::launch::async, [this, &side, dt, &device, options = std::move(options)] {
        struct End {
            std::atomic<bool>& ended;
            ~End() { ended.store(true, std::memory_order_release); }
        } end{ended_};
        return run_haptic(side, dt, side.mapping(), device, options);
    });
}

Feeling::~Feeling() {
    stop_ = true;
    if (loop_.valid()) loop_.wait();
}

LoopReport Feeling::finish() {
    stop_ = true;
    return loop_.get();
}

}  // namespace innerspring::viewer
