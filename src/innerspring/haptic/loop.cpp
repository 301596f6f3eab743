#include "innerspring/haptic/loop.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "innerspring/haptic/servo_thread.h"

namespace innerspring {

namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// What a recording device wrote goes from the ring to the file, about ten times a second.
class Recording {
  public:
    explicit Recording(const std::string& file) : writer_(file), ring_(1 << 16) {}
    Ring<HandSample>& ring() { return ring_; }
    void drain(bool flush) {
        HandSample sample;
        while (ring_.pop(sample)) writer_.add(sample);
        if (flush) writer_.flush();
    }

  private:
    HandWriter writer_;
    Ring<HandSample> ring_;
};

struct Turns {
    BodySide& body;
    Servo& servo;
    const LoopOptions& options;
    LoopReport& report;
    Clock::time_point start = Clock::now();
    double body_start = body.state().time;
    Clock::time_point last{};  ///< body step

    const HandState& body_step() {
        servo.hands().update();
        const HandState& hand = servo.hands().latest();
        if (options.before_step) options.before_step(report.body_steps);
        const auto begin = Clock::now();
        LocalContact contact = body.step(hand);
        // By the clock the next one comes when it comes; what the last took is the best guess.
        if (!options.lockstep) {
            if (report.body_steps > 0)
                contact.period =
                    std::clamp(std::chrono::duration<double>(begin - last).count(), contact.period, 0.2);
            last = begin;
        }
        servo.contacts().send(contact);
        report.body_work.add(std::uint64_t(since(begin) * 1e9));
        ++report.body_steps;
        if (options.after_step) options.after_step(hand, body.touch());
        if (options.progress) tell();
        return hand;
    }

    void tell() {
        if (options.lockstep) {
            if (report.body_steps % 20 != 0) return;
            sum_up(servo.statistics(), since(start));
        } else {
            if (!servo.progress().update()) return;
            sum_up(servo.progress().latest(), since(start));
        }
        options.progress(report);
    }

    void sum_up(const ServoStatistics& statistics, double seconds) {
        report.servo = statistics;
        report.seconds = seconds;
        const double simulated = double(statistics.ticks) / options.servo.rate;
        const double span = options.lockstep ? simulated : report.seconds;
        report.rate_hz = span > 0 ? double(statistics.ticks) / span : 0;
        report.body_steps_per_second = span > 0 ? double(report.body_steps) / span : 0;
        report.body_time = body.state().time - body_start;
        report.body_resets = body.resets();
        report.vertices = body.body().vertices();
        report.refinements = body.refinements();
    }
};

bool asked_to_stop(const LoopOptions& options) {
    return options.stop && options.stop->load(std::memory_order_relaxed);
}

void run_lockstep(Turns& turns, double dt, Recording* recording) {
    const double ticks_per_step = dt * turns.options.servo.rate;
    const double last = turns.options.duration * turns.options.servo.rate;
    double due = 0;
    for (std::uint64_t tick = 0; last == 0 || double(tick) < last; ++tick) {
        const bool more = turns.servo.tick();
        if (double(tick) >= due) {
            turns.body_step();
            due += ticks_per_step;
            if (recording) recording->drain(turns.report.body_steps % 100 == 0);
            if (asked_to_stop(turns.options)) break;
        }
        if (!more) break;
    }
}

}  // namespace

LoopReport run_haptic(BodySide& body, double dt, const HandMapping& mapping, Device& opened,
                      const LoopOptions& options) {
    if (!(options.duration >= 0 && std::isfinite(options.duration)))
        throw InputError("haptic: the duration must be finite and not negative [s]");
    LoopReport report;
    std::optional<Recording> recording;
    std::optional<RecordedDevice> recorded;
    if (!options.record.empty()) {
        recording.emplace(options.record);
        recorded.emplace(opened, recording->ring());
    }
    Device& device = recorded ? static_cast<Device&>(*recorded) : opened;
    const auto servo = std::make_unique<Servo>(device, options.servo);
    report.device = device.info();
    report.gains = servo->gains();
    report.mapping = mapping;
    Turns turns{body, *servo, options, report};
    Clock::time_point& start = turns.start;

    double ended = 0;  // [s]

    if (options.lockstep) {
        run_lockstep(turns, dt, recording ? &*recording : nullptr);
        ended = since(start);
        device.write(Vector::Zero());
    } else {
        ServoThread thread(device, *servo, options.realtime);
        std::optional<EmptyLoop> empty;
        if (options.empty_loop) empty.emplace(options.servo.rate, options.realtime);
        thread.start();
        start = Clock::now();  // locking memory takes its time
        double next = 0, last_flush = 0, last_tick = 0;
        std::uint64_t tick = 0;
        std::optional<double> closed;  // when the device was last seen to be away
        while (!asked_to_stop(options)) {
            const double now = since(start);
            if (options.duration > 0 && now >= options.duration) break;
            if (!closed && tick == 0 && report.body_steps == 0) {
                // Where the hand is must be known before the tool is put there.
                servo->hands().update();
                tick = servo->hands().latest().tick;
                last_tick = now;
                if (tick == 0 && now > 1) {
                    report.failure = report.device.name + ": its servo does not call";
                    break;
                }
            } else if (!closed) {
                const HandState& hand = turns.body_step();
                if (hand.finished) break;
                if (hand.tick != tick) tick = hand.tick, last_tick = now;
                // Lost, or its own clock has stopped: close and open again.
                const bool silent = since(start) - last_tick > 0.25 && report.body_steps > 10;
                if (hand.health == ServoHealth::lost || silent) {
                    thread.stop();
                    const std::string what = device.fault_text();
                    report.notes.push_back(fmt::format("{}: lost after {:.1f} s ({})", report.device.name,
                                                       now,
                                                       silent         ? "its servo no longer calls"
                                                       : what.empty() ? "it does not answer"
                                                                      : what));
                    device.close();
                    closed = since(start);
                    report.failure = report.notes.back();
                }
            } else if (now - *closed >= options.reopen) {
                try {
                    device.open();
                    servo->recover();
                    thread.start();
                    ++report.reopened;
                    report.failure.clear();
                    closed.reset();
                    last_tick = since(start);
                } catch (const DeviceError&) {
                    closed = now;
                    device.close();
                }
            }
            if (recording && since(start) - last_flush > 0.1) {
                recording->drain(true);
                last_flush = since(start);
            }
            // On to the next step by the clock; a body that cannot keep up goes on without a rest.
            next = std::max(next + dt, since(start) - dt);
            sleep_until(start, next);
        }
        ended = since(start);
        thread.stop();
        report.notes.insert(report.notes.end(), thread.notes().begin(), thread.notes().end());
        if (empty) {
            report.missed_empty = empty->stop();
            report.has_empty = true;
        }
    }
    turns.sum_up(servo->statistics(), ended);
    if (recording) {
        recording->drain(true);
        report.lost_samples = recording->ring().dropped();
    }
    if (!body.refine_failure().empty()) report.notes.push_back("refinement ended: " + body.refine_failure());
    return report;
}

}  // namespace innerspring
