#include <gtest/gtest.h>

#include <thread>

#include "haptic/rig.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"

// What goes wrong while hand, servo and body run together.
namespace innerspring {
namespace {

using namespace support;

// The body leaves the numbers in the middle of the press: no force from the next period on until its next
// step, then as at the start; never one that is not a number.
TEST(Faults, ABodyThatLeavesTheNumbersGivesNoForceAndBeginsAnew) {
    Rig rig("icosphere:vertices=162");
    rig.options.lockstep = true;
    rig.options.duration = 4;
    TemporaryFolder folder("nan");
    rig.options.record = folder.path / "hand.csv";
    SimulatedHand device = rig.device();
    Loads held = rig.loads;
    BodySide side(rig.body, held, 0, stepping(), rig.mapping);
    std::uint64_t broken = 0;  // periods before the body broke
    rig.options.before_step = [&](std::uint64_t n) {
        held.gravity = n == 300 ? Vector(0, std::nan(""), 0) : Vector(Vector::Zero());
    };
    rig.options.after_step = [&](const HandState& hand, const Touch& touch) {
        if (side.resets() == 1 && broken == 0) {
            broken = hand.tick;
            EXPECT_FALSE(touch.touching);
        }
    };
    const LoopReport report = run_haptic(side, dt, rig.mapping, device, rig.options);
    EXPECT_EQ(report.body_resets, 1);
    EXPECT_EQ(report.servo.faults, 1u);
    const std::vector<HandSample> samples = read_hand(rig.options.record);
    ASSERT_GT(samples[broken - 1].force.norm(), 0.1);
    for (const HandSample& s : samples) ASSERT_TRUE(s.force.allFinite());
    for (std::size_t n = broken; n < broken + 5; ++n) EXPECT_EQ(samples[n].force.norm(), 0) << n - broken;
    double early = 0, again = 0;
    for (std::size_t n = broken; n < samples.size(); ++n)
        (n < broken + 50 ? early : again) =
            std::max(n < broken + 50 ? early : again, samples[n].force.norm());
    EXPECT_LT(early, 0.25 * again);  // a tenth of the ramp
    EXPECT_GT(again, 0.1);
}

// A hand at 5 m/s through the body and back, again and again.
TEST(Faults, BearsADeviceAtFiveMetresPerSecondWithABody) {
    Rig rig("icosphere:vertices=162");
    rig.options.lockstep = true;
    rig.options.duration = 1.5;
    rig.options.servo.safety.ramp = 0.01;
    std::vector<HandSample> samples;
    for (int n = 0; n < 1500; ++n) {
        const int m = n % 60;  // 30 periods there, 30 back
        samples.push_back({n * 1e-3, {{0.01, 0, 0.075 - 0.005 * (m < 30 ? m : 60 - m)}}});
    }
    ReplayDevice device(samples, 1000);
    TemporaryFolder folder("fast");
    rig.options.record = folder.path / "hand.csv";
    const LoopReport report = rig.run(device);
    double most = 0;
    for (const HandSample& s : read_hand(rig.options.record)) {
        ASSERT_TRUE(s.force.allFinite());
        most = std::max(most, s.force.norm());
    }
    EXPECT_GT(most, 0);
    EXPECT_LE(most, device.info().max_force * (1 + 1e-12));
    EXPECT_GE(report.servo.observer_least, -1e-9);
}

// The body's thread sleeps for a second in the middle of the press: no force soon after, and again when it is
// back.
TEST(Faults, AStalledBodyLeavesNoForce) {
    TemporaryFolder folder("stall");
    Rig rig("icosphere:vertices=162");
    rig.options.duration = 4;
    rig.options.record = folder.path / "hand.csv";
    const auto start = std::chrono::steady_clock::now();
    bool slept = false;
    rig.options.before_step = [&](std::uint64_t) {
        const double now = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        if (now < 1.5 || slept) return;
        slept = true;
        std::this_thread::sleep_for(std::chrono::seconds(1));
    };
    // Pressed for the whole time.
    for (std::size_t n = 0; n < rig.script.size(); ++n)
        if (rig.script[n].time > 1.2) {
            rig.script.resize(n + 1);
            break;
        }
    rig.script.push_back({1e6, rig.script.back().pose});
    SimulatedHand device = rig.device();
    const LoopReport report = rig.run(device);
    EXPECT_GE(report.servo.stalls, 1u);
    const auto samples = read_hand(folder.path / "hand.csv");
    int longest = 0, run = 0;
    for (const HandSample& s : samples) {
        run = s.time > 1 && s.force.norm() == 0 ? run + 1 : 0;
        longest = std::max(longest, run);
    }
    if (!INNERSPRING_SANITIZED) {
        EXPECT_GT(longest, 500);
        EXPECT_GT(samples.back().force.norm(), 0.05);
    }
}

/// Is lost after so many periods, once, and does not open at the first attempt.
struct Lossy : WrappedDevice {
    using WrappedDevice::WrappedDevice;
    int left = 600, refusals = 1, opened = 0;
    void open() override {
        if (refusals-- > 0) throw DeviceError("not yet");
        ++opened;
        left = 1 << 30;
    }
    void close() noexcept override {}
    bool read(DeviceSample& s) noexcept override { return --left > 0 && inner_.read(s); }
    bool write(const Vector& f) noexcept override { return left > 0 && inner_.write(f); }
    DeviceFault fault() const noexcept override { return left > 0 ? DeviceFault::none : DeviceFault::lost; }
    std::string fault_text() const override { return "cable out"; }
};

TEST(Faults, ALostDeviceIsOpenedAgain) {
    Rig rig("icosphere:vertices=162");
    rig.options.duration = 2.5;
    rig.options.reopen = 0.1;
    rig.options.servo.stall = 0.5;
    SimulatedHand hand = rig.device();
    Lossy device(hand);
    const LoopReport report = rig.run(device);
    EXPECT_GE(device.opened, 1);  // more where a busy machine lets the servo sleep
    EXPECT_GE(report.reopened, 1u);
    EXPECT_TRUE(report.failure.empty());
    ASSERT_FALSE(report.notes.empty());
    EXPECT_NE(report.notes[0].find("cable out"), std::string::npos);
    EXPECT_GT(report.servo.ticks, 100u);
}

}  // namespace
}  // namespace innerspring
