#include <dlfcn.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <thread>

#include "innerspring/haptic/loop.h"
#include "innerspring/haptic/openhaptics.h"
#include "innerspring/haptic/servo_thread.h"
#include "support/bodies.h"
#include "support/sanitized.h"

// The OpenHaptics device against a stand-in for its library (stub_hd.cpp).
namespace innerspring {
namespace {

/// The stub itself, as the test speaks to it; the device loads the same library again.
struct Stub {
    void* library = dlopen(STUB_HD, RTLD_NOW | RTLD_LOCAL);
    void (*reset)() = reinterpret_cast<void (*)()>(dlsym(library, "stub_reset"));
    void (*set)(const char*,
                double) = reinterpret_cast<void (*)(const char*, double)>(dlsym(library, "stub_set"));
    double (*get)(const char*) = reinterpret_cast<double (*)(const char*)>(dlsym(library, "stub_get"));
};

class OpenHaptics : public testing::Test {
  protected:
    void SetUp() override {
        ASSERT_TRUE(stub.library) << dlerror();
        stub.reset();
        OpenHapticsOptions options;
        options.library = STUB_HD;
        device = make_openhaptics(options);
    }
    void TearDown() override { device.reset(); }

    /// What open() complains of; empty if it does not.
    std::string complaint() {
        try {
            device->open();
        } catch (const DeviceError& error) {
            return error.what();
        }
        return {};
    }

    static void wait(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }
    template <class Condition>
    static bool within(double seconds, Condition condition) {
        for (int n = 0; n < 1000; ++n) {
            if (condition()) return true;
            wait(seconds / 1000);
        }
        return false;
    }

    Stub stub;
    std::unique_ptr<Device> device;
};

/// A wall the stub's stylus, at z = 0, is pressed into; sent all the time.
struct Wall {
    Servo& servo;
    std::atomic<bool> quit{false};
    std::thread thread;
    explicit Wall(Servo& s) : servo(s) {
        thread = std::thread([this] {
            LocalContact c{{0, 0, 0.003}, Vector::UnitZ(), 300, 0, 0, 0.005, 0};
            while (!quit) {
                ++c.step;
                servo.contacts().send(c);
                std::this_thread::sleep_for(std::chrono::milliseconds(2));
            }
        });
    }
    ~Wall() {
        quit = true;
        thread.join();
    }
};

ServoOptions quick() {
    ServoOptions options;
    options.safety.ramp = 0.05;
    options.stall = 0.2;  // the machine may be busy
    return options;
}

TEST_F(OpenHaptics, SaysWhatWasLookedForAndWhere) {
    OpenHapticsOptions options;
    options.library = "/nowhere/libHD.so";
    device = make_openhaptics(options);
    EXPECT_NE(complaint().find("/nowhere/libHD.so"), std::string::npos);
    device = make_openhaptics();
    const std::string text = complaint();
    if (!text.empty()) {  // on a machine with the vendor's library it opens or says why
        EXPECT_NE(text.find("OpenHaptics"), std::string::npos);
        EXPECT_EQ(text.find('\n'), std::string::npos);
    }
}

TEST_F(OpenHaptics, SaysWhichFunctionIsMissing) {
    OpenHapticsOptions options;
    options.library = "libm.so.6";
    device = make_openhaptics(options);
    EXPECT_NE(complaint().find("has no hdInitDevice"), std::string::npos);
}

TEST_F(OpenHaptics, DescribesItself) {
    ASSERT_EQ(complaint(), "");
    const DeviceInfo& info = device->info();
    EXPECT_EQ(info.name, "Stub Phantom");
    EXPECT_LT((info.workspace.lower - Vector(-0.08, -0.06, -0.035)).norm(), 1e-12);
    EXPECT_EQ(info.max_force, 7.9);
    EXPECT_EQ(info.max_continuous_force, 1.75);
    EXPECT_NEAR(info.max_stiffness, 1000, 1e-9);  // 1 N/mm
    EXPECT_NEAR(info.max_damping, 5, 1e-9);       // 0.005 N s/mm
    EXPECT_EQ(info.input_dof, 6);
    EXPECT_EQ(info.output_dof, 3);
    device->close();
    EXPECT_EQ(stub.get("open"), 0);
    ASSERT_EQ(complaint(), "");  // and again
}

TEST_F(OpenHaptics, Calibrates) {
    stub.set("calibration", 0x5001);
    EXPECT_EQ(complaint(), "");
    device->close();
    stub.set("calibration", 0x5002);
    EXPECT_NE(complaint().find("inkwell"), std::string::npos);
    EXPECT_EQ(stub.get("open"), 0);
}

TEST_F(OpenHaptics, NoDeviceIsOneLine) {
    stub.set("no_device", 1);
    const std::string text = complaint();
    EXPECT_NE(text.find("device fault (0x0300"), std::string::npos) << text;
    EXPECT_NE(text.find("plugged in"), std::string::npos) << text;
}

// Each call of opening and of starting fails in turn: a line, nothing left open, and it opens after.
TEST_F(OpenHaptics, EveryCallOfOpeningMayFail) {
    ASSERT_EQ(complaint(), "");
    const int calls = int(stub.get("calls"));
    ASSERT_GT(calls, 10);
    device->close();
    for (int n = 0; n < calls; ++n) {
        stub.reset();
        stub.set("fail_call", n);
        const std::string text = complaint();
        EXPECT_NE(text.find("communication error (0x0302"), std::string::npos) << n << ": " << text;
        EXPECT_EQ(text.find('\n'), std::string::npos);
        EXPECT_EQ(stub.get("open"), 0) << n;
        stub.set("fail_call", -1);
        EXPECT_EQ(complaint(), "") << n;
        device->close();
    }
}

// And each call of starting: a line, no thread left behind, no force, and it starts after.
TEST_F(OpenHaptics, EveryCallOfStartingMayFail) {
    for (int n = 0; n < 3; ++n) {
        stub.reset();
        ASSERT_EQ(complaint(), "");
        Servo servo(*device, quick());
        stub.set("fail_next", n);
        ServoThread thread(*device, servo, false);
        try {
            thread.start();
            ADD_FAILURE() << n;
        } catch (const DeviceError& error) {
            const std::string text = error.what();
            EXPECT_NE(text.find("communication error (0x0302"), std::string::npos) << n << ": " << text;
            EXPECT_EQ(text.find('\n'), std::string::npos);
        }
        EXPECT_EQ(stub.get("force"), 0);
        stub.set("fail_call", -1);
        thread.start();
        EXPECT_TRUE(within(5, [&] { return stub.get("frames") > 10; })) << n;
        thread.stop();
        device->close();
        EXPECT_EQ(stub.get("open"), 0) << n;
    }
}

// And each call of stopping and closing: no thread goes on, and it opens after.
TEST_F(OpenHaptics, EveryCallOfStoppingMayFail) {
    for (int n = 0; n < 7; ++n) {
        stub.reset();
        ASSERT_EQ(complaint(), "");
        Servo servo(*device, quick());
        {
            Wall wall(servo);
            ServoThread thread(*device, servo, false);
            thread.start();
            ASSERT_TRUE(within(5, [&] { return stub.get("force") > 0.2; })) << n;
            stub.set("fail_in_stop", n);
            thread.stop();
        }
        device->close();
        const double frames = stub.get("frames");
        wait(0.005);
        EXPECT_EQ(stub.get("frames"), frames) << n;
        EXPECT_EQ(stub.get("force"), 0) << n;
        EXPECT_EQ(stub.get("open"), 0) << n;
    }
    stub.reset();
    EXPECT_EQ(complaint(), "");
    device->close();
}

// The scheduler stops calling: closed and opened again, and it goes on.
TEST_F(OpenHaptics, ASchedulerThatStopsCallingIsStartedAgain) {
    ASSERT_EQ(complaint(), "");
    support::BodyRecipe recipe;
    const Body body = support::make_sphere("icosphere:vertices=42", recipe);
    Loads loads{Vector::Zero(), {}, {}, {sphere_tool(0.3, {0, 0, 1.6})}};
    StepOptions step;
    step.dt = 0.005;
    const HandMapping mapping = fit_mapping(body, loads.tools[0], device->info(), 400);
    BodySide side(body, loads, 0, step, mapping);
    LoopOptions options;
    options.realtime = false, options.duration = 0, options.reopen = 0.05;
    std::atomic<bool> stop{false};
    options.stop = &stop;
    std::uint64_t again = 0;
    options.after_step = [&](const HandState& hand, const Touch&) {
        if (stub.get("frames") > 100 && stub.get("closed") == 0) stub.set("stalled", 1);
        if (stub.get("closed") > 0) {
            stub.set("stalled", 0);
            if (again == 0) again = hand.tick;
            if (hand.tick > again + 50) stop = true;
        }
    };
    std::thread guard([&] {  // the stub goes on once the loop has closed the device
        for (int n = 0; n < 20000 && !stop; ++n) {
            if (stub.get("closed") > 0) stub.set("stalled", 0);
            wait(0.001);
        }
        stop = true;
    });
    const LoopReport report = run_haptic(side, 0.005, mapping, *device, options);
    stop = true;
    guard.join();
    EXPECT_GE(report.reopened, 1u);
    EXPECT_TRUE(report.failure.empty()) << report.failure;
    ASSERT_FALSE(report.notes.empty());
    EXPECT_NE(report.notes[0].find("no longer calls"), std::string::npos) << report.notes[0];
    device->close();
}

TEST_F(OpenHaptics, TheServoRunsInTheSchedulerAndPushes) {
    ASSERT_EQ(complaint(), "");
    Servo servo(*device, quick());
    const double k_c = servo.gains().stiffness, settled = 0.003 * 300 * k_c / (300 + k_c);
    {
        Wall wall(servo);
        ServoThread thread(*device, servo, false);
        thread.start();
        EXPECT_TRUE(within(5, [&] { return std::abs(stub.get("force") - settled) < 1e-7; }))
            << stub.get("force");
        thread.stop();
    }
    EXPECT_EQ(stub.get("force"), 0);  // nothing is left behind
    EXPECT_EQ(stub.get("bad_frames"), 0);
    EXPECT_EQ(stub.get("wrong_thread"), 0);
    EXPECT_GT(servo.statistics().ticks, 30u);
    EXPECT_EQ(servo.statistics().faults, 0u);
    EXPECT_NEAR(servo.statistics().force_max, settled, 1e-6);
    device->close();
}

// Every call of a running servo fails in turn: no force in that period or the next, and it comes back.
TEST_F(OpenHaptics, EveryCallOfTheServoMayFail) {
    ASSERT_EQ(complaint(), "");
    Servo servo(*device, quick());
    Wall wall(servo);
    ServoThread thread(*device, servo, false);
    thread.start();
    for (const unsigned code : {0x0203u, 0x0200u}) {
        stub.set("fail_code", code);
        for (int call = 0; call < 12; ++call) {
            ASSERT_TRUE(within(5, [&] { return stub.get("force") > 0.2; })) << call;
            stub.set("fail_next", call);
            ASSERT_TRUE(within(5, [&] { return stub.get("zero_time") >= 0; })) << call;
            const double took = stub.get("zero_time") - stub.get("fault_time");
            EXPECT_LT(took, INNERSPRING_SANITIZED ? 0.2 : 0.01) << call;
        }
    }
    thread.stop();
    EXPECT_GE(servo.statistics().faults, 20u);
    device->close();
}

TEST_F(OpenHaptics, ADeviceThatStaysFaultyGetsNoForce) {
    ASSERT_EQ(complaint(), "");
    Servo servo(*device, quick());
    Wall wall(servo);
    ServoThread thread(*device, servo, false);
    thread.start();
    ASSERT_TRUE(within(5, [&] { return stub.get("force") > 0.2; }));
    stub.set("always", 0x0300);
    ASSERT_TRUE(within(5, [&] { return stub.get("zero_time") >= 0; }));
    for (int n = 0; n < 50; ++n) {
        wait(0.001);
        EXPECT_EQ(stub.get("force"), 0);
    }
    servo.hands().update();
    EXPECT_EQ(servo.hands().latest().health, ServoHealth::lost);
    EXPECT_NE(device->fault_text().find("device fault"), std::string::npos);
    stub.set("always", 0);
    EXPECT_TRUE(within(5, [&] { return stub.get("force") > 0.2; }));
    thread.stop();
    device->close();
}

TEST_F(OpenHaptics, FiveMetresPerSecondStayWithinTheClamp) {
    ASSERT_EQ(complaint(), "");
    Servo servo(*device, quick());
    Wall wall(servo);
    ServoThread thread(*device, servo, false);
    thread.start();
    ASSERT_TRUE(within(5, [&] { return stub.get("force") > 0.2; }));
    stub.set("speed", -5000);
    wait(0.2);
    EXPECT_LE(stub.get("largest"), 7.9);
    stub.set("speed", 0);
    thread.stop();
    device->close();
}

}  // namespace
}  // namespace innerspring
