#include <gtest/gtest.h>

#include <numbers>

#include "camera.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"
#include "open.h"
#include "panel.h"
#include "session.h"
#include "support/sanitized.h"

using namespace innerspring;
using namespace innerspring::viewer;

namespace {

Material material(double mass, double young, double surface = 1, double damping = 1) {
    Material m;
    m.mass = mass, m.young = young, m.surface = surface, m.damping = damping;
    return m;
}

Scene sphere_scene(int vertices = 400) {
    Scene scene;
    scene.mesh = "sphere:vertices=" + std::to_string(vertices);
    scene.gravity = Vector::Zero();
    return scene;
}

/// One of every command, with numbers that have no short decimals.
std::vector<Command> all_commands() {
    Material m;
    m.mass = 0.1 / 3, m.young = 7.0 / 3, m.surface = 1 / 7.0, m.damping = 2 / 3.0;
    return {Gravity{{0.1, -9.81 / 3, 1e-30}},
            Grab{{0, 0, 1}, 0.35},
            Drag{{0.05, 1.0 / 3, 0}},
            Push{{0, 0, 1}, 0.3, {0, 0, -0.1 / 3}},
            Touch{0.3, 0.2, 1 / 3.0, {0, 0, 1.2}, {1, 0, 0.1}},
            MoveTool{{0, 0.1 / 3, 1.1}, {0, 0, 0.1 / 3}},
            Release{},
            Tune{m},
            SetScheme{Scheme::B},
            RefineNear{{0, 1, 0}, 0.4},
            CoarsenNear{{0, 1, 0}, 0.2},
            PinAt{{{0, -1, 0}, {0.1, -0.9, 1.0 / 3}}},
            Unpin{},
            Undo{},
            Reset{}};
}

void steps(Rig& rig, int count) {
    for (int n = 0; n < count; ++n) ASSERT_TRUE(rig.advance());
}

}  // namespace

TEST(Commands, ReadBackToTheSameLine) {
    const auto commands = all_commands();
    EXPECT_EQ(commands.size(), std::variant_size_v<Command>);
    for (const Command& command : commands) {
        const std::string line = to_line(command);
        EXPECT_EQ(parse_command(line).index(), command.index()) << line;
        EXPECT_EQ(to_line(parse_command(line)), line);
    }
}

TEST(Commands, SayWhatIsWrong) {
    for (const char* line :
         {"", "dance", "gravity 0 1", "gravity 0 1 nan", "push 0 0 1 -2 0 0 0", "grab 0 0 1 0", "pin 3 0 0 0",
          "pin 99999999999 0", "scheme D", "release now", "tune 1 2 3", "touch 0 0 0 0 0 0 0 0 1",
          "touch 1 0 0 0 0 0", "move 1 2", "move 1 2 3 4"})
        EXPECT_THROW(parse_command(line), InputError) << line;
}

TEST(Recording, GivesTheSameBitsAgain) {
    Rig rig({sphere_scene()});
    for (const Command& command : all_commands()) {
        try {
            rig.apply(command);
        } catch (const InputError&) {
        }
        steps(rig, 7);
    }
    rig.apply(RefineNear{{0, 0, 1}, 0.5});
    rig.apply(Push{{0, 0, 1}, 0.4, {0, 0, -0.05}});
    steps(rig, 20);
    rig.apply(SetScheme{Scheme::A});
    steps(rig, 20);
    const std::string text = to_text(rig.recording());
    Recording read = recording_from_text(text, "test");
    EXPECT_EQ(to_text(read), text);
    EXPECT_EQ(replay(read)->hash(), rig.hash());
    for (Scene& scene : read.scenes) scene.step.threads = 2;
    EXPECT_EQ(replay(read)->hash(), rig.hash());
    // A recording that can only agree shows nothing: with one input changed the states differ.
    read.inputs.back().tick -= 3;
    EXPECT_NE(replay(read)->hash(), rig.hash());
}

TEST(Recording, OfTwoBodies) {
    Scene b = sphere_scene();
    b.scheme = Scheme::B;
    Rig rig({sphere_scene(), b});
    rig.apply(Push{{0, 0, 1}, 0.4, {0, 0, -0.05}});
    steps(rig, 30);
    EXPECT_NE(state_hash(rig[0].state()), state_hash(rig[1].state()));
    EXPECT_EQ(replay(recording_from_text(to_text(rig.recording()), "test"))->hash(), rig.hash());
}

// A command that one body refuses and the other takes is undone by one undo.
TEST(Rig, UndoStaysInStep) {
    Scene ruled = sphere_scene();
    SceneRefine rule;
    rule.at = 10;
    rule.near = Vector(0, 0, 1);
    rule.radius = 0.2;
    ruled.refine.push_back(rule);
    Rig rig({sphere_scene(), ruled});
    rig.apply(Gravity{{0, -3, 0}});
    const std::size_t vertices = rig[0].body().vertices();
    EXPECT_THROW(rig.apply(RefineNear{{0, 0, 1}, 0.5}), InputError) << "the second has rules of its own";
    EXPECT_GT(rig[0].body().vertices(), vertices);
    EXPECT_EQ(rig[1].body().vertices(), vertices);
    rig.apply(Undo{});
    EXPECT_EQ(rig[0].body().vertices(), vertices);
    EXPECT_EQ(rig[0].loads().gravity.y(), -3);
    EXPECT_EQ(rig[1].loads().gravity.y(), -3);
    rig.apply(Undo{});
    EXPECT_EQ(rig[0].loads().gravity.y(), 0);
    EXPECT_EQ(rig[1].loads().gravity.y(), 0);
}

TEST(Recording, OfATool) {
    Rig rig({sphere_scene()});
    rig.apply(Touch{0.3, 0, 0.5, {0, 0, 1.3}});
    steps(rig, 3);
    rig.apply(MoveTool{{0, 0, 1.1}});
    steps(rig, 20);
    rig.apply(MoveTool{{0.1, 0.1, 1.1}});
    rig.apply(RefineNear{{0, 0, 1}, 0.4});
    steps(rig, 20);
    EXPECT_GT(rig[0].contact()->tools[0].force.norm(), 0);
    Recording read = recording_from_text(to_text(rig.recording()), "test");
    EXPECT_EQ(replay(read)->hash(), rig.hash());
    std::get<Touch>(read.inputs[0].command).radius = 0.31;
    EXPECT_NE(replay(read)->hash(), rig.hash());
}

// What is done after the last step belongs to the recording too. What is done meanwhile does not.
TEST(Rig, SaysWhetherAReplayGaveTheSameBits) {
    Rig rig({sphere_scene(200)});
    rig.apply(Gravity{{0, -5, 0}});
    steps(rig, 12);
    rig.apply(RefineNear{{0, 0, 1}, 0.5});
    const Recording recording = rig.recording();
    EXPECT_FALSE(rig.as_recorded()) << "nothing is replayed";
    Rig again(recording);
    steps(again, 11);
    EXPECT_TRUE(again.replaying());
    EXPECT_FALSE(again.as_recorded());
    steps(again, 1);
    EXPECT_FALSE(again.replaying());
    EXPECT_EQ(again.as_recorded(), true);
    EXPECT_EQ(again.hash(), recording.hash);
    Recording changed = recording;
    changed.inputs[0].command = Gravity{{0, -5.1, 0}};
    Rig other(changed);
    steps(other, 12);
    EXPECT_EQ(other.as_recorded(), false);
    Rig touched(recording);
    steps(touched, 3);
    touched.apply(Gravity{{0, -5, 0}});
    steps(touched, 9);
    EXPECT_FALSE(touched.as_recorded().has_value());
}

// Scheme and material may be for one body of two; one undo takes it back, and it is written down.
TEST(Rig, OneBodyOfTwoIsChanged) {
    Rig rig({sphere_scene(), sphere_scene()});
    rig.apply(SetScheme{Scheme::A});
    rig.apply(SetScheme{Scheme::B}, 1);
    EXPECT_EQ(rig[0].body().scheme, Scheme::A);
    EXPECT_EQ(rig[1].body().scheme, Scheme::B);
    rig.apply(Touch{0.3, 0, 0, {0, 0, 1.2}});
    steps(rig, 20);
    for (std::size_t n : {0, 1}) EXPECT_GT(rig[n].contact()->tools[0].force.z(), 0) << n;
    EXPECT_NE(rig[0].contact()->tools[0].force, rig[1].contact()->tools[0].force);
    const auto again = replay(recording_from_text(to_text(rig.recording()), "test"));
    EXPECT_EQ(again->hash(), rig.hash());
    EXPECT_EQ((*again)[0].body().scheme, Scheme::A);
    EXPECT_THROW(rig.apply(Tune{material(-1, 10)}, 0), InputError);
    rig.apply(Undo{});
    EXPECT_EQ(rig[0].body().scheme, Scheme::A);
    EXPECT_EQ(rig[1].body().scheme, Scheme::A) << "as before it alone was changed";
}

TEST(Recording, DamageIsSaid) {
    Rig rig({sphere_scene(100)});
    rig.apply(Gravity{{0, -1, 0}});
    steps(rig, 3);
    const std::string text = to_text(rig.recording());
    for (std::size_t cut = 0; cut < text.size(); cut += 7) {
        try {
            recording_from_text(text.substr(0, cut), "cut");
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find("cut"), std::string::npos);
        }
    }
    EXPECT_THROW(recording_from_text(text.substr(0, text.find("gravity")), "cut"), InputError);
}

TEST(Simulation, UndoBringsBackTheBits) {
    Simulation body(sphere_scene());
    body.apply(Gravity{{0, -5, 0}});
    for (int n = 0; n < 10; ++n) body.advance();
    const auto before = state_hash(body.state());
    const auto vertices = body.body().vertices();
    const double K = body.body().K[3];
    for (const Command& command :
         std::vector<Command>{RefineNear{{0, 0, 1}, 0.5}, SetScheme{Scheme::A}, Tune{material(1, 100)},
                              Reset{}, Gravity{{9, 0, 0}}, PinAt{{{0, -1, 0}}}}) {
        body.apply(command);
        for (int n = 0; n < 5; ++n) body.advance();
        EXPECT_NE(state_hash(body.state()), before);
        body.apply(Undo{});
        EXPECT_EQ(state_hash(body.state()), before) << to_line(command);
        EXPECT_EQ(body.body().vertices(), vertices);
        EXPECT_EQ(body.body().K[3], K);
        EXPECT_EQ(body.loads().gravity.y(), -5);
    }
}

TEST(Simulation, UndoTakesTheToolAwayAndLeavesTheScenes) {
    Scene scene = sphere_scene();
    SceneTool floor;
    floor.normal = Vector(0, 1, 0);
    floor.at = Vector(0, -0.95, 0);
    scene.tools.push_back(floor);
    Simulation body(scene);
    body.apply(Gravity{{0, -5, 0}});
    for (int n = 0; n < 10; ++n) body.advance();
    const auto before = state_hash(body.state());
    body.apply(Touch{0.3, 0, 0.5, {0, 0, 1.2}});
    body.apply(SetScheme{Scheme::A});
    for (int n = 0; n < 10; ++n) body.advance();
    ASSERT_EQ(body.contact()->tools.size(), 2u);
    EXPECT_GT(body.contact()->tools[1].force.z(), 0);
    body.apply(Undo{});
    EXPECT_EQ(body.loads().tools.size(), 1u);
    EXPECT_EQ(body.hand_tool(), nullptr);
    EXPECT_EQ(body.contact(), nullptr) << "nothing has met these yet";
    EXPECT_EQ(state_hash(body.state()), before);
    ASSERT_TRUE(body.advance());
    EXPECT_LT(body.contact()->tools[0].force.y(), 0) << "the floor bears it";
    body.apply(Touch{0.3, 0, 0.5, {0, 0, 1.2}});
    body.apply(Grab{{0, 0, 1}, 0.3});
    EXPECT_EQ(body.loads().tools.size(), 1u) << "one hand";
    EXPECT_EQ(body.loads().forces.size(), 1u);
    for (const Touch& bad :
         {Touch{0.3, -1, 0, {0, 0, 1}}, Touch{0.3, 0, -1, {0, 0, 1}}, Touch{NAN, 0, 0, {0, 0, 1}},
          Touch{0.3, 1, 0, {0, 0, 1}, {0, 0, 0}}, Touch{0.3, 0, 0, {0, NAN, 1}}}) {
        EXPECT_THROW(body.apply(bad), InputError);
        EXPECT_EQ(body.loads().forces.size(), 1u) << "refused, it changes nothing";
    }
}

// A tool at rest is pressed with what holds the body up against it, however that came to rest; on a mesh this
// coarse it may rest on a vertex more or less.
TEST(Simulation, AToolFeelsTheSameInImplicitSteps) {
    Vector felt[2];
    for (const Integrator integrator : {Integrator::symplectic, Integrator::implicit}) {
        Scene scene = sphere_scene(300);
        scene.step.integrator = integrator;
        Simulation body(scene);
        body.apply(Touch{0.3, 0, 0, {0, 0, 1.3}});
        body.apply(MoveTool{{0, 0, 1.2}});
        for (int n = 0; n < 150; ++n) ASSERT_TRUE(body.advance());
        ASSERT_NE(body.contact(), nullptr);
        EXPECT_EQ(body.workspace().integrator(), integrator);
        felt[integrator == Integrator::implicit] = body.contact()->tools[0].force;
    }
    EXPECT_GT(felt[0].z(), 0.01);
    EXPECT_LT((felt[1] - felt[0]).norm(), 0.1 * felt[0].norm());
}

// Turned by a quarter about z, the axis along x goes to y, no faster than it may, and is saved so.
TEST(Simulation, ACapsuleIsTurned) {
    Simulation body(sphere_scene(200));
    body.apply(Touch{0.2, 0.6, 0, {0, 0, 3}, {1, 0, 0}});
    const double quarter = std::numbers::pi / 2;
    body.apply(MoveTool{{0, 0, 3}, {0, 0, quarter}});
    const auto axis = [&] {
        return Vector(pose_at(*body.hand_tool(), body.state().time).rotation * Vector::UnitZ());
    };
    Vector before = axis();
    EXPECT_LT((before - Vector(1, 0, 0)).norm(), 1e-12);
    for (int n = 0; n < 100; ++n) {
        ASSERT_TRUE(body.advance());
        EXPECT_LT(std::acos(std::min(1.0, before.dot(axis()))), 0.1 + 1e-6) << "10 rad/s of 10 ms";
        before = axis();
    }
    EXPECT_LT((axis() - Vector(0, 1, 0)).norm(), 1e-6);
    EXPECT_LT((body.scene().tools.at(0).axis.value() - Vector(0, 1, 0)).norm(), 1e-6);
    EXPECT_THROW(body.apply(MoveTool{{0, 0, 3}, {0, NAN, 0}}), InputError);
}

TEST(Simulation, TheSceneItSavesHasTheToolsWhereTheyAre) {
    Scene scene = sphere_scene();
    SceneTool floor;
    floor.normal = Vector(0, 1, 0);
    floor.at = Vector(0, -1, 0);
    scene.tools.push_back(floor);
    Simulation body(scene);
    body.apply(Touch{0.3, 0.4, 0.5, {0, 0, 1.4}, {1, 1, 0}});
    body.apply(MoveTool{{0, 0.1, 1.2}});
    for (int n = 0; n < 30; ++n) body.advance();
    const Simulation again(scene_from_text(to_toml(body.scene()), "saved"));
    ASSERT_EQ(again.loads().tools.size(), 2u);
    EXPECT_EQ(again.loads().tools[0].shape, ToolShape::plane);
    const Tool& tool = again.loads().tools[1];
    EXPECT_EQ(tool.shape, ToolShape::capsule);
    EXPECT_EQ(tool.radius, 0.3);
    EXPECT_EQ(tool.length, 0.4);
    EXPECT_EQ(tool.friction, 0.5);
    const Pose a = pose_at(*body.hand_tool(), body.state().time), b = pose_at(tool, 0);
    EXPECT_LT((a.position - b.position).norm(), 1e-12);
    EXPECT_LT((a.position - Vector(0, 0.1, 1.2)).norm(), 1e-3) << "it has come to where it was sent";
    EXPECT_LT((a.rotation * Vector::UnitZ()).cross(b.rotation * Vector::UnitZ()).norm(), 1e-12);
}

// What a tool feels acts along a line; where that comes out of the tool the body is touched.
TEST(Capture, TheForceActsWhereTheToolTouches) {
    const SurfaceMesh ball = make_shape("icosphere:vertices=642");
    for (const char* shape : {"ball", "capsule", "plane", "mesh"}) {
        Scene scene = sphere_scene(INNERSPRING_SANITIZED ? 400 : 1500);
        SceneTool tool;
        tool.name = shape;
        tool.at = Vector(0, 0, 1.2);
        if (tool.name == "ball") tool.radius = 0.3;
        if (tool.name == "capsule") tool.radius = 0.3, tool.length = 0.5, tool.axis = Vector(1, 0, 0);
        if (tool.name == "plane") tool.normal = Vector(0, 0, -1), tool.at = Vector(0.3, 0.2, 0.9);
        if (tool.name == "mesh") tool.mesh = "icosphere:vertices=642", tool.scale = 0.3;
        scene.tools.push_back(tool);
        Rig rig({scene});
        steps(rig, 200);
        Capture capture;
        Snapshot snapshot;
        capture(rig, snapshot);
        const TouchingTool& touching = snapshot.bodies[0].tools.at(0);
        EXPECT_LT(touching.newton.z(), 0) << shape;
        EXPECT_LT((touching.place - Vector(0, 0, 0.9)).norm(), 0.02) << shape;
        // The pressures over the areas make up the force: their normals are within a few degrees of it.
        double sum = 0;
        for (const auto& [vertex, pascal] : snapshot.bodies[0].pressed)
            sum += pascal * snapshot.bodies[0].surface->area[vertex];
        EXPECT_NEAR(sum / touching.newton.norm(), 1, 0.15) << shape;
        EXPECT_GE(sum, 0.999 * touching.newton.norm()) << "the sum of sizes";
        EXPECT_GT(most_pressure(snapshot.bodies[0]), 0);
    }
}

TEST(Simulation, ARefusedCommandChangesNothing) {
    Simulation body(sphere_scene());
    body.apply(Gravity{{0, -5, 0}});
    for (int n = 0; n < 5; ++n) body.advance();
    const auto before = state_hash(body.state());
    EXPECT_THROW(body.apply(Tune{material(-1, 10)}), InputError);
    EXPECT_THROW(body.apply(Tune{material(0.05, 0)}), InputError);
    EXPECT_THROW(body.apply(Gravity{{NAN, 0, 0}}), InputError);
    EXPECT_EQ(state_hash(body.state()), before);
    EXPECT_EQ(body.body().material.mass, 0.05);
}

// Hand and patch share the way by their springs: without surface springs the mean of the patch answers
// u = F / k_p, F = grip k_p (d - u), so u = d grip / (1 + grip) = 4/5 d.
TEST(Simulation, AHeldPatchFollowsTheHandByFourFifths) {
    Scene scene = sphere_scene();
    scene.material.surface = 0;
    Simulation body(scene);
    body.apply(Grab{{0, 0, 1}, 0.4});
    body.advance();
    EXPECT_EQ(body.hand_force()->newton, Vector(Vector::Zero())) << "taking hold does nothing yet";
    const Vector from = mean_place(*body.hand_force(), body.state()), way(0.01, 0.02, 0.03);
    body.apply(Drag{way});
    double largest = 0;
    for (int n = 0; n < 300; ++n) {
        body.advance();
        largest = std::max(largest, (mean_place(*body.hand_force(), body.state()) - from).norm());
    }
    const Vector moved = mean_place(*body.hand_force(), body.state()) - from;
    EXPECT_LT((moved - 0.8 * way).norm(), 1e-4 * way.norm());
    EXPECT_LT(largest, 1.1 * way.norm()) << "it must not overshoot much";
    // Refined under the hand, the force goes on as it was.
    const Vector force = body.hand_force()->newton;
    body.apply(RefineNear{{0, 0, 1}, 0.5});
    EXPECT_EQ(body.hand_force()->newton, force);
    body.advance();
    EXPECT_LT((body.hand_force()->newton - force).norm(), 0.05 * force.norm());
    body.apply(Release{});
    EXPECT_EQ(body.hand_force(), nullptr);
    for (int n = 0; n < 300; ++n) body.advance();
    for (std::size_t i = 0; i < body.body().vertices(); ++i)
        EXPECT_LT((body.state().x[i] - body.body().rest.positions[i]).norm(), 1e-6);
}

TEST(Simulation, TheSceneItSavesGivesTheSameBody) {
    Simulation body(sphere_scene());
    body.apply(Tune{material(0.1, 20, 0.5, 0.7)});
    body.apply(SetScheme{Scheme::B});
    body.apply(Gravity{{1, -2, 3}});
    body.apply(PinAt{{{0, -1, 0}, {0, 1, 0}}});
    const Simulation again(scene_from_text(to_toml(body.scene()), "saved"));
    EXPECT_EQ(again.loads().gravity, Vector(1, -2, 3));
    EXPECT_EQ(again.loads().pins.size(), 2u);
    for (std::size_t i = 0; i < body.body().vertices(); ++i) {
        EXPECT_NEAR(again.body().m[i], body.body().m[i], 1e-12 * body.body().m[i]);
        EXPECT_NEAR(again.body().K[i], body.body().K[i], 1e-12 * body.body().K[i]);
    }
}

// Whatever was let go and pinned again, and undone.
TEST(Simulation, TheSceneItSavesHasThePinsThatAre) {
    Scene scene = sphere_scene();
    for (const Vector& at : {Vector(1, 0, 0), Vector(-1, 0, 0)}) scene.pins.emplace_back().near = at;
    Simulation body(scene);
    const auto pinned = [](const Simulation& s) {
        std::vector<Index> all;
        for (const Pin& pin : s.loads().pins) all.insert(all.end(), pin.vertices.begin(), pin.vertices.end());
        std::sort(all.begin(), all.end());
        return all;
    };
    const auto expect_saved = [&](std::size_t count) {
        const Simulation again(scene_from_text(to_toml(body.scene()), "saved"));
        EXPECT_EQ(pinned(body).size(), count);
        EXPECT_EQ(pinned(again), pinned(body));
    };
    expect_saved(2);
    body.apply(PinAt{{{0, 1, 0}}});
    expect_saved(3);
    body.apply(Unpin{});
    expect_saved(0);
    for (const Vector& at : {Vector(0, 0, 1), Vector(0, 0, -1), Vector(0, -1, 0)}) {
        body.apply(PinAt{{at}});
        expect_saved(pinned(body).size());
    }
    for (const std::size_t count : {2, 1, 0, 3}) {
        body.apply(Undo{});
        expect_saved(count);
    }
    body.apply(Unpin{});
    body.apply(Reset{});
    expect_saved(2);
}

TEST(Camera, ARayThroughWhereAPointIsSeenMeetsIt) {
    Camera camera;
    fit(camera, {-1, -2, -3}, {4, 2, 1});
    orbit(camera, 33, -20);
    zoom(camera, 1.7);
    for (double aspect : {0.5, 1.0, 1.8}) {
        camera.aside = 0.1 * aspect;
        pan(camera, 0.1, -0.2, aspect);
        for (const Vector& p : {Vector(0, 0, 0), Vector(1, -1, 0.5), Vector(-0.5, 1, -2)}) {
            const Eigen::Vector4d clip =
                camera.projection(aspect) * camera.view() * Eigen::Vector4d(p.x(), p.y(), p.z(), 1);
            const Ray ray = camera.ray(clip.x() / clip.w(), clip.y() / clip.w(), aspect);
            EXPECT_LT(ray.along.cross(p - ray.from).norm(), 1e-12);
            EXPECT_LT(std::abs(clip.z() / clip.w()), 1);
        }
    }
}

TEST(Camera, RoomBesideMovesTheMiddleByAsMuch) {
    Camera camera;
    fit(camera, {-1, -1, -1}, {1, 1, 1});
    EXPECT_NEAR(zoomed(camera), 1, 1e-12);
    zoom(camera, 1.5);
    EXPECT_NEAR(zoomed(camera), 1.5, 1e-12);
    const Box2 box{10, 20, 400, 300};
    camera.aside = 0.25;
    const auto [x, y] = project(camera, box, camera.focus);
    EXPECT_NEAR(x, 10 + 200 - 0.25 * 200, 1e-9);
    EXPECT_NEAR(y, 20 + 150, 1e-9);
}

TEST(Panel, GravityGoesWhereItsAnglesSay) {
    PanelState state;
    EXPECT_EQ(state.gravity, Vector(0, -9.81, 0));
    turn_gravity(state, 90, 90);
    EXPECT_LT((state.gravity - Vector(9.81, 0, 0)).norm(), 1e-12);
    turn_gravity(state, 180, 30);
    EXPECT_LT((state.gravity - Vector(0, 9.81, 0)).norm(), 1e-12);
    for (const Vector& g : {Vector(1, 2, 3), Vector(-1, -2, 0.5), Vector(0, 0, -4), Vector(3, 0, -3)}) {
        set_gravity(state, g);
        EXPECT_EQ(state.gravity, g) << "to the bit: it may be the scene's";
        turn_gravity(state, state.tilt, state.towards);
        EXPECT_LT((state.gravity - g).norm(), 1e-12 * g.norm());
    }
}

TEST(Camera, FirstHitIsTheNearSideOfASphere) {
    const SurfaceMesh mesh = make_shape("icosphere:vertices=10000");
    Camera camera;
    fit(camera, {-1, -1, -1}, {1, 1, 1});
    const auto hit = first_hit(camera.ray(0, 0, 1), mesh.positions, mesh.triangles);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance, camera.distance - 1, 2e-3);
    EXPECT_LT((hit->point - camera.back()).norm(), 2e-3);
    EXPECT_NEAR(hit->barycentric.sum(), 1, 1e-12);
    EXPECT_FALSE(first_hit(camera.ray(0.99, 0.99, 1), mesh.positions, mesh.triangles));
}

TEST(Camera, OptionsSayWhatIsWrong) {
    EXPECT_EQ(parse_camera("-30,15").azimuth, -30);
    EXPECT_EQ(parse_camera("30,15,2.5").zoom, 2.5);
    for (const char* text : {"", "1", "1,", "1,2,", "1,2,3,4", "a,b", "1,91", "1,2,0", "nan,1"})
        EXPECT_THROW(parse_camera(text), InputError) << text;
}

TEST(TripleBuffer, ShowsWholeThingsInOrder) {
    TripleBuffer<std::array<std::uint64_t, 64>> buffer;
    constexpr std::uint64_t last = 200000;
    std::thread writer([&] {
        for (std::uint64_t n = 1; n <= last; ++n) {
            buffer.back().fill(n);
            buffer.publish();
        }
    });
    std::uint64_t seen = 0;
    while (seen < last) {
        if (!buffer.update()) continue;
        const auto& now = buffer.front();
        ASSERT_GT(now.front(), seen);
        for (std::uint64_t v : now) ASSERT_EQ(v, now.front());
        seen = now.front();
    }
    writer.join();
}

namespace {

/// Until a snapshot says so; false after ten seconds.
template <class Condition>
bool wait(Session& session, Condition condition) {
    for (int n = 0; n < 10000; ++n) {
        session.update();
        if (condition(session.latest())) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

}  // namespace

TEST(Session, KeepsThePaceOfTheClock) {
    Session session(std::make_unique<Rig>(std::vector{sphere_scene()}));
    // A busy machine may be late for a while; a clock that runs wrong never agrees.
    ASSERT_TRUE(wait(session, [](const Snapshot& s) { return std::abs(s.real_time_factor - 1) < 0.05; }));
    session.set_speed(0.2);
    const double from = session.latest().time;
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    session.update();
    EXPECT_LT(session.latest().time - from, 0.4) << "slow motion";
}

TEST(Session, PausesStepsAndTakesCommandsWhilePaused) {
    Session session(std::make_unique<Rig>(std::vector{sphere_scene()}));
    session.pause(true);
    ASSERT_TRUE(wait(session, [](const Snapshot& s) { return s.paused; }));
    const auto ticks = session.latest().ticks;
    for (int n = 0; n < 3; ++n) session.single_step();
    ASSERT_TRUE(wait(session, [&](const Snapshot& s) { return s.ticks == ticks + 3; }));
    session.send(RefineNear{{0, 0, 1}, 0.5});
    ASSERT_TRUE(wait(session, [&](const Snapshot& s) { return s.bodies[0].u.size() > 400; }));
    EXPECT_EQ(session.latest().bodies[0].u.size(), session.latest().bodies[0].surface->rest.size());
    EXPECT_EQ(session.latest().ticks, ticks + 3);
    session.send(Tune{material(-1, 10)});
    ASSERT_TRUE(
        wait(session, [&](const Snapshot& s) { return s.message.find("mass") != std::string::npos; }));
}

TEST(Session, SaysHowAReplayEnded) {
    Rig rig({sphere_scene(200)});
    rig.apply(Gravity{{0, -5, 0}});
    steps(rig, 20);
    Session session(std::make_unique<Rig>(rig.recording()));
    ASSERT_TRUE(wait(session, [](const Snapshot& s) {
        return !s.replaying && s.message.find("same bits") != std::string::npos;
    }));
}

TEST(Open, SaysWhatIsWrong) {
    for (const char* what : {"spere", "missing.stl", "missing.toml", "sphere:vertices=3"})
        EXPECT_THROW(open_rig({{what}}), InputError) << what;
    EXPECT_THROW(open_rig({{"sphere", "breast", "torus"}}), InputError);
    EXPECT_EQ(open_rig({{"sphere:vertices=100", "breast:vertices=100"}})->size(), 2u);
    const auto both = open_rig({{"breast:vertices=200"}, {}, {Scheme::B, Scheme::C}});
    EXPECT_EQ((*both)[0].body().scheme, Scheme::B);
    EXPECT_EQ((*both)[1].body().scheme, Scheme::C);
}
