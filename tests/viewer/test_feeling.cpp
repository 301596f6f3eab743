#include "feeling.h"

#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include "display.h"
#include "innerspring/haptic/hand.h"
#include "innerspring/haptic/press_script.h"
#include "offscreen.h"
#include "pictures.h"
#include "support/bodies.h"
#include "window.h"

// A body in the hand, with the window beside.
using namespace innerspring;
using namespace innerspring::viewer;

namespace {

constexpr double dt = 0.005;

/// A sphere, a ball, and what holds it.
struct Held {
    Body body = support::make_body("icosphere:vertices=642");
    Loads loads{Vector::Zero(), {}, {}, {sphere_tool(0.3, {0, 0, 1e3})}};
    HandMapping mapping;
    StepOptions step;
    std::unique_ptr<BodySide> side;
    std::vector<PosePoint> script;
    LoopOptions options;
    std::atomic<bool> stop{false};

    Held() {
        const DeviceInfo info;
        mapping = fit_mapping(body, loads.tools[0], info, passive_gains(info, 1e-3, 0).stiffness);
        PressScript press;
        press.duration = 600, press.period = 600;  // a slow press: 150 s until it is deepest
        press.depth = 2;
        script = press_script(body, loads.tools[0], mapping, press);
        step.dt = dt;
        side = std::make_unique<BodySide>(body, loads, 0, step, mapping);
        options.realtime = false;
        options.duration = 0;
    }
};

WindowOptions showing(Feeling& feeling) {
    WindowOptions options;
    options.feeling = &feeling;
    options.size = {{900, 600}};
    options.camera = CameraOption{0, 0, 1};
    options.remember = false;
    return options;
}

/// Frames until it holds; false after 20 seconds.
template <class Condition>
bool until(Window& window, Condition condition) {
    const double start = glfwGetTime();
    while (glfwGetTime() - start < 20) {
        if (!window.frame()) return false;
        if (condition()) return true;
    }
    return false;
}

/// Pixels of the colour the device's point and the proxy have, in a square about a place.
int marks(const Image& image, double x, double y, int around) {
    int count = 0;
    for (int row = std::max(0, int(y) - around); row < std::min(image.height, int(y) + around); ++row)
        for (int column = std::max(0, int(x) - around); column < std::min(image.width, int(x) + around);
             ++column) {
            const std::uint8_t* p = &image.rgb[3 * (std::size_t(row) * image.width + column)];
            count += std::abs(p[0] - 200) < 12 && std::abs(p[1] - 20) < 12 && std::abs(p[2] - 120) < 12;
        }
    return count;
}

}  // namespace

TEST(Feeling, TheWindowShowsHandBodyAndReportWhileTheyRun) {
    NEED_DISPLAY();
    Held held;
    std::vector<PosePoint> quick = held.script;
    for (PosePoint& p : quick) p.time /= 100;
    SimulatedHand device(quick, 1000);
    Feeling feeling(*held.side, 0, dt, device, held.options, held.stop);
    Window window(showing(feeling));
    ASSERT_TRUE(until(window, [&] {
        const auto& felt = window.snapshot().felt;
        const auto& tools = window.snapshot().bodies[0].tools;
        return felt && felt->heard && felt->report && felt->force.norm() > 0.05 && !tools.empty() &&
               tools[0].newton.norm() > 0;
    }));
    const FeltHand felt = *window.snapshot().felt;
    const auto [x, y] = window.on_screen(felt.proxy);
    EXPECT_GT(marks(window.keep_picture(), x, y, 40), 20);
    // Pressed downwards: the proxy is behind the device, by how far is a matter of the machine's pace, and
    // pulls the hand back.
    EXPECT_GT(felt.proxy.z(), felt.device.z());
    EXPECT_GT(felt.force.z(), 0);
    ASSERT_EQ(window.snapshot().bodies[0].tools.size(), 1u);
    EXPECT_LT((window.snapshot().bodies[0].tools[0].pose().position - window.snapshot().felt->proxy).norm(),
              0.3);
    EXPECT_LT(window.snapshot().bodies[0].tools[0].newton.z(), 0);  // on the body
    // It goes on, in both threads.
    const std::uint64_t ticks = felt.report->servo.ticks, steps = window.snapshot().ticks;
    EXPECT_TRUE(until(window, [&] {
        return window.snapshot().felt->report->servo.ticks > ticks && window.snapshot().ticks > steps + 5;
    }));
    // What belongs to a body without a hand is left alone, and said where it was asked for.
    window.drop({"sphere"});
    EXPECT_NE(window.message().find("in the hand"), std::string::npos);
    window.key(GLFW_KEY_F4, true, 0);
    EXPECT_NE(window.message().find("pictures only"), std::string::npos);
    EXPECT_EQ(window.session(), nullptr);
    // The loop's end closes the window.
    held.stop = true;
    EXPECT_FALSE(until(window, [] { return false; }));
    const LoopReport report = feeling.finish();
    EXPECT_GT(report.servo.ticks, ticks);
    EXPECT_GE(report.servo.observer_least, 0);
}

// The device's point is under the pointer, in the plane it is in; the wheel takes it into the body and out
// again.
TEST(Feeling, TheMouseMovesTheTool) {
    NEED_DISPLAY();
    Held held;
    PointedDevice mouse("mouse", 1000);
    Feeling feeling(*held.side, 0, dt, mouse, held.options, held.stop, &mouse);
    Window window(showing(feeling));
    ASSERT_TRUE(until(window, [&] { return window.snapshot().felt && window.snapshot().felt->heard; }));
    const auto felt = [&] { return *window.snapshot().felt; };
    EXPECT_EQ(felt().force.norm(), 0);
    window.mouse_move(250, 200);
    const double depth = felt().device.z();
    EXPECT_TRUE(until(window, [&] {
        const auto [x, y] = window.on_screen(felt().device);
        return std::hypot(x - 250, y - 200) < 3;
    }));
    EXPECT_NEAR(felt().device.z(), depth, 1e-6);  // azimuth and elevation 0: the plane is that of x and y
    const auto [x, y] = window.on_screen({0, 0, 0});
    window.mouse_move(x, y);
    int clicks = 0;
    EXPECT_TRUE(until(window, [&] {
        if (felt().force.norm() > 0.1) return true;
        if (clicks < 60) window.scroll(1), ++clicks;
        return false;
    }));
    EXPECT_LT(felt().device.z(), depth - 0.1);
    for (int n = 0; n < clicks; ++n) window.scroll(-1);
    EXPECT_TRUE(until(window, [&] { return felt().force.norm() == 0; }));
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, true, 0);  // a button of the device, no grip
    window.mouse_button(GLFW_MOUSE_BUTTON_LEFT, false, 0);
    // With the right button the camera turns, and the tool stays.
    const double azimuth = window.camera().azimuth;
    window.mouse_button(GLFW_MOUSE_BUTTON_RIGHT, true, 0);
    window.mouse_move(x + 60, y);
    window.mouse_button(GLFW_MOUSE_BUTTON_RIGHT, false, 0);
    EXPECT_NE(window.camera().azimuth, azimuth);
    window.close();
    EXPECT_FALSE(window.frame());
    feeling.finish();
}

// Without a display and without a clock: the same run gives the same picture, with the hand in it.
TEST(Feeling, PicturesOfALockstepRunAreTheSame) {
    NEED_DISPLAY();
    Image pictures[2];
    Snapshot last;
    PictureRequest request;
    request.width = 900, request.height = 560, request.panel = true;
    request.camera = {0, 0, 1};
    for (Image& picture : pictures) {
        Held held;
        std::vector<PosePoint> quick = held.script;
        for (PosePoint& p : quick) p.time /= 400;
        SimulatedHand device(quick, 1000);
        held.options.lockstep = true;
        held.options.duration = 0.6;
        FeltView view(*held.side, 0, dt);
        view.see_every_step();
        view.attach(held.options);
        run_haptic(*held.side, dt, held.mapping, device, held.options);
        view.update();
        last = view.latest();
        Studio studio(request);
        picture = studio.picture(last, {});
    }
    EXPECT_EQ(difference(pictures[0], pictures[1]), 0);
    ASSERT_TRUE(last.felt && last.felt->heard && last.felt->report);
    EXPECT_GT(last.felt->force.norm(), 0.05);
    EXPECT_EQ(last.ticks, 120u);
    EXPECT_GT(marks(pictures[0], 285, 280, 280), 20);
    EXPECT_GT(covered(pictures[0], 0, 500, 60, 500), 0.05);
}
