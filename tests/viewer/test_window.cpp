#include "window.h"

#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numbers>

#include "display.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/write.h"
#include "innerspring/record/run.h"
#include "pictures.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"

using namespace innerspring;
using namespace innerspring::viewer;

namespace {

void weightless(Scene& scene) {
    scene.gravity = Vector::Zero();
}

WindowOptions showing(const std::string& what) {
    WindowOptions options;
    options.open = {{what}, weightless};
    options.size = {{800, 500}};
    options.remember = false;
    return options;
}

/// Frames until it holds; false after two minutes (sanitizers are slow).
template <class Condition>
bool until(Window& window, Condition condition) {
    const double start = glfwGetTime();
    while (glfwGetTime() - start < 120) {
        if (!window.frame()) return false;
        if (condition()) return true;
    }
    return false;
}

void settle(Window& window, double seconds) {
    const double from = window.snapshot().time;
    EXPECT_TRUE(until(window, [&] { return window.snapshot().time >= from + seconds; }));
}

void press(Window& window, int key, int modifiers = 0) {
    window.key(key, true, modifiers);
    window.key(key, false, modifiers);
    window.frame();
}

void point_at(Window& window, const Vector& place) {
    const auto [x, y] = window.on_screen(place);
    window.mouse_move(x, y);
    window.frame();
}

/// The place of the surface that faces the eye.
Vector facing(const Window& window) {
    return window.snapshot()
        .bodies[0]
        .surface->rest[nearest_vertex(window.snapshot().bodies[0].surface->rest, 5 * window.camera().back())];
}

bool said(const Window& window, const char* words) {
    return window.message().find(words) != std::string::npos;
}

std::string the_only_file(const std::filesystem::path& folder, const char* extension) {
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() == extension) return entry.path().string();
    return "";
}

}  // namespace

TEST(Window, OpensEveryShape) {
    NEED_DISPLAY();
    for (std::string_view shape : shape_names()) {
        Window window(showing(std::string(shape) + ":vertices=300"));
        settle(window, 0.02);
        const Image image = window.keep_picture();
        ASSERT_EQ(image.width, 800);
        EXPECT_GT(covered(image, 0, 440, 60, 460), 0.08) << shape;
        window.close();
        EXPECT_FALSE(window.frame());
    }
}

// Law 2: dV/V = -3 F / (4 pi R^2 (E + 3 E_s / R)), through the mouse; E = 10, E_s = 1, R = 1.
TEST(Window, APushByTheMouseTakesTheVolumeOfTheLaw) {
    NEED_DISPLAY();
    Window window(showing("sphere:vertices=2000"));
    window.frame();
    const Image before = window.keep_picture();
    press(window, GLFW_KEY_P);
    EXPECT_EQ(window.panel().grip, Grip::push);
    point_at(window, facing(window));
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, true, 0);
    for (int n = 0; n < 17; ++n) window.scroll(-1);  // softer, to where the law holds
    ASSERT_TRUE(until(window, [&] { return window.snapshot().bodies[0].pulls.size() == 1; }));
    settle(window, 1.5);
    const BodySnapshot& body = window.snapshot().bodies[0];
    const double F = force_sum(body);
    EXPECT_NEAR(F / (0.01 * std::pow(1.15, -17) * 10), 1, 0.01) << "a hundredth of E R^2, 17 clicks down";
    const double law = -300 * F / (4 * std::numbers::pi * 13);
    EXPECT_NEAR(body.volume_variation_percent / law, 1, 0.05);
    for (int n = 0; n < 40; ++n) window.scroll(1);  // harder, to be seen
    settle(window, 0.5);
    EXPECT_GT(difference(before, window.keep_picture()), 1);
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, false, 0);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().bodies[0].pulls.empty(); }));
    settle(window, 1.5);
    EXPECT_LT(window.snapshot().bodies[0].max_displacement, 1e-3);
}

// A ball of radius a with its middle at s on a sphere of inner springs: F = sum_i K_i (a - |q_i - s|) along
// s - q_i without friction, as in test_contact.cpp.
TEST(Window, ABallPressedByTheMouseFeelsTheContactLaw) {
    NEED_DISPLAY();
    WindowOptions options = showing("icosphere:vertices=10242");
    options.open.adjust = [](Scene& scene) {
        weightless(scene);
        scene.material.surface = 0;
    };
    options.look.colour = ColourBy::contact;
    options.ball.friction = 0;
    Window window(options);
    window.frame();
    press(window, GLFW_KEY_B);
    EXPECT_EQ(window.panel().grip, Grip::touch);
    point_at(window, facing(window));
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, true, 0);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().bodies[0].tools.size() == 1; }));
    settle(window, 0.3);
    const BodySnapshot* body = &window.snapshot().bodies[0];
    EXPECT_LT(body->max_displacement, 1e-3) << "it comes to the surface and no farther";
    const Image before = window.keep_picture();
    for (int n = 0; n < 8; ++n) window.scroll(1);
    settle(window, 1.5);
    body = &window.snapshot().bodies[0];
    const TouchingTool& tool = body->tools.at(0);
    const double a = tool.tool.radius;
    EXPECT_NEAR(a, 0.25 * body->surface->radius, 1e-12);
    const Vector s = tool.pose().position;
    const double d = 1 + a - s.norm();
    EXPECT_NEAR(d / (8 * 0.05 * a), 1, 0.02) << "eight clicks";
    Vector exact = Vector::Zero();
    for (std::size_t i = 0; i < body->u.size(); ++i) {
        const Vector away = body->surface->rest[i] - s;
        if (away.norm() < a) exact += body->surface->K[i] * (a - away.norm()) * away.normalized();
    }
    RecordProperty("force_over_law", std::to_string(tool.newton.norm() / exact.norm()));
    EXPECT_LT((tool.newton - exact).norm(), 0.05 * exact.norm());
    // Pressure of the foundation under the middle: E/R times the depth.
    EXPECT_NEAR(most_pressure(*body) / (10 * d), 1, 0.05);
    EXPECT_GT(difference(before, window.keep_picture()), 0.5);
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, false, 0);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().bodies[0].tools.empty(); }));
    settle(window, 1.5);
    EXPECT_LT(window.snapshot().bodies[0].max_displacement, 1e-3);
}

TEST(Window, ACapsuleDrawnOverTheBodyIsReplayedWithTheSameBits) {
    NEED_DISPLAY();
    const TemporaryFolder folder("touch");
    WindowOptions options = showing("breast:vertices=500");
    options.save = folder.path;
    Window window(options);
    window.frame();
    press(window, GLFW_KEY_B);
    press(window, GLFW_KEY_B);
    EXPECT_TRUE(window.panel().ball.capsule);
    point_at(window, facing(window));
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, true, 0);
    for (int n = 0; n < 10; ++n) window.scroll(1);
    settle(window, 0.3);
    ASSERT_EQ(window.snapshot().bodies[0].tools.size(), 1u);
    EXPECT_GT(window.snapshot().bodies[0].tools[0].tool.length, 0);
    EXPECT_GT(window.snapshot().bodies[0].tools[0].newton.dot(-window.camera().back()), 0);
    const Vector from = window.snapshot().bodies[0].tools[0].pose().position;
    const auto [x, y] = window.on_screen(facing(window));
    for (int n = 0; n < 10; ++n) {
        window.mouse_move(x + 5 * n, y);
        settle(window, 0.02);
    }
    settle(window, 0.2);
    EXPECT_GT((window.snapshot().bodies[0].tools.at(0).pose().position - from).dot(window.camera().right()),
              0.1);
    // With Shift the wheel turns it, here by a right angle: what lay across the picture stands up in it.
    const auto axis = [&] {
        return Vector(window.snapshot().bodies[0].tools.at(0).pose().rotation * Vector::UnitZ());
    };
    EXPECT_GT(std::abs(axis().dot(window.camera().right())), 0.99);
    window.key(GLFW_KEY_LEFT_SHIFT, true, 0);
    for (int n = 0; n < 9; ++n) window.scroll(1);
    window.key(GLFW_KEY_LEFT_SHIFT, false, GLFW_MOD_SHIFT);
    settle(window, 0.6);
    EXPECT_GT(std::abs(axis().dot(window.camera().up())), 0.99);
    press(window, GLFW_KEY_F4);
    ASSERT_TRUE(until(window, [&] { return said(window, ".toml"); })) << window.message();
    press(window, GLFW_KEY_G);
    settle(window, 0.1);
    press(window, GLFW_KEY_Z);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().bodies[0].tools.empty(); })) << "undo";
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, false, 0);
    settle(window, 0.05);
    press(window, GLFW_KEY_F5);
    ASSERT_TRUE(until(window, [&] { return said(window, ".session"); })) << window.message();
    const Recording recording = read_recording(the_only_file(folder.path, ".session"));
    EXPECT_GT(recording.inputs.size(), 10u);
    EXPECT_EQ(replay(recording)->hash(), recording.hash);
    EXPECT_EQ(read_scene(the_only_file(folder.path, ".toml")).tools.size(), 1u);
}

TEST(Window, TwoBodiesFeelTheBallAndKeepTheirOwnScheme) {
    NEED_DISPLAY();
    WindowOptions options = showing("breast:vertices=400");
    options.open.compare = {Scheme::B, Scheme::C};
    Window window(options);
    window.frame();
    press(window, GLFW_KEY_B);
    point_at(window, facing(window));
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, true, 0);
    for (int n = 0; n < 10; ++n) window.scroll(1);
    settle(window, 0.4);
    for (const BodySnapshot& body : window.snapshot().bodies) {
        ASSERT_EQ(body.tools.size(), 1u);
        EXPECT_GT(body.tools[0].newton.norm(), 0);
    }
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, false, 0);
    press(window, GLFW_KEY_X);
    press(window, GLFW_KEY_1);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().bodies[0].scheme == Scheme::A; }));
    EXPECT_EQ(window.snapshot().bodies[1].scheme, Scheme::C);
    press(window, GLFW_KEY_X);
    press(window, GLFW_KEY_2);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().bodies[1].scheme == Scheme::B; }));
    EXPECT_EQ(window.snapshot().bodies[0].scheme, Scheme::A);
    press(window, GLFW_KEY_X);
    press(window, GLFW_KEY_3);
    ASSERT_TRUE(until(window, [&] {
        return window.snapshot().bodies[0].scheme == Scheme::C &&
               window.snapshot().bodies[1].scheme == Scheme::C;
    }));
}

TEST(Window, TheSurfaceIsTakenHoldOfAndFollowsTheMouse) {
    NEED_DISPLAY();
    Window window(showing("sphere:vertices=800"));
    window.frame();
    const Vector place = facing(window);
    point_at(window, place);
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, true, 0);
    const Vector to = place + 0.1 * window.camera().right();
    point_at(window, to);
    settle(window, 1);
    ASSERT_EQ(window.snapshot().bodies[0].pulls.size(), 1u);
    EXPECT_GT(window.snapshot().bodies[0].pulls[0].newton.dot(window.camera().right()), 0);
    EXPECT_GT(window.snapshot().bodies[0].max_displacement, 0.05);
    EXPECT_LT(window.snapshot().bodies[0].max_displacement, 0.2);
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, false, 0);
    EXPECT_TRUE(until(window, [&] { return window.snapshot().bodies[0].pulls.empty(); }));
}

TEST(Window, TheCameraIsTurnedMovedAndBroughtNearer) {
    NEED_DISPLAY();
    Window window(showing("sphere:vertices=200"));
    window.frame();
    const Camera before = window.camera();
    window.mouse_move(30, 400);
    window.frame();
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, true, 0);  // beside the body
    window.mouse_move(80, 380);
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, false, 0);
    EXPECT_NE(window.camera().azimuth, before.azimuth);
    EXPECT_NE(window.camera().elevation, before.elevation);
    window.mouse_button(GLFW_MOUSE_BUTTON_MIDDLE, true, 0);
    window.mouse_move(100, 400);
    window.mouse_button(GLFW_MOUSE_BUTTON_MIDDLE, false, 0);
    EXPECT_GT((window.camera().focus - before.focus).norm(), 0.01);
    window.scroll(2);
    EXPECT_LT(window.camera().distance, before.distance);
    press(window, GLFW_KEY_0);
    EXPECT_LT((window.camera().focus - before.focus).norm(), 1e-12);
    EXPECT_EQ(window.camera().distance, before.distance);
}

TEST(Window, RefinesAndCoarsensUnderThePointer) {
    NEED_DISPLAY();
    Window window(showing("breast:vertices=500"));
    window.frame();
    const std::size_t vertices = window.snapshot().bodies[0].u.size();
    point_at(window, facing(window));
    press(window, GLFW_KEY_R);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().bodies[0].u.size() > vertices; }));
    const std::size_t fine = window.snapshot().bodies[0].u.size();
    press(window, GLFW_KEY_C);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().bodies[0].u.size() < fine; }));
    press(window, GLFW_KEY_Z);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().bodies[0].u.size() == fine; }));
    press(window, GLFW_KEY_Z);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().bodies[0].u.size() == vertices; }));
    EXPECT_LT(window.snapshot().bodies[0].max_displacement, 0.01) << "nothing moved it";
    window.mouse_move(5, 300);
    press(window, GLFW_KEY_R);
    EXPECT_TRUE(said(window, "point at the body"));
}

TEST(Window, SchemesGravityAndTimeByKey) {
    NEED_DISPLAY();
    Window window(showing("breast:vertices=400"));
    window.frame();
    for (const auto& [key, scheme] : {std::pair{GLFW_KEY_1, Scheme::A}, std::pair{GLFW_KEY_2, Scheme::B},
                                      std::pair{GLFW_KEY_3, Scheme::C}}) {
        press(window, key);
        ASSERT_TRUE(
            until(window, [&, wanted = scheme] { return window.snapshot().bodies[0].scheme == wanted; }));
    }
    press(window, GLFW_KEY_G);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().gravity.y() == -9.81; }));
    settle(window, 0.3);
    EXPECT_GT(window.snapshot().bodies[0].max_displacement, 1e-3);
    // Gravity goes down in the picture from wherever that is taken.
    window.mouse_move(30, 400);
    window.mouse_button(GLFW_MOUSE_BUTTON_RIGHT, true, 0);
    window.mouse_move(150, 300);
    window.mouse_button(GLFW_MOUSE_BUTTON_RIGHT, false, 0);
    press(window, GLFW_KEY_G, GLFW_MOD_SHIFT);
    const Vector down = -9.81 * window.camera().up();
    EXPECT_LT(down.y(), -1);
    EXPECT_GT(std::hypot(down.x(), down.z()), 1);
    ASSERT_TRUE(until(window, [&] { return (window.snapshot().gravity - down).norm() < 1e-9; }));
    press(window, GLFW_KEY_G);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().gravity.isZero(0); }));
    press(window, GLFW_KEY_G);
    ASSERT_TRUE(until(window, [&] { return (window.snapshot().gravity - down).norm() < 1e-9; }));
    for (int n = 0; n < 2; ++n) window.character('-');
    ASSERT_TRUE(until(window, [&] { return window.snapshot().speed < 1; })) << "slow motion";
    window.character('+');
    press(window, GLFW_KEY_SPACE);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().paused; }));
    const auto ticks = window.snapshot().ticks;
    press(window, GLFW_KEY_PERIOD);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().ticks == ticks + 1; }));
    press(window, GLFW_KEY_BACKSPACE);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().time == 0; }));
    EXPECT_EQ(window.snapshot().bodies[0].max_displacement, 0);
    window.character('?');
    window.frame();
    const Image help = window.keep_picture();
    window.character('?');
    EXPECT_GT(difference(help, window.keep_picture()), 5);
}

// At once, in the window and with the camera as it is: the same body at the same place in the end.
TEST(Window, ASessionIsReplayedFromItsBeginning) {
    NEED_DISPLAY();
    Window window(showing("breast:vertices=400"));
    window.frame();
    EXPECT_TRUE(said(window, "all keys")) << "a newcomer is told what to do";
    window.scroll(2);
    press(window, GLFW_KEY_G);
    point_at(window, facing(window));
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, true, 0);
    EXPECT_FALSE(said(window, "all keys")) << "until something is done";
    for (int n = 0; n < 5; ++n) {
        const auto [x, y] = window.on_screen(facing(window));
        window.mouse_move(x + 6 * n, y);
        settle(window, 0.02);
    }
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, false, 0);
    press(window, GLFW_KEY_2);
    settle(window, 0.1);
    const Camera camera = window.camera();
    press(window, GLFW_KEY_F6);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().replaying; }));
    EXPECT_EQ(window.snapshot().bodies[0].scheme, Scheme::C) << "as it began";
    ASSERT_TRUE(until(window, [&] { return said(window, "same bits"); })) << window.message();
    EXPECT_EQ(window.snapshot().bodies[0].scheme, Scheme::B);
    EXPECT_EQ(window.camera().distance, camera.distance);
}

// The panel's sliders stand somewhere in its column: one after another is dragged until E_s has changed.
TEST(Window, SlidersTuneTheBodyAndUndoBringsItBack) {
    NEED_DISPLAY();
    WindowOptions options = showing("sphere:vertices=300");
    options.size = {{1200, 760}};
    Window window(options);
    window.frame(), window.frame();
    const Camera before = window.camera();
    const double surface = window.snapshot().bodies[0].material.surface;
    for (int y = 120; y < 400 && window.snapshot().bodies[0].material.surface == surface; y += 11) {
        window.mouse_move(1000, y);
        window.frame(), window.frame();
        window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, true, 0);
        window.frame();
        for (int x = 1000; x > 930; x -= 10) {
            window.mouse_move(x, y);
            window.frame();
        }
        window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, false, 0);
        settle(window, 0.02);
    }
    EXPECT_LT(window.snapshot().bodies[0].material.surface, surface);
    EXPECT_EQ(window.camera().azimuth, before.azimuth) << "what is done on the panel stays there";
    EXPECT_TRUE(window.snapshot().bodies[0].pulls.empty());
    press(window, GLFW_KEY_Z);
    EXPECT_TRUE(until(window, [&] { return window.snapshot().bodies[0].material.surface == surface; }));
}

TEST(Window, ASessionIsWrittenDownAndPlayedAgainWithTheSameBits) {
    NEED_DISPLAY();
    const TemporaryFolder folder("session");
    WindowOptions options = showing("breast:vertices=500");
    options.save = folder.path;
    std::uint64_t vertices = 0;
    {
        Window window(options);
        window.frame();
        press(window, GLFW_KEY_G);
        point_at(window, facing(window));
        window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, true, 0);
        for (int n = 0; n < 10; ++n) {
            const auto [x, y] = window.on_screen(facing(window));
            window.mouse_move(x + 4 * n, y - 3 * n);
            settle(window, 0.02);
        }
        window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, false, 0);
        press(window, GLFW_KEY_R);
        press(window, GLFW_KEY_2);
        settle(window, 0.1);
        press(window, GLFW_KEY_F5);
        ASSERT_TRUE(until(window, [&] { return said(window, "saved"); })) << window.message();
        vertices = window.snapshot().bodies[0].u.size();
    }
    const std::string file = the_only_file(folder.path, ".session");
    const Recording recording = read_recording(file);
    EXPECT_GT(recording.inputs.size(), 8u);
    const auto headless = replay(recording);
    EXPECT_EQ(headless->hash(), recording.hash);
    EXPECT_EQ((*headless)[0].body().vertices(), vertices);
    EXPECT_EQ((*headless)[0].body().scheme, Scheme::B);
    // And in a window, at the pace of the clock.
    options.open = {{file}};
    Window window(options);
    ASSERT_TRUE(until(window, [&] { return !window.snapshot().replaying; }));
    std::atomic<std::uint64_t> again = 0;
    Rig by_steps(recording);
    window.session()->pause(true);
    window.session()->ask([&](const Rig& rig) {
        again = rig.hash();
        while (by_steps.ticks() < rig.ticks()) by_steps.advance();
        return "asked";
    });
    ASSERT_TRUE(until(window, [&] { return again != 0 && said(window, "asked"); }));
    EXPECT_EQ(again, by_steps.hash());
}

TEST(Window, SavesWhatItShows) {
    NEED_DISPLAY();
    const TemporaryFolder folder("saves");
    WindowOptions options = showing("breast:vertices=300");
    options.save = folder.path;
    Window window(options);
    settle(window, 0.05);
    for (const auto& [key, extension] :
         {std::pair{GLFW_KEY_F2, ".png"}, std::pair{GLFW_KEY_F3, ".vtp"}, std::pair{GLFW_KEY_F4, ".toml"}}) {
        press(window, key);
        EXPECT_TRUE(until(window, [&, name = extension] { return said(window, name); })) << window.message();
        EXPECT_NE(the_only_file(folder.path, extension), "");
    }
    EXPECT_EQ(read_scene(the_only_file(folder.path, ".toml")).mesh, "breast:vertices=300");
}

TEST(Window, ABrokenFileIsSaidAndTheWindowStays) {
    NEED_DISPLAY();
    const TemporaryFolder folder("broken");
    write_whole(folder.path / "broken.obj", "v 0 0 0\nv 1 0 0\nf 1 2 7\n");
    write_whole(folder.path / "broken.toml", "mesh = 3\n");
    write_whole(folder.path / "broken.session", "innerspring recording 1\nticks 3\n");
    write_whole(folder.path / "good.obj", to_obj(make_shape("torus:vertices=300")));
    Window window(showing("sphere:vertices=200"));
    window.frame();
    for (const char* name : {"broken.obj", "broken.toml", "broken.session", "missing.ply"}) {
        window.drop({(folder.path / name).string()});
        EXPECT_TRUE(until(window, [&] { return said(window, name); })) << window.message();
        EXPECT_TRUE(window.frame());
        EXPECT_EQ(window.snapshot().bodies[0].surface->name.substr(0, 6), "sphere");
    }
    window.drop({folder.path.string()});  // a folder without frames
    EXPECT_TRUE(until(window, [&] { return said(window, "frames.pvd"); })) << window.message();
    window.drop({(folder.path / "good.obj").string()});
    EXPECT_TRUE(until(window, [&] { return said(window, "good.obj"); })) << window.message();
    settle(window, 0.05);
    EXPECT_NE(window.snapshot().bodies[0].surface->name.substr(0, 6), "sphere");
}

// A large file is read in a thread: the body shown goes on meanwhile, and a second file has to wait.
TEST(Window, GoesOnWhileAFileIsOpened) {
    NEED_DISPLAY();
    const TemporaryFolder folder("large");
    const std::size_t many = INNERSPRING_SANITIZED ? 10000 : 40000;
    write_whole(folder.path / "large.obj", to_obj(make_shape(fmt::format("torus:vertices={}", many))));
    Window window(showing("sphere:vertices=200"));
    settle(window, 0.05);
    const auto vertices = [&] { return window.snapshot().bodies[0].u.size(); };
    const std::size_t before = vertices();
    const auto ticks = window.snapshot().ticks;
    const Image quiet = window.keep_picture();
    window.drop({(folder.path / "large.obj").string()});
    EXPECT_EQ(vertices(), before) << "dropping does not wait";
    window.frame();  // measures the text
    const Image opening = window.keep_picture();
    EXPECT_GT(difference(quiet, opening), 0.01) << "it is said";
    window.drop({"sphere"});
    EXPECT_TRUE(said(window, "still being opened")) << window.message();
    ASSERT_TRUE(until(window, [&] { return window.snapshot().ticks > ticks + 3 || vertices() != before; }));
    EXPECT_EQ(vertices(), before) << "the sphere goes on meanwhile";
    ASSERT_TRUE(until(window, [&] { return vertices() != before; }));
    EXPECT_GT(vertices(), many * 3 / 4);
}

TEST(Window, FollowsItsSize) {
    NEED_DISPLAY();
    Window window(showing("sphere:vertices=300"));
    for (const auto& [width, height] : {std::pair{640, 700}, std::pair{1200, 480}, std::pair{330, 240}}) {
        glfwSetWindowSize(window.handle(), width, height);
        ASSERT_TRUE(until(window, [&, wanted = width] { return window.keep_picture().width == wanted; }));
        const Image image = window.keep_picture();
        EXPECT_EQ(image.height, height);
        EXPECT_GT(covered(image, 0, width, 0, height), 0.05);
    }
}

TEST(Window, PinsWithALasso) {
    NEED_DISPLAY();
    Window window(showing("sphere:vertices=600"));
    window.frame();
    press(window, GLFW_KEY_L);
    const auto [x, y] = window.on_screen(Vector::Zero());
    window.mouse_move(x - 30, y - 30);
    window.frame();
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, true, 0);
    for (const auto& [dx, dy] : {std::pair{30, -30}, std::pair{30, 30}, std::pair{-30, 30}})
        window.mouse_move(x + dx, y + dy);
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, false, 0);
    ASSERT_TRUE(until(window, [&] { return !window.snapshot().bodies[0].pinned.empty(); }));
    press(window, GLFW_KEY_G);
    settle(window, 0.5);
    const BodySnapshot& body = window.snapshot().bodies[0];
    for (Index i : body.pinned) {
        for (float u : body.u[i]) EXPECT_EQ(u, 0);
        EXPECT_GT(body.surface->rest[i].dot(window.camera().back()), 0.5) << "only what faces the eye";
    }
    EXPECT_GT(body.max_displacement, 1e-3);
}

TEST(Window, PlaysWhatWasSimulated) {
    NEED_DISPLAY();
    const TemporaryFolder folder("frames");
    Scene scene;
    scene.mesh = "breast:vertices=300";
    scene.duration = 0.5;
    const Summary summary = run(scene, {.directory = folder.path});
    WindowOptions options = showing(folder.path.string());
    Window window(options);
    EXPECT_EQ(window.session(), nullptr);
    ASSERT_TRUE(until(window, [&] { return window.snapshot().time >= 0.5 - 1e-9; }));
    EXPECT_NEAR(window.snapshot().bodies[0].max_displacement, summary.last.max_displacement, 1e-12);
    EXPECT_NEAR(window.snapshot().bodies[0].volume_variation_percent, summary.volume_variation_percent.final,
                1e-9);
    // Frame by frame, round and round.
    press(window, GLFW_KEY_PERIOD);
    const double first = window.snapshot().time;
    press(window, GLFW_KEY_PERIOD);
    const double second = window.snapshot().time;
    press(window, GLFW_KEY_PERIOD);
    EXPECT_NE(first, second);
    EXPECT_NEAR(window.snapshot().time - second, second - first, 1e-9);
    EXPECT_GT(covered(window.keep_picture(), 0, 440, 60, 440), 0.1);
}

TEST(Window, RemembersItsSizeAndCamera) {
    NEED_DISPLAY();
    const TemporaryFolder folder("config");
    const std::string before = std::getenv("XDG_CONFIG_HOME");
    setenv("XDG_CONFIG_HOME", folder.path.c_str(), 1);
    WindowOptions options = showing("sphere:vertices=200");
    options.remember = true;
    options.size = {{640, 480}};
    options.camera = CameraOption{77, -11, 1.7};
    {
        Window window(options);
        glfwSetWindowPos(window.handle(), 60, 40);
        window.frame();
    }
    options.size.reset(), options.camera.reset();
    {
        Window window(options);
        EXPECT_NEAR(zoomed(window.camera()), 1.7, 1e-9);
        int x = 0, y = 0;
        glfwGetWindowPos(window.handle(), &x, &y);
        EXPECT_EQ(x, 60);
        EXPECT_EQ(y, 40);
        EXPECT_EQ(window.camera().azimuth, 77);
        EXPECT_EQ(window.camera().elevation, -11);
        EXPECT_EQ(window.keep_picture().width, 640);
    }
    write_whole(folder.path / "innerspring" / "viewer", "width banana\nheight -3\nx 1e9\ny 1e9\nzoom nan\n");
    { Window window(options); }
    setenv("XDG_CONFIG_HOME", before.c_str(), 1);
}
