#include <fmt/format.h>
#include <gtest/gtest.h>

#include "innerspring/haptic/hand.h"
#include "innerspring/haptic/wrappers.h"
#include "innerspring/mesh/random.h"
#include "support/temporary_folder.h"

// Devices by what must hold of them: statics, power, files.
namespace innerspring {
namespace {

constexpr double rate = 1000;

std::vector<PosePoint> resting(const Vector& x) {
    return {{0, {x}}, {1e9, {x}}};
}

// At rest the grip holds what pushes: k_h (x_want - x) + F = 0.
TEST(SimulatedHand, YieldsByForceOverStiffness) {
    HandOptions options;
    SimulatedHand hand(resting({0.01, 0, 0}), rate, options);
    const Vector force(0.3, -0.6, 0.9);
    DeviceSample sample;
    for (int n = 0; n < 3000; ++n) hand.write(force);
    ASSERT_TRUE(hand.read(sample));
    EXPECT_LT((sample.pose.position - (Vector(0.01, 0, 0) + force / options.stiffness)).norm(), 1e-9);
    EXPECT_LT(sample.velocity.norm(), 1e-9);
}

// Beyond its grip the hand cannot hold: it is driven at (F - grip) / b_d.
TEST(SimulatedHand, GivesWayBeyondItsGrip) {
    HandOptions options;
    options.grip = 2, options.friction = 4;
    SimulatedHand hand(resting({0, 0, 0}), rate, options);
    for (int n = 0; n < 2000; ++n) hand.write({0, 0, 3});
    DeviceSample sample;
    hand.read(sample);
    EXPECT_NEAR(sample.velocity.z(), (3 - 2) / 4.0, 1e-6);
}

// A free spring, mass and damper: the frequency sqrt(k/m - (b/2m)^2) / 2 pi.
TEST(SimulatedHand, SwingsAtItsOwnFrequency) {
    HandOptions options;
    options.mass = 0.1, options.stiffness = 400, options.damping = 0.2, options.friction = 0;
    options.grip = 1e9;
    SimulatedHand hand(resting({0, 0, 0}), rate, options);
    for (int n = 0; n < 500; ++n) hand.write({1, 0, 0});  // pushed aside, then let go
    DeviceSample sample;
    std::vector<double> crossings;
    double before = 1;
    for (int n = 0; n < 3000; ++n) {
        hand.write({0, 0, 0});
        hand.read(sample);
        const double x = sample.pose.position.x();
        if (before < 0 && x >= 0) crossings.push_back(sample.time - 1e-3 * x / (x - before));
        before = x;
    }
    ASSERT_GT(crossings.size(), 10u);
    const double period = (crossings[10] - crossings[0]) / 10;
    EXPECT_NEAR(period * std::sqrt(400 / 0.1 - 1) / (2 * std::numbers::pi), 1, 2e-3);
}

TEST(SimulatedHand, TremblesAboutWhatItWants) {
    HandOptions options;
    options.tremor = 1e-3;
    SimulatedHand hand(resting({0, 0, 0}), rate, options), same(resting({0, 0, 0}), rate, options);
    Vector mean = Vector::Zero();
    double most = 0;
    DeviceSample sample, other;
    for (int n = 0; n < 20000; ++n) {
        hand.write({0, 0, 0}), same.write({0, 0, 0});
        hand.read(sample), same.read(other);
        ASSERT_EQ(sample.pose.position, other.pose.position);
        mean += sample.pose.position / 20000;
        most = std::max(most, sample.pose.position.norm());
    }
    EXPECT_LT(mean.norm(), 1e-5);
    EXPECT_GT(most, 1e-4);
    EXPECT_LT(most, 4e-3);
}

TEST(SimulatedHand, RefusesWhatCannotBe) {
    HandOptions options;
    options.mass = 0;
    EXPECT_THROW(SimulatedHand(resting({0, 0, 0}), rate, options), InputError);
    options = {};
    options.stiffness = std::nan("");
    EXPECT_THROW(SimulatedHand(resting({0, 0, 0}), rate, options), InputError);
    options = {};
    options.stiffness = 1e9;
    EXPECT_THROW(SimulatedHand(resting({0, 0, 0}), rate, options), InputError);
    EXPECT_THROW(SimulatedHand({}, rate), InputError);
}

// F . v is the same on both sides, whatever the scale and rotation.
TEST(TurnedDevice, KeepsThePower) {
    struct Probe : SimulatedHand {
        using SimulatedHand::SimulatedHand;
        Vector told = Vector::Zero();
        bool write(const Vector& f) noexcept override { return told = f, SimulatedHand::write(f); }
    };
    Random random(3);
    Probe probe({{0, {{0, 0, 0}}}, {1, {{0.1, -0.2, 0.05}}}}, rate);
    TurnedDevice turned(probe, 2.5, Eigen::Quaterniond(0.5, 0.1, -0.7, 0.3));
    for (int n = 0; n < 200; ++n) {
        DeviceSample inner, outer;
        probe.read(inner), turned.read(outer);
        const Vector force(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        turned.write(force);
        EXPECT_NEAR(force.dot(outer.velocity), probe.told.dot(inner.velocity), 1e-12);
        EXPECT_NEAR(outer.pose.position.norm(), 2.5 * inner.pose.position.norm(), 1e-12);
    }
    EXPECT_NEAR(turned.info().max_force, probe.info().max_force / 2.5, 1e-12);
    EXPECT_NEAR(turned.info().max_stiffness * 2.5 * 2.5, probe.info().max_stiffness, 1e-9);
    EXPECT_THROW(TurnedDevice(probe, 0, Eigen::Quaterniond::Identity()), InputError);
}

TEST(ClutchedDevice, TheToolStaysWhileTheHandMoves) {
    std::vector<HandSample> samples;
    for (int n = 0; n < 30; ++n)
        samples.push_back({n * 1e-3, {{n * 0.01, 0, 0}}, n >= 10 && n < 20 ? 2u : 0u});
    ReplayDevice replay(samples, rate);
    ClutchedDevice clutched(replay, 2);
    DeviceSample sample;
    std::vector<double> x;
    for (int n = 0; n < 30; ++n) {
        clutched.read(sample);
        x.push_back(sample.pose.position.x());
        clutched.write({1, 0, 0});
    }
    EXPECT_NEAR(x[9], 0.09, 1e-12);
    for (int n = 10; n < 20; ++n) EXPECT_NEAR(x[n], 0.09, 1e-12) << n;
    for (int n = 20; n < 30; ++n) EXPECT_NEAR(x[n], 0.01 * (n - 10), 1e-12) << n;
}

TEST(HandFile, ReadsEveryForm) {
    EXPECT_EQ(parse_hand("0 1 2 3\n1 4 5 6\n", "a").size(), 2u);
    const auto full = parse_hand(
        "time_s, x_m, y_m, z_m, w, i, j, k, buttons, fx_n, fy_n, fz_n\r\n# a comment\r\n"
        "0.5, 1, 2, 3, 1, 0, 0, 0, 3, 4, 5, 6 # more\r\n\r\n",
        "a");
    ASSERT_EQ(full.size(), 1u);
    EXPECT_EQ(full[0].buttons, 3u);
    EXPECT_EQ(full[0].force, Vector(4, 5, 6));
    EXPECT_EQ(parse_hand("0 1 2 3 1\n", "a")[0].buttons, 1u);
    // Cut off in the middle of a line: what is whole is read.
    EXPECT_EQ(parse_hand("0 1 2 3\n1 4 5", "a").size(), 1u);
}

TEST(HandFile, SaysWhatIsWrongAndWhere) {
    const std::pair<const char*, const char*> cases[] = {
        {"0 1 2\n", "a:1: 3 numbers"},
        {"0 1 2 3\n0 1 2 3\n", "a:2: time 0 s does not come after"},
        {"0 1 2 3\n1 1 2 3 1\n", "a:2: 5 numbers, where the lines before have 4"},
        {"0 1 2 three\n", "a:1: 'three' is not a number"},
        {"x y\nz\n", "a:2: 'z' is not a number"},
        {"0 1 2 nan\n", "a:1: the numbers must be finite"},
        {"0 1 2 3 2 0 0 0\n", "norm 1"},
        {"0 1 2 3 0.5\n", "buttons"},
        {"0 1 2 3 4 5 6 7 8 9 10 11 12 13\n", "more than 12"},
        {"", "no poses"},
        {"# nothing\n", "no poses"}};
    for (const auto& [text, what] : cases) {
        try {
            parse_hand(text, "a");
            ADD_FAILURE() << text;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
        }
    }
    EXPECT_THROW(read_hand("/nowhere/at/all.csv"), InputError);
    EXPECT_THROW(HandWriter("/nowhere/at/all.csv"), InputError);
}

// Random damage gives poses or one line, never more.
TEST(HandFile, BearsDamage) {
    Random random(5);
    const std::string good = "t, x, y, z\n0, 1.5, -2e-3, 3\n1, 1, 2, 3\n2, 1, 2, 3\n";
    for (int n = 0; n < 5000; ++n) {
        std::string text = good;
        for (std::size_t k = 0; k <= random.below(4); ++k)
            text[random.below(text.size())] = char(random.below(256));
        try {
            for (const HandSample& s : parse_hand(text, "a")) EXPECT_TRUE(s.pose.position.allFinite());
        } catch (const InputError& error) {
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
        }
    }
}

TEST(HandFile, AReplayOfARecordingGivesTheSamePosesToTheBit) {
    TemporaryFolder folder("hand");
    Ring<HandSample> ring(5000);
    SimulatedHand hand({{0, {{0, 0, 0}}}, {1, {{0.03, 0.01, -0.02}}}}, rate);
    RecordedDevice recorded(hand, ring);
    std::vector<Vector> seen;
    DeviceSample sample;
    {
        HandWriter writer(folder.path / "a.csv");
        for (int n = 0; n < 1500; ++n) {
            recorded.read(sample);
            seen.push_back(sample.pose.position);
            recorded.write({0.1, 0, 0});
        }
        HandSample line;
        while (ring.pop(line)) writer.add(line);
        writer.flush();
    }
    ReplayDevice replay(read_hand(folder.path / "a.csv"), rate);
    for (std::size_t n = 0; n < seen.size(); ++n) {
        replay.read(sample);
        ASSERT_EQ(sample.pose.position, seen[n]) << n;
        replay.write({0, 0, 0});
    }
    EXPECT_TRUE(replay.finished());
}

}  // namespace
}  // namespace innerspring
