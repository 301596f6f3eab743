#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "haptic/rig.h"
#include "innerspring/record/setup.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"

// Hand, servo and body together.
namespace innerspring {
namespace {

using namespace support;

/// The force of a tool at rest at `place`, pressed in from outside along -z [N].
Vector quasi_static(const Body& body, Tool tool, const Vector& place, Touch* touch = nullptr) {
    tool.path = {{0, {place + Vector(0, 0, 0.5)}}, {0.5, {place}}};
    Loads loads{Vector::Zero(), {}, {}, {tool}};
    Workspace workspace(body, stepping());
    State state = rest_state(body);
    for (int n = 0; n < 300; ++n) step(body, loads, state, workspace);
    TouchFinder finder;
    if (touch) *touch = finder.find(body, state, workspace.contact(), tool, 0);
    return workspace.contact().tools[0].force;
}

// The tangent stiffness is what a little deeper costs: against differences of the body's own answer.
TEST(Touch, TangentStiffnessIsTheSlopeOfTheForce) {
    struct Case {
        const char* shape;
        double surface, radius, depth, tolerance;
    };
    for (const Case& c : {Case{"icosphere:vertices=10242", 0, 0.5, 0.1, 0.05},
                          Case{"icosphere:vertices=10242", 1, 0.5, 0.1, 0.15},
                          Case{"icosphere:vertices=2562", 1, 0.3, 0.2, 0.25},
                          Case{"sphere:vertices=1000,irregularity=3,seed=1", 0.2, 0.4, 0.2, 0.25}}) {
        if (INNERSPRING_SANITIZED && c.surface != 0.2) continue;  // the fine ones
        BodyRecipe recipe;
        recipe.surface = c.surface;
        const Body body = make_sphere(c.shape, recipe);
        const Tool tool = sphere_tool(c.radius, Vector::Zero());
        Touch touch;
        const double d = 0.01;
        const auto at_depth = [&](double depth, Touch* out = nullptr) {
            return quasi_static(body, tool, {0, 0, 1 + c.radius - depth}, out).z();
        };
        const double force = at_depth(c.depth, &touch);
        const double slope = (at_depth(c.depth + d) - at_depth(c.depth - d)) / (2 * d);
        ASSERT_TRUE(touch.touching) << c.shape;
        EXPECT_NEAR(touch.force / force, 1, 0.01);
        EXPECT_GT(touch.normal.z(), 0.99);
        std::printf("%s, E_s %g: tangent stiffness %.3g, slope %.3g N/m\n", c.shape, c.surface,
                    touch.stiffness, slope);
        EXPECT_NEAR(touch.stiffness / slope, 1, c.tolerance) << c.shape;
    }
}

// Pressed and held: what the hand feels is what the model answers at the proxy, times the scale.
TEST(Loop, TheHandFeelsTheQuasiStaticForceOfTheModel) {
    std::vector<std::string> meshes{"icosphere:vertices=642", "breast:vertices=1500"};
    if (const std::string liver = SHARED_MESHES "/liver2.obj";
        !INNERSPRING_SANITIZED && std::filesystem::exists(liver))
        meshes.push_back(liver);
    for (const std::string& shape : meshes) {
        Scene scene;
        scene.mesh = shape;
        Rig rig = shape.ends_with(".obj") ? Rig(set_up(scene).body, 0.2, 0.2) : Rig(shape.c_str());
        rig.options.lockstep = true;
        rig.options.duration = 1.9;  // in the hold of the script
        SimulatedHand device = rig.device();
        HandState last;
        rig.options.after_step = [&](const HandState& hand, const Touch&) { last = hand; };
        const LoopReport report = rig.run(device);
        const Vector model = rig.mapping.newtons *
                             quasi_static(rig.body, rig.loads.tools[0], rig.mapping.to_scene(last.proxy));
        ASSERT_GT(model.norm(), 0.1) << shape;
        std::printf("%s: felt %.4f N, model %.4f N; observer %.2g J; braked %llu of %llu\n", shape.c_str(),
                    last.force.norm(), model.norm(), report.servo.observer_least,
                    (unsigned long long)report.servo.braked, (unsigned long long)report.servo.ticks);
        EXPECT_LT((last.force - model).norm(), 0.02 * model.norm()) << shape;
        EXPECT_GE(report.servo.observer_least, 0) << shape;
        EXPECT_EQ(report.servo.faults, 0u);
    }
}

/// Of the force in [from, to) of the servo's periods: the energy above 50 Hz or so (what differs from the
/// mean of 5 ms before and after), as a share of all.
double vibration(const std::vector<HandSample>& samples, std::size_t from, std::size_t to) {
    double fast = 0, all = 0;
    for (std::size_t n = from; n < to; ++n) {
        fast += (samples[n].force - (samples[n - 5].force + samples[n + 5].force) / 2).squaredNorm();
        all += samples[n].force.squaredNorm();
    }
    return all > 0 ? fast / all : INFINITY;
}

// No vibration: while the hand is held still, the force hardly changes at high frequency.
TEST(Loop, DoesNotVibrateWhileItIsHeld) {
    for (const char* shape : {"icosphere:vertices=642", "breast:vertices=1500"}) {
        Rig rig(shape);
        rig.options.lockstep = true;
        rig.options.duration = 1.9;
        TemporaryFolder folder("vibration");
        rig.options.record = folder.path / "hand.csv";
        SimulatedHand device = rig.device();
        rig.run(device);
        EXPECT_LT(vibration(read_hand(rig.options.record), 1500, 1890), 1e-4) << shape;
    }
}

// A body felt 300 times as stiff as by default, so that the coupling is most of what is felt, a hand that
// does not damp, no controller: at 0.9 of the passive limit it is quiet, far beyond it buzzes.
TEST(Loop, WithABodyIsQuietToThePassiveLimitAndBuzzesBeyondItWithoutTheController) {
    struct Outcome {
        double vibration, stiffness, least;
    };
    const auto run = [](double share, bool controller) {
        Rig rig("icosphere:vertices=642", 0.2);
        rig.hand.mass = 0.1, rig.hand.stiffness = 50, rig.hand.damping = 0, rig.hand.friction = 0.5;
        rig.mapping.newtons *= 300;
        rig.options.lockstep = true;
        rig.options.duration = 1.95;
        rig.options.servo.damping = 0;
        rig.options.servo.controller = controller;
        rig.options.servo.safety.rise = 1e12;
        SimulatedHand device = rig.device();
        rig.options.servo.stiffness = share * passive_limit(device.info(), 1e-3, 0);
        TemporaryFolder folder("limit");
        rig.options.record = folder.path / "hand.csv";
        const LoopReport report = rig.run(device);
        const Outcome out{vibration(read_hand(rig.options.record), 1500, 1890), report.servo.stiffness_max,
                          report.servo.observer_least};
        std::printf("%.2g of the limit, controller %d: felt up to %.0f N/m, vibration %.2g, least %.2g J\n",
                    share, controller, out.stiffness, out.vibration, out.least);
        return out;
    };
    const Outcome below = run(0.9, false);
    EXPECT_GT(below.stiffness, 700);  // of 900
    EXPECT_LT(below.vibration, 1e-4);
    EXPECT_GT(run(8, false).vibration, 1e-2);
    EXPECT_GE(run(40, true).least, 0);
    EXPECT_LT(run(40, false).least, -1e-4);
}

// The mesh is made finer under the tool while it presses, and coarser again. From step to step of the body
// the force changes as the hand's motion has it, by no jump: its second difference over a body step stays
// below 5 % of it (where it is a tenth of the most: a body that is let go swings).
TEST(Loop, RefinementUnderTheToolIsNotFelt) {
    for (const double radius : {0.3, 0.15}) {
        if (INNERSPRING_SANITIZED && radius < 0.3) continue;
        Rig rig("icosphere:vertices=642");
        rig.loads.tools[0].radius = radius;
        PressScript press;
        press.depth = 0.15;
        rig.script = press_script(rig.body, rig.loads.tools[0], rig.mapping, press);
        RefineRule rule;
        rule.tool_share = 0.3, rule.levels = 3;
        rig.refine = {rule};
        rig.options.lockstep = true;
        rig.options.duration = 4;
        TemporaryFolder folder("refine");
        rig.options.record = folder.path / "hand.csv";
        Loads held = rig.loads;
        BodySide body(rig.body, held, 0, stepping(), rig.mapping, rig.refine);
        std::size_t finest = 0;
        std::uint64_t version = 0;
        int under_load = 0;
        rig.options.after_step = [&](const HandState& hand, const Touch&) {
            finest = std::max(finest, body.body().vertices());
            under_load += body.mesh_version() != version && hand.force.norm() > 0.1;
            version = body.mesh_version();
        };
        SimulatedHand device = rig.device();
        const LoopReport report = run_haptic(body, dt, rig.mapping, device, rig.options);
        const std::vector<HandSample> samples = read_hand(rig.options.record);
        double most = 0, share = 0;
        for (const HandSample& s : samples) most = std::max(most, s.force.norm());
        for (std::size_t n = 600; n + 5 < samples.size(); ++n)
            if (const double force = samples[n].force.norm(); force > most / 10)
                share = std::max(
                    share,
                    (samples[n - 5].force - 2 * samples[n].force + samples[n + 5].force).norm() / force);
        std::printf(
            "tool %g: %d changes, %d under load, up to %zu vertices; jump %.3f of the force; %.3g N\n",
            radius, report.refinements, under_load, finest, share, most);
        EXPECT_GT(under_load, 2);
        EXPECT_GT(finest, rig.body.vertices() + 50);
        EXPECT_GT(most, 0.1);
        EXPECT_LT(share, 0.05);
        EXPECT_EQ(report.servo.stalls, 0u);
        EXPECT_GE(report.servo.observer_least, 0);
    }
}

TEST(Loop, TheSameReplayGivesTheSameForcesToTheBit) {
    TemporaryFolder folder("replay");
    Rig rig("icosphere:vertices=642");
    rig.options.lockstep = true;
    rig.options.duration = 2.5;
    rig.options.record = folder.path / "first.csv";
    rig.hand.tremor = 2e-4;
    SimulatedHand device = rig.device();
    rig.run(device);
    const auto first = read_hand(folder.path / "first.csv");
    ASSERT_EQ(first.size(), 2500u);
    std::string texts[2];
    for (int n = 0; n < 2; ++n) {
        rig.options.record = folder.path / "again.csv";
        ReplayDevice replay(first, 1000);
        rig.run(replay);
        texts[n] = content(folder.path / "again.csv");
    }
    EXPECT_EQ(texts[0], texts[1]);
    EXPECT_GT(texts[0].size(), 10000u);
    // The poses are those of the first run to the bit.
    const auto again = read_hand(folder.path / "again.csv");
    double most = 0;
    for (std::size_t n = 0; n < again.size(); ++n) {
        ASSERT_EQ(again[n].pose.position, first[n].pose.position) << n;
        most = std::max(most, again[n].force.norm());
    }
    EXPECT_GT(most, 0.1);
}

TEST(Loop, RunsByTheClockInItsOwnThread) {
    for (const double rate : {1000.0, 4000.0}) {
        TemporaryFolder folder("clock");
        Rig rig("icosphere:vertices=162");
        rig.options.servo.rate = rate;
        rig.options.duration = 1.5;
        rig.options.servo.stall = 0.5;
        rig.options.empty_loop = true;
        int told = 0;
        std::uint64_t ticks = 0;
        rig.options.progress = [&](const LoopReport& r) {
            ++told;
            EXPECT_GT(r.servo.ticks, ticks);
            ticks = r.servo.ticks;
            EXPECT_EQ(r.servo.work.count(), ticks);  // whole, not torn
        };
        rig.options.record = folder.path / "hand.csv";
        // From the first step on the tool is where the hand is, and that is outside.
        rig.options.after_step = [](const HandState& hand, const Touch& touch) {
            EXPECT_GT(hand.tick, 0u);
            if (hand.time < 0.2) {
                EXPECT_FALSE(touch.touching) << hand.time;
            }
        };
        SimulatedHand device = rig.device();
        const LoopReport report = rig.run(device);
        EXPECT_GT(report.servo.ticks, INNERSPRING_SANITIZED ? 50u : 500u);
        EXPECT_GT(report.body_steps, 20u);
        EXPECT_GT(told, 1);
        EXPECT_GE(report.servo.ticks, ticks);
        EXPECT_GE(report.servo.observer_least, 0);
        EXPECT_TRUE(report.failure.empty()) << report.failure;
        EXPECT_EQ(read_hand(folder.path / "hand.csv").size(), report.servo.ticks);
        const auto json = nlohmann::json::parse(to_json(report));
        for (const char* key :
             {"/rate_hz", "/period_error_ms/p50", "/period_error_ms/p99", "/period_error_ms/p99_9",
              "/period_error_ms/max", "/work_ms/p99_9", "/missed", "/clamped", "/observer_energy_min_j",
              "/force_max_n", "/body_steps_per_second", "/missed_empty_loop"})
            EXPECT_TRUE(json.contains(nlohmann::json::json_pointer(key))) << key;
    }
}

TEST(Loop, AutoScalesFitTheDevice) {
    for (const char* shape : {"icosphere:vertices=162", "breast", "torus:vertices=800"}) {
        for (const double size : {1.0, 0.05}) {
            SurfaceMesh mesh = make_shape(shape);
            for (Vector& x : mesh.positions) x *= size;
            const Body body = make_body(std::move(mesh));
            const Tool tool = sphere_tool(0.2 * size, Vector::Zero());
            const DeviceInfo info;
            const HandMapping m = fit_mapping(body, tool, info, 800);
            for (const Vector& x : body.rest.positions) {
                const Vector h = m.to_hand(x);
                EXPECT_TRUE((h.array() >= info.workspace.lower.array()).all());
                EXPECT_TRUE((h.array() <= info.workspace.upper.array()).all());
                EXPECT_LT((m.to_scene(h) - x).norm(), 1e-12);
            }
            EXPECT_GT(m.newtons, 0);
            EXPECT_EQ(fit_mapping(body, tool, info, 800, 3, 7).metres, 3);
            EXPECT_EQ(fit_mapping(body, tool, info, 800, 3, 7).newtons, 7);
        }
    }
}

}  // namespace
}  // namespace innerspring
