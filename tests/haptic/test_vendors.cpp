#include <dlfcn.h>
#include <gtest/gtest.h>

#include <thread>

#include "innerspring/haptic/forcedimension.h"
#include "innerspring/haptic/pointed.h"
#include "innerspring/haptic/servo.h"
#include "innerspring/haptic/spacenavigator.h"

// What points without feeling, and Force Dimension's devices, against stand-ins for their libraries.
namespace innerspring {
namespace {

constexpr double T = 1e-3;

/// What open() complains of; empty if it does not.
std::string complaint(Device& device) {
    try {
        device.open();
    } catch (const DeviceError& error) {
        return error.what();
    }
    return {};
}

template <class Function>
Function* symbol(const char* library, const char* name) {
    return reinterpret_cast<Function*>(dlsym(dlopen(library, RTLD_NOW | RTLD_LOCAL), name));
}

// x' = (told - x) / lag: after a time t the way left is exp(-t / 20 ms), and the velocity is that of the
// motion.
TEST(PointedDevice, FollowsWithItsLagAndWithinItsSpeed) {
    PointedDevice mouse("mouse", 1 / T);
    DeviceSample before, now;
    mouse.read(before);
    const Vector start = mouse.beginning(), told = start + Vector(0.002, -0.001, -0.003);
    EXPECT_EQ(before.pose.position, start);
    EXPECT_EQ(before.velocity, Vector(0, 0, 0));
    mouse.point(told, 4);
    mouse.read(now);  // hears of it
    for (int n = 1; n <= 100; ++n) {
        mouse.write({1, 2, 3});  // not felt
        mouse.read(now);
        EXPECT_LT((now.pose.position - told - std::exp(-n * T / 0.02) * (start - told)).norm(), 1e-12);
        EXPECT_LT((now.velocity - (now.pose.position - before.pose.position) / T).norm(), 1e-9);
        before = now;
    }
    EXPECT_EQ(now.buttons, 4u);
    mouse.point({1e9, 0, 0});  // to the face of the workspace, no faster than a hand
    for (int n = 0; n < 1000; ++n) {
        mouse.write({0, 0, 0});
        mouse.read(now);
        EXPECT_LE(now.velocity.norm(), 0.5 + 1e-9);
    }
    EXPECT_NEAR(now.pose.position.x(), mouse.info().workspace.upper.x(), 1e-9);
    mouse.point({std::nan(""), 0, 0});
    mouse.write({0, 0, 0});
    mouse.read(now);
    EXPECT_TRUE(now.pose.position.allFinite());
    EXPECT_THROW(PointedDevice("mouse", 0), InputError);
}

TEST(SpaceNavigator, DeflectionIsVelocity) {
    const auto event = symbol<void(int, int, int, int)>(STUB_SPNAV, "stub_event");
    const auto there = symbol<void(int)>(STUB_SPNAV, "stub_daemon");
    const auto open = symbol<int()>(STUB_SPNAV, "stub_open");
    ASSERT_TRUE(event && there && open) << dlerror();
    SpaceNavigatorOptions options;
    options.library = STUB_SPNAV;
    const auto device = make_spacenavigator(options);
    there(0);
    EXPECT_NE(complaint(*device).find("spacenavd does not answer"), std::string::npos);
    there(1);
    ASSERT_EQ(complaint(*device), "");
    EXPECT_EQ(open(), 1);
    DeviceSample sample;
    const auto until = [&](auto&& condition) {  // by the machine's time, so without a bound on it
        for (int n = 0; n < 20000; ++n) {
            device->write({0, 0, 0});
            device->read(sample);
            if (condition()) return true;
            std::this_thread::sleep_for(std::chrono::microseconds(500));
        }
        return false;
    };
    device->read(sample);
    const Vector start = sample.pose.position;
    event(1, 10, -10, 10);  // within the dead zone
    event(2, 1, 1, 0);      // button 1 down
    ASSERT_TRUE(until([&] { return sample.buttons == 2; }));
    EXPECT_LT((sample.pose.position - start).norm(), 1e-12);
    event(1, 350, 0, 0);
    ASSERT_TRUE(until([&] { return sample.pose.position.x() > start.x() + 0.005; }));
    EXPECT_NEAR(sample.pose.position.y(), start.y(), 1e-12);
    event(1, 0, 0, 350);  // away from the user
    ASSERT_TRUE(until([&] { return sample.pose.position.z() < start.z() - 0.005; }));
    event(1, -350, 0, 0);  // to the wall and no farther
    ASSERT_TRUE(until([&] { return sample.pose.position.x() < device->info().workspace.lower.x() + 1e-6; }));
    event(1, 0, 0, 0);
    event(2, 0, 1, 0);
    ASSERT_TRUE(until([&] { return sample.buttons == 0; }));
    device->close();
    EXPECT_EQ(open(), 0);
    options.library = "libm.so.6";
    EXPECT_NE(complaint(*make_spacenavigator(options)).find("has no spnav_open"), std::string::npos);
    options.library = "/nowhere/libspnav.so";
    EXPECT_NE(complaint(*make_spacenavigator(options)).find("looked for /nowhere/libspnav.so"),
              std::string::npos);
    options.dead = 1;
    EXPECT_THROW(make_spacenavigator(options), InputError);
}

struct ForceDimension : testing::Test {
    void (*set)(const char*, double, double,
                double) = symbol<void(const char*, double, double, double)>(STUB_DHD, "stub_set");
    double (*get)(const char*) = symbol<double(const char*)>(STUB_DHD, "stub_get");
    std::unique_ptr<Device> device;
    void SetUp() override {
        ASSERT_TRUE(set && get) << dlerror();
        set("fail_call", -1, 0, 0);
        set("x", 0, 0, 0), set("v", 0, 0, 0);
        ForceDimensionOptions options;
        options.library = STUB_DHD;
        device = make_forcedimension(options);
    }
};

// Theirs is x to the user, y right, z up; ours x right, y up, z to the user. Positions, velocities, forces
// and turns go the same way, so that no power is lost.
TEST_F(ForceDimension, TurnsItsFrameIntoOurs) {
    ASSERT_EQ(complaint(*device), "");
    EXPECT_EQ(device->info().name, "Stub omega");
    EXPECT_EQ(get("motors"), 1);
    set("x", 0.01, 0.02, 0.03), set("v", 1, 2, 3);
    DeviceSample sample;
    ASSERT_TRUE(device->read(sample));
    EXPECT_EQ(sample.pose.position, Vector(0.02, 0.03, 0.01));
    EXPECT_EQ(sample.velocity, Vector(2, 3, 1));
    EXPECT_EQ(sample.buttons, 2u);
    // A quarter about their z, which is our y: our z goes to our x.
    EXPECT_LT((sample.pose.rotation * Vector::UnitZ() - Vector::UnitX()).norm(), 1e-12);
    EXPECT_LT((sample.pose.rotation * Vector::UnitY() - Vector::UnitY()).norm(), 1e-12);
    const Vector force(0.5, -1, 2);
    ASSERT_TRUE(device->write(force));
    EXPECT_NEAR(get("fx") * 1 + get("fy") * 2 + get("fz") * 3, force.dot(sample.velocity), 1e-12);
    device->close();
    EXPECT_EQ(std::abs(get("fx")) + std::abs(get("fy")) + std::abs(get("fz")), 0);
    EXPECT_EQ(get("motors"), 0);
    EXPECT_EQ(get("open"), 0);
}

TEST_F(ForceDimension, EveryCallOfOpeningMayFail) {
    set("fail_call", -1, 0, 0);
    ASSERT_EQ(complaint(*device), "");
    const int calls = int(get("calls"));
    ASSERT_GE(calls, 5);
    device->close();
    for (int n = 0; n < calls; ++n) {
        set("fail_call", n, 0, 0);
        const std::string text = complaint(*device);
        EXPECT_NE(text.find("stub error"), std::string::npos) << n << ": " << text;
        EXPECT_EQ(text.find('\n'), std::string::npos);
        EXPECT_EQ(get("open"), 0) << n;
        set("fail_call", -1, 0, 0);
        EXPECT_EQ(complaint(*device), "") << n;
        device->close();
    }
    ForceDimensionOptions options;
    options.library = "libm.so.6";
    EXPECT_NE(complaint(*make_forcedimension(options)).find("has no dhdOpen"), std::string::npos);
}

// Each call of a servo's period fails in turn while it pushes: no force in that period, and it comes back.
TEST_F(ForceDimension, EveryCallOfTheServoMayFail) {
    ASSERT_EQ(complaint(*device), "");
    ServoOptions options;
    options.safety.ramp = 0;
    Servo servo(*device, options);
    LocalContact wall{{0, 0, 0.003}, Vector::UnitZ(), 300, 0, 0, 0.005, 0};
    const auto force = [&] { return std::hypot(get("fx"), get("fy"), get("fz")); };
    const auto run = [&](int ticks) {
        for (int n = 0; n < ticks; ++n) {
            if (n % 5 == 0) ++wall.step, servo.contacts().send(wall);
            servo.tick();
        }
    };
    for (int call = 0; call < 4; ++call) {
        run(100);
        ASSERT_GT(force(), 0.3) << call;
        EXPECT_GT(get("fx"), 0.3);  // our z is their x
        set("fail_call", call, 0, 0);
        servo.tick();
        EXPECT_EQ(force(), 0) << call;
        servo.hands().update();
        EXPECT_EQ(servo.hands().latest().health, ServoHealth::lost);
        set("fail_call", -1, 0, 0);
    }
    EXPECT_EQ(servo.statistics().faults, 4u);
    device->close();
}

}  // namespace
}  // namespace innerspring
