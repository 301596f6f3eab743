#include "session.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "innerspring/mesh/error.h"

namespace innerspring::viewer {

namespace {

constexpr double frame = 1.0 / 60;  ///< [s] between snapshots
constexpr double most_debt = 0.1;   ///< [s] of clock it may lag before it gives up on them

double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

Session::Session(std::unique_ptr<Rig> rig) : rig_(std::move(rig)) {
    publish();
    thread_ = std::thread([this] { loop(); });
}

Session::~Session() {
    {
        const std::lock_guard lock(mutex_);
        quit_ = true;
    }
    wake_.notify_one();
    thread_.join();
}

void Session::send(Command command, std::optional<std::size_t> only) {
    {
        const std::lock_guard lock(mutex_);
        inbox_.push_back([command = std::move(command), only](Rig& rig) {
            rig.apply(command, only);
            return std::string();
        });
    }
    wake_.notify_one();
}

void Session::ask(std::function<std::string(const Rig&)> task) {
    {
        const std::lock_guard lock(mutex_);
        inbox_.push_back([task = std::move(task)](Rig& rig) { return task(rig); });
    }
    wake_.notify_one();
}

void Session::change(const std::function<void(Control&)>& how) {
    {
        const std::lock_guard lock(mutex_);
        how(asked_);
        changed_ = true;
    }
    wake_.notify_one();
}

void Session::pause(bool paused) {
    change([&](Control& c) { c.paused = paused; });
}
void Session::single_step() {
    change([&](Control& c) { ++c.single_steps; });
}
void Session::set_speed(double speed) {
    change([&](Control& c) { c.speed = std::isfinite(speed) ? std::clamp(speed, 1e-3, 100.0) : 1; });
}

void Session::publish() {
    Snapshot& into = buffer_.back();
    into.message = message_;
    capture_(*rig_, into);
    if (into.message != message_) message_ = into.message, ++said_;
    for (BodySnapshot& body : into.bodies) body.step_ms = step_ms_;
    into.real_time_factor = factor_;
    into.steps_per_second = rate_;
    into.speed = control_.speed;
    into.paused = control_.paused;
    into.said = said_;
    into.taken = ++taken_;
    buffer_.publish();
}

void Session::take_step() {
    const double start = seconds();
    if (!rig_->advance()) {
        control_.paused = true;
        const std::lock_guard lock(mutex_);
        asked_.paused = true;
    }
    if (const auto same = rig_->as_recorded(); same && !told_) {
        told_ = true;
        message_ = *same ? "replayed to its end: the same bits as recorded"
                         : "replayed to its end: NOT the bits that were recorded";
        ++said_;
    }
    const double ms = 1000 * (seconds() - start);
    step_ms_ = step_ms_ == 0 ? ms : step_ms_ + 0.1 * (ms - step_ms_);
}

void Session::measure_pace(double now) {
    const double span = now - pace_from_;
    if (span < 0.5) return;
    const double ticks = double(rig_->ticks() - pace_ticks_);
    rate_ = ticks / span;
    factor_ = rate_ * (*rig_)[0].dt();
    pace_from_ = now, pace_ticks_ = rig_->ticks();
}

void Session::loop() {
    double last = seconds(), shown = 0, debt = 0;
    pace_from_ = last;
    while (true) {
        std::vector<std::function<std::string(Rig&)>> inbox;
        bool news = false;
        {
            const std::lock_guard lock(mutex_);
            if (quit_) return;
            inbox.swap(inbox_);
            if (changed_) {
                control_ = asked_;
                asked_.single_steps = 0;
                changed_ = false;
                news = true;
            }
        }
        for (const auto& task : inbox) {
            news = true;
            try {
                if (std::string said = task(*rig_); !said.empty()) message_ = std::move(said), ++said_;
            } catch (const std::exception& error) {
                message_ = error.what(), ++said_;
            }
        }

        const double dt = (*rig_)[0].dt(), start = seconds();
        if (control_.paused) {
            debt = 0;
            for (; control_.single_steps > 0; --control_.single_steps) take_step();
        } else {
            debt = std::min(debt + (start - last) * control_.speed, most_debt * control_.speed + dt);
            control_.single_steps = 0;
            for (; debt >= dt && !control_.paused && seconds() - start < frame; debt -= dt) take_step();
        }
        last = start;

        const double now = seconds();
        measure_pace(now);
        if (news || (!control_.paused && now - shown >= frame) || now - shown >= 0.25) publish(), shown = now;

        std::unique_lock lock(mutex_);
        const double until_due = control_.paused ? 0.05 : std::min((dt - debt) / control_.speed, frame);
        if (until_due > 0)
            wake_.wait_for(lock, std::chrono::duration<double>(until_due),
                           [&] { return quit_ || changed_ || !inbox_.empty(); });
    }
}

}  // namespace innerspring::viewer
