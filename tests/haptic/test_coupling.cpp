#include <gtest/gtest.h>

#include <thread>

#include "innerspring/haptic/hand.h"
#include "innerspring/haptic/ring.h"
#include "innerspring/haptic/servo.h"
#include "innerspring/mesh/random.h"
#include "sim/allocations.h"

// The servo's parts by their laws: balance, passivity, limits.
namespace innerspring {
namespace {

constexpr double T = 1e-3;

LocalContact wall(double stiffness, double height = 0) {
    return {{0, 0, height}, Vector::UnitZ(), stiffness, 0, 0, 0, 1};
}

// The coupling pulls on the proxy as hard as the body pushes it.
TEST(GodObject, BalancesCouplingAndBody) {
    Random random(1);
    for (int n = 0; n < 1000; ++n) {
        GodObject god;
        LocalContact c = wall(random.uniform(1, 2000));
        c.normal = Vector(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)).normalized();
        const CouplingGains gains{random.uniform(1, 2000), 0};
        const Vector x(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        const CoupledForce f = god.feel(c, gains, x, Vector::Zero(), T);
        const double body = c.stiffness * std::max(0.0, c.normal.dot(c.rest - f.proxy));
        EXPECT_LT((f.force - body * c.normal).norm(), 1e-9);
        EXPECT_LT((f.force - gains.stiffness * (f.proxy - x)).norm(), 1e-9);
        EXPECT_NEAR(f.force.squaredNorm() / 2, f.energy * f.stiffness, 1e-9 + 1e-9 * f.stiffness);
    }
}

// Coulomb: the proxy stays while the pull across is below mu times the normal force, and slides at that.
TEST(GodObject, SticksAndSlides) {
    GodObject god;
    LocalContact c = wall(500);
    c.friction = 0.5;
    const CouplingGains gains{500, 0};
    CoupledForce f;
    for (int n = 0; n <= 100; ++n) f = god.feel(c, gains, {n * 1e-4, 0, -0.01}, Vector::Zero(), T);
    const double normal = f.force.z();
    EXPECT_NEAR(normal, 250 * 0.01, 1e-9);
    EXPECT_NEAR(-f.force.x(), 0.5 * normal, 1e-9);  // slides
    GodObject sticky;
    for (int n = 0; n <= 10; ++n) f = sticky.feel(c, gains, {n * 1e-4, 0, -0.01}, Vector::Zero(), T);
    EXPECT_NEAR(-f.force.x(), 500 * 1e-3, 1e-9);  // sticks: the spring has been drawn 1 mm
    EXPECT_NEAR(f.proxy.x(), 0, 1e-12);
}

TEST(Coupling, GainsKeepColgatesBoundAndTheDevices) {
    for (const double damping : {0.05, 0.8, 5.0})
        for (const double rate : {500.0, 1000.0, 4000.0})
            for (const double delay : {0.0, 0.002}) {
                DeviceInfo info;
                info.damping = damping;
                const CouplingGains g = passive_gains(info, 1 / rate, delay);
                EXPECT_GT(damping, g.stiffness * (0.5 / rate + delay) + g.damping);
                EXPECT_LE(g.stiffness, info.max_stiffness);
                EXPECT_LE(g.damping, info.max_damping);
            }
}

/// Lets a mass with a little friction press onto a sampled wall for a minute; the largest of |v| in the last
/// second.
struct Bounce {
    double speed = 0;  ///< at the end [m/s]
    double least = 0;  ///< of the observer [J]
    std::uint64_t braked = 0;
};
Bounce bounce(double stiffness_over_limit, bool controller) {
    HandOptions hand;
    hand.mass = 0.1, hand.stiffness = 50, hand.damping = 0, hand.friction = 0.5, hand.grip = 1e9;
    SimulatedHand device({{0, {{0, 0, 0.004}}}, {0.2, {{0, 0, -0.01}}}, {1e6, {{0, 0, -0.01}}}}, 1 / T, hand);
    device.description().max_force = 1e6, device.description().max_continuous_force = 1e6;
    device.description().max_stiffness = 1e9;
    ServoOptions options;
    options.stiffness = stiffness_over_limit * passive_limit(device.info(), T, 0);
    options.damping = 0;
    options.controller = controller;
    options.safety.ramp = 0, options.safety.rise = 1e12, options.stall = 1e9;
    Servo servo(device, options);
    servo.contacts().send(wall(1e9));
    Bounce out;
    DeviceSample sample;
    for (int n = 0; n < 60000; ++n) {
        servo.tick();
        device.read(sample);
        if (n >= 59000) out.speed = std::max(out.speed, sample.velocity.norm());
    }
    out.least = servo.statistics().observer_least;
    out.braked = servo.statistics().braked;
    return out;
}

// Colgate & Schenkel: K T / 2 < b is passive, and needs no controller; at twice that a wall buzzes for ever,
// which the controller ends.
TEST(Coupling, IsStableToThePassiveLimitAndNotBeyondItWithoutTheController) {
    const Bounce below = bounce(0.9, false);
    EXPECT_LT(below.speed, 1e-4);
    const Bounce beyond = bounce(2, false);
    EXPECT_GT(beyond.speed, 0.05);
    EXPECT_LT(beyond.least, -1e-4);
    const Bounce kept = bounce(2, true);
    EXPECT_LT(kept.speed, 0.2 * beyond.speed);
    EXPECT_GE(kept.least, -1e-6);
    EXPECT_GT(kept.braked, 0u);
    std::printf(
        "speed left: 0.9 of the limit %.2g, twice %.2g, with the controller %.2g m/s; least energy %.2g, "
        "%.2g, %.2g J\n",
        below.speed, beyond.speed, kept.speed, below.least, beyond.least, kept.least);
}

TEST(PassivityObserver, LimitsTheForceToTheEnergyThereIs) {
    Random random(7);
    for (int n = 0; n < 2000; ++n) {
        PassivityObserver observer;
        const double energy = random.uniform(0, 1e-3), mass = random.uniform(0.02, 0.5);
        observer.lend(energy, 1);
        const auto any = [&] {
            return Vector(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        };
        const Vector force = 5 * any(), v = any();
        const Vector f = observer.limit(force, v, T, mass);
        // What it gives to the device if that moves on at v, driven by it and by a hand that gives way.
        EXPECT_LE(f.dot(v) * T + f.squaredNorm() * T * T / mass, energy * (1 + 1e-9) + 1e-15);
        EXPECT_LE(f.norm(), force.norm() * (1 + 1e-12));
        EXPECT_LT(f.cross(force).norm(), 1e-9);
        EXPECT_GE(f.dot(force), 0);
    }
}

TEST(ForceGuard, ClampsPeakContinuousSlewAndNumbers) {
    DeviceInfo info;
    SafetyOptions options;
    options.ramp = 0.1;
    ForceGuard guard(info, options);
    const double rise = guard.options().rise;
    Vector last = Vector::Zero();
    double most = 0;
    for (int n = 0; n < 60000; ++n) {
        const Vector f = guard.pass({0, 0, 100}, 1, T);
        EXPECT_LE((f - last).norm(), rise * T * (1 + 1e-9));
        if (n < 100) {
            EXPECT_LE(f.norm(), 100 * (n + 1) / 100.0 + 1e-9);
        }
        most = std::max(most, f.norm());
        guard.sent(last = f, T);
    }
    EXPECT_LE(most, info.max_force);
    EXPECT_GT(most, 0.9 * info.max_force);
    // After a minute: what the motors bear for ever.
    EXPECT_NEAR(last.norm(), info.max_continuous_force, 0.02 * info.max_continuous_force);
    EXPECT_EQ(guard.pass({0, std::nan(""), 0}, 1, T), Vector(0, 0, 0));
    EXPECT_EQ(guard.pass({0, INFINITY, 0}, 1, T), Vector(0, 0, 0));
}

/// A hand pressed into a wall, with the servo's force on it.
struct Pressed {
    HandOptions hand;
    SimulatedHand device{{{0, {{0, 0, 0.01}}}, {0.5, {{0, 0, -0.01}}}, {1e6, {{0, 0, -0.01}}}}, 1 / T, hand};
    Servo servo{device, {}};
    std::uint64_t step = 0;
    double force() {
        servo.hands().update();
        return servo.hands().latest().force.norm();
    }
    ServoHealth health() {
        servo.hands().update();
        return servo.hands().latest().health;
    }
    void run(int ticks, LocalContact c = wall(200), int every = 5) {
        c.period = 5 * T;
        for (int n = 0; n < ticks; ++n) {
            if (n % every == 0) c.step = ++step, servo.contacts().send(c);
            servo.tick();
        }
    }
};

TEST(Servo, PressesAsTheSpringsInARow) {
    Pressed p;
    p.run(3000);
    const double k_c = p.servo.gains().stiffness, k = k_c * 200 / (k_c + 200), h = p.hand.stiffness;
    EXPECT_NEAR(p.force(), 0.01 * k * h / (k + h), 1e-6);
    EXPECT_GE(p.servo.statistics().observer_least, 0);
}

// A body that steps every `every` servo periods stops for 2 s. In periods after its last step: the force is
// whole for twice its own period (5 ms at least), and nothing 5 ms later, so 10 ms after the step was due at
// 200 Hz or more. It says 5 ms all the time; what counts is what it does.
TEST(Servo, AStalledBodyFadesOutAndComesBackBySlopes) {
    for (const int every : {1, 2, 5, 10, 33}) {
        Pressed p;
        p.run(3000, wall(200), every);
        const double before = p.force();
        const std::uint64_t stalls = p.servo.statistics().stalls;  // while it learned the period
        EXPECT_LE(stalls, 1u);
        ASSERT_GT(before, 0.1);
        // The last step was at tick 3000 - r, the first after the loop's last multiple.
        const int gone = (3000 - 1) % every;
        int whole = 0, zero = 0;
        double last = before;
        for (int n = gone + 1; n <= 2000; ++n) {
            p.servo.tick();
            const double now = p.force();
            EXPECT_LE(now, last + 1e-6);
            last = now;
            if (now > 0.99 * before) whole = n;
            if (now == 0 && zero == 0) zero = n;
        }
        const int allowed = std::max(2 * every, 5);
        EXPECT_GE(whole, allowed - 1) << every;
        EXPECT_LE(whole, allowed + 1) << every;
        EXPECT_LE(zero, allowed + 5) << every;
        if (every <= 5) {
            EXPECT_LE(zero - every, 10) << every;
        }
        EXPECT_EQ(p.health(), ServoHealth::stalled);
        p.run(1, wall(200), every);
        EXPECT_LT(p.force(), 0.02 * before);
        p.run(2000, wall(200), every);
        EXPECT_NEAR(p.force(), before, 0.01 * before);
        EXPECT_EQ(p.servo.statistics().stalls, stalls + 1) << every;
    }
}

// One step comes late by three periods: the force gives way a little and is back at once, without the ramp.
TEST(Servo, AStepThatIsLateForAMomentDoesNotStartAnew) {
    Pressed p;
    p.run(3000);
    const double before = p.force();
    double least = before;
    for (int n = 0; n < 8; ++n) p.servo.tick(), least = std::min(least, p.force());  // 12 since the last
    EXPECT_LT(least, 0.9 * before);
    EXPECT_GT(least, 0.3 * before);
    p.run(10);
    EXPECT_NEAR(p.force(), before, 0.05 * before);
    EXPECT_EQ(p.servo.statistics().stalls, 1u);
}

TEST(Servo, WhatIsNoNumberGivesNoForceInThatPeriod) {
    for (int which = 0; which < 4; ++which) {
        Pressed p;
        p.run(3000);
        const double before = p.force();
        ASSERT_GT(before, 0.1);
        LocalContact bad = wall(200);
        bad.step = 1000000;
        if (which == 0) bad.rest.x() = std::nan("");
        if (which == 1) bad.stiffness = INFINITY;
        if (which == 2) bad.normal = Vector(0, 0, 2);
        if (which == 3) bad.normal = Vector(std::nan(""), 0, 0);
        p.servo.contacts().send(bad);
        p.servo.tick();
        EXPECT_EQ(p.force(), 0);
        EXPECT_EQ(p.health(), ServoHealth::faulty);
        p.run(3000);
        EXPECT_NEAR(p.force(), before, 0.01 * before);
    }
}

// At 5 m/s into a stiff wall: never more than the peak, never energy out of nothing.
TEST(Servo, BearsADeviceAtFiveMetresPerSecond) {
    std::vector<HandSample> samples;
    for (int n = 0; n < 400; ++n)
        samples.push_back({n * T, {{0, 0, (n / 20 % 2 ? -1 : 1) * (0.05 - 0.005 * (n % 20))}}});
    ReplayDevice device(samples, 1 / T);
    ServoOptions options;
    options.safety.ramp = 0;
    Servo servo(device, options);
    double last = 0;
    for (int n = 0; n < 400; ++n) {
        LocalContact c = wall(900);
        c.step = n + 1;
        servo.contacts().send(c);
        servo.tick();
        servo.hands().update();
        const double now = servo.hands().latest().force.norm();
        EXPECT_LE(now, device.info().max_force * (1 + 1e-12));
        EXPECT_LE(now - last, servo.safety().rise * T * (1 + 1e-9));
        last = now;
    }
    EXPECT_GE(servo.statistics().observer_least, -1e-9);
}

TEST(Servo, AllocatesNothing) {
    Pressed p;
    p.run(10);
    const long before = support::allocations();
    p.run(2000);
    EXPECT_EQ(support::allocations() - before, 0);
}

TEST(Servo, RefusesWhatCannotBe) {
    SimulatedHand device({{0, {}}}, 1000);
    for (const double rate : {0.0, 10.0, 5000.0, std::nan("")}) {
        ServoOptions options;
        options.rate = rate;
        EXPECT_THROW(Servo(device, options), InputError);
    }
    ServoOptions options;
    options.stiffness = -1;
    EXPECT_THROW(Servo(device, options), InputError);
    device.description().damping = 0;
    EXPECT_THROW(Servo(device, {}), InputError);
}

// Two threads: what is read is whole and never older than what was read before.
TEST(Mailbox, CrossesWholeAndInOrder) {
    struct Pair {
        std::uint64_t a = 0, filler[14]{}, b = 0;
    };
    Mailbox<Pair> box;
    constexpr std::uint64_t last = 200000;
    std::thread writer([&] {
        for (std::uint64_t n = 1; n <= last; ++n) {
            Pair pair;
            pair.a = pair.b = n;
            box.send(pair);
        }
    });
    std::uint64_t seen = 0, fresh = 0;
    while (seen < last) {
        if (!box.update()) continue;
        ++fresh;
        const Pair& pair = box.latest();
        ASSERT_EQ(pair.a, pair.b);
        ASSERT_GT(pair.a, seen);
        seen = pair.a;
    }
    writer.join();
    EXPECT_GT(fresh, 0u);
}

TEST(Ring, LosesNothingItTook) {
    Ring<int> ring(16);
    std::thread writer([&] {
        for (int n = 0; n < 100000;)
            if (ring.push(n)) ++n;
    });
    for (int n = 0, got; n < 100000;)
        if (ring.pop(got)) {
            ASSERT_EQ(got, n);
            ++n;
        }
    writer.join();
}

TEST(Histogram, QuantilesAreWithinTheirBins) {
    Histogram h;
    for (std::uint64_t n = 1; n <= 100000; ++n) h.add(n * 10);
    EXPECT_NEAR(h.quantile_ms(0.5), 0.5, 0.5 * 0.016);
    EXPECT_NEAR(h.quantile_ms(0.99), 0.99, 0.016);
    EXPECT_EQ(h.max_ms(), 1.0);
    EXPECT_EQ(h.quantile_ms(1), 1.0);
    h.add(~std::uint64_t{0});  // the largest there is
    EXPECT_EQ(h.count(), 100001u);
}

}  // namespace
}  // namespace innerspring
