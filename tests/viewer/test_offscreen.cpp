#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "display.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/record/run.h"
#include "offscreen.h"
#include "open.h"
#include "painter.h"
#include "pictures.h"
#include "support/temporary_folder.h"

using namespace innerspring;
using namespace innerspring::viewer;

namespace {

Snapshot after(Rig& rig, int steps) {
    for (int n = 0; n < steps; ++n) rig.advance();
    Capture capture;
    Snapshot snapshot;
    capture(rig, snapshot);
    return snapshot;
}

PictureRequest square(int size) {
    PictureRequest request;
    request.width = request.height = size;
    return request;
}

}  // namespace

/// Off screen no display is needed; asking for one first keeps the drivers loaded under a sanitizer.
#define NEED_OPENGL()                 \
    have_display();                   \
    try {                             \
        const Offscreen there;        \
    } catch (const RunError& error) { \
        GTEST_SKIP() << error.what(); \
    }

// Seen from d away, a ball of radius R fills the cone of half-angle asin(R/d): on the picture a disc of
// radius tan(asin(R/d)) / tan(field/2) of half the picture.
TEST(Offscreen, ASphereCoversTheShareOfItsCone) {
    NEED_OPENGL();
    const auto rig = open_rig({{"icosphere:vertices=10000"}, [](Scene& s) { s.gravity = Vector::Zero(); }});
    PictureRequest request = square(400);
    request.look.colour = ColourBy::plain;
    request.look.ground = false;
    for (double zoomed : {0.6, 1.0, 1.5}) {
        request.camera.zoom = zoomed;
        Studio studio(request);
        const Image image = studio.picture(after(*rig, 0), {});
        const double half = 15 * std::numbers::pi / 180, distance = std::sqrt(3.0) / std::sin(half) / zoomed;
        const double disc = std::tan(std::asin(1 / distance)) / std::tan(half);
        EXPECT_NEAR(covered(image, 0, 400, 0, 400), std::numbers::pi * disc * disc / 4, 0.006) << zoomed;
    }
}

// The legend has a column of its own: the body is in the middle of what is left, whatever way it is seen.
TEST(Offscreen, TheBodyIsBesideTheLegend) {
    NEED_OPENGL();
    const auto rig = open_rig({{"icosphere:vertices=2562"}, [](Scene& s) { s.gravity = Vector::Zero(); }});
    const Snapshot snapshot = after(*rig, 0);
    PictureRequest request;
    request.width = 600, request.height = 400;
    request.look.ground = false;
    for (ColourBy colour : {ColourBy::stiffness, ColourBy::plain}) {
        request.look.colour = colour;
        request.camera = {200, -10, 1.2};
        const Image image = Studio(request).picture(snapshot, {});
        const double room = colour == ColourBy::plain ? 0 : 76;
        double count = 0, sum = 0;
        for (int y = 80; y < 320; ++y)
            for (int x = 0; x < 600 - 80; ++x)
                if (of_the_body(image, x, y)) ++count, sum += x + 0.5;
        ASSERT_GT(count, 1e4);
        EXPECT_NEAR(sum / count, (600 - room) / 2, 1) << to_string(colour);
    }
}

TEST(Offscreen, ColoursChangeWithTheLoadAndOnlyWithIt) {
    NEED_OPENGL();
    Studio studio(square(300));
    const auto rig = open_rig({{"breast:vertices=1000"}});
    const Image rest = studio.picture(after(*rig, 0), {});
    EXPECT_EQ(difference(rest, studio.picture(after(*rig, 0), {})), 0) << "the same picture twice";
    const Image loaded = studio.picture(after(*rig, 30), {});
    EXPECT_GT(difference(rest, loaded), 2);
}

// Law 1: under gravity every vertex of a sphere sinks alike, so its displacement has one colour and its
// strain none.
TEST(Offscreen, ASphereUnderGravityHasOneDisplacement) {
    const auto rig = open_rig({{"sphere:vertices=1000"}});
    const Snapshot snapshot = after(*rig, 200);
    Drawn drawn;
    make_drawn(snapshot.bodies[0], ColourBy::displacement, drawn);
    const double sink = 0.05 * 9.81 / (3 * (4 * std::numbers::pi / 3) * 10);  // M g R^2 / (3 V E), R = 1
    for (double u : drawn.values) EXPECT_NEAR(u, sink, 0.02 * sink);
    make_drawn(snapshot.bodies[0], ColourBy::strain, drawn);
    for (double e : drawn.values) EXPECT_NEAR(e, 0, 1e-2);
}

// The pressures of the inner springs, times the areas, along the normals, hold up a squeezed body: for a
// uniform inward displacement u of a sphere K = E A / R, so p = E u / R.
TEST(Offscreen, PressureOfAShrunkSphere) {
    const auto rig = open_rig({{"icosphere:vertices=4000"}});
    Snapshot snapshot = after(*rig, 0);
    BodySnapshot& body = snapshot.bodies[0];
    constexpr double share = 1e-3;
    for (std::size_t i = 0; i < body.u.size(); ++i)
        for (int k = 0; k < 3; ++k) body.u[i][k] = float(-share * body.surface->rest[i][k]);
    Drawn drawn;
    make_drawn(body, ColourBy::pressure, drawn);
    for (double p : drawn.values) EXPECT_NEAR(p, 10 * share, 0.03 * 10 * share);
    make_drawn(body, ColourBy::strain, drawn);
    for (double e : drawn.values) EXPECT_NEAR(e, 100 * ((1 - share) * (1 - share) - 1), 1e-3);
}

// Lines along what is stiffest, turned with a free body, and none where all directions are alike.
TEST(Offscreen, FibresAreDrawnWhereThereAreAny) {
    NEED_OPENGL();
    for (const bool fibres : {false, true}) {
        const auto rig = open_rig({{"sphere:vertices=600"}, [=](Scene& s) {
                                       if (!fibres) return;
                                       s.material.anisotropy.kind = Anisotropy::Kind::fibres;
                                       s.material.anisotropy.along = 40;
                                       s.material.anisotropy.direction = Vector(0, 1, 0);
                                   }});
        Snapshot snapshot = after(*rig, 0);
        PictureRequest request = square(240);
        request.look.ground = false;
        PictureRequest without = request;
        without.look.fibres = false;
        const Image plain = Studio(without).picture(snapshot, {});
        const Image lines = Studio(request).picture(snapshot, {});
        if (!fibres) {
            EXPECT_EQ(difference(plain, lines), 0);
            continue;
        }
        EXPECT_GT(difference(plain, lines), 0.5);
        snapshot.bodies[0].frame.R =
            Eigen::AngleAxisd(std::numbers::pi / 2, Vector::UnitZ()).toRotationMatrix();
        EXPECT_GT(difference(lines, Studio(request).picture(snapshot, {})), 0.5);
    }
}

TEST(Offscreen, EveryShapeColourAndLookIsDrawn) {
    NEED_OPENGL();
    for (std::string_view shape : shape_names()) {
        const auto rig = open_rig({{std::string(shape) + ":vertices=300"}});
        const Snapshot snapshot = after(*rig, 10);
        for (ColourBy colour : all_colours) {
            if (colour != ColourBy::displacement && shape != shape_names().front()) continue;
            PictureRequest request = square(160);
            request.look.colour = colour;
            const Image plain = Studio(request).picture(snapshot, {});
            EXPECT_GT(covered(plain, 0, 160, 0, 160), 0.08) << shape << " " << to_string(colour);
            EXPECT_LT(covered(plain, 0, 160, 0, 160), 0.8) << shape << " " << to_string(colour);
            if (colour != ColourBy::displacement || shape != shape_names().front()) continue;
            for (bool Look::*part :
                 {&Look::flat, &Look::wireframe, &Look::homes, &Look::tetrahedra, &Look::ground}) {
                PictureRequest other = request;
                other.look.*part = !(other.look.*part);
                EXPECT_GT(difference(plain, Studio(other).picture(snapshot, {})), 0.02) << shape;
            }
        }
    }
}

TEST(Offscreen, PicturesAndMoviesAreInSimulatedTime) {
    NEED_OPENGL();
    const TemporaryFolder folder("movie");
    PictureRequest request = square(120);
    request.after = 0.2, request.rate = 25;
    request.movie = folder.path / "frames";
    request.screenshot = folder.path / "last.png";
    const auto once = open_rig({{"breast:vertices=300"}});
    EXPECT_EQ(take_pictures(*once, request), 7) << "0, 0.04 ... 0.2 s and the screenshot";
    EXPECT_EQ(content(folder.path / "last.png"), content(request.movie / "frame_000005.png"));
    EXPECT_NE(content(request.movie / "frame_000000.png"), content(request.movie / "frame_000005.png"));
    const std::string first = content(folder.path / "last.png");
    request.movie.clear();
    const auto again = open_rig({{"breast:vertices=300"}});
    take_pictures(*again, request);
    EXPECT_EQ(content(folder.path / "last.png"), first) << "the same request, the same bytes";
    request.screenshot = folder.path / "missing" / "a.png";
    EXPECT_THROW(take_pictures(*again, request), RunError);
    request.after = -1;
    EXPECT_THROW(take_pictures(*again, request), InputError);
}

TEST(Offscreen, FramesOfASimulation) {
    NEED_OPENGL();
    const TemporaryFolder folder("offscreen-frames");
    Scene scene;
    scene.mesh = "breast:vertices=300";
    scene.duration = 0.3;
    run(scene, {.directory = folder.path});
    Playback playback(folder.path);
    PictureRequest request = square(120);
    request.after = 0.3;
    request.movie = folder.path / "movie";
    EXPECT_EQ(take_pictures(playback, request), 4);
    // The same moment stepped anew is the same picture but for its heading, as the frames hold the same
    // state.
    request.movie.clear();
    request.screenshot = folder.path / "last.png";
    take_pictures(playback, request);
    const Image played = Studio(request).picture(playback.snapshot(), {});
    const auto rig = open_rig({{"breast:vertices=300"}});
    const Image stepped = Studio(request).picture(after(*rig, 30), {});
    EXPECT_GT(covered(played, 0, 120, 40, 120), 0.1);
    EXPECT_NEAR(covered(played, 0, 120, 40, 120), covered(stepped, 0, 120, 40, 120), 0.01);
}

// The same picture by the library and by this renderer: a body that fills it, the colours' ends where the
// values are least and largest. They differ in how they look, not in what they say.
TEST(Offscreen, PaintsWhatTheLibraryDraws) {
    NEED_OPENGL();
    const SurfaceMesh mesh = make_shape("icosphere:vertices=2562");
    std::vector<double> height;
    for (const Vector& x : mesh.positions) height.push_back(x.y());
    PictureOptions options;
    options.width = 640, options.height = 480;
    options.title = "a title", options.legend = "height [m]";
    options.edges = false;
    const Painter paint = make_painter();
    for (const Painter& painter : {paint, best_painter(), Painter(draw)}) {
        const Image image = painter(mesh.positions, mesh.triangles, height, options, {});
        ASSERT_EQ(image.width, 640);
        ASSERT_EQ(image.height, 480);
        int left = 640, right = 0, top = 480, bottom = 0;
        for (int y = 24; y < 480; ++y)
            for (int x = 0; x < 520; ++x)
                if (of_the_body(image, x, y))
                    left = std::min(left, x), right = std::max(right, x), top = std::min(top, y),
                    bottom = std::max(bottom, y);
        EXPECT_NEAR(right - left, bottom - top, 3) << "a disc";
        EXPECT_GT(bottom - top, 0.7 * 480);
        // Dark blue below, yellow above.
        const auto at = [&](int row) {
            return &image.rgb[3 * (std::size_t(row) * 640 + (left + right) / 2)];
        };
        EXPECT_GT(at(top + 20)[0], at(top + 20)[2] + 50);
        EXPECT_GT(at(bottom - 20)[2], at(bottom - 20)[1]);
    }
    // Twice the same; with another size, without values, and in a range of one's own.
    const Image once = paint(mesh.positions, mesh.triangles, height, options, {});
    EXPECT_EQ(difference(once, paint(mesh.positions, mesh.triangles, height, options, mesh.positions)), 0);
    options.high = 10;
    EXPECT_GT(difference(once, paint(mesh.positions, mesh.triangles, height, options, {})), 1);
    options.width = options.height = 200;
    EXPECT_EQ(paint(mesh.positions, mesh.triangles, {}, options, {}).width, 200);
    // Seen with another side up it is the library's.
    options.up = Vector(1, 0, 0);
    EXPECT_EQ(difference(paint(mesh.positions, mesh.triangles, height, options, {}),
                         draw(mesh.positions, mesh.triangles, height, options)),
              0);
}

// The ball of a scene is where its path says, in pictures of the scene and of its frames.
TEST(Offscreen, ToolsOfASceneAreDrawnOnTheirPaths) {
    NEED_OPENGL();
    const TemporaryFolder folder("offscreen-tools");
    Scene scene;
    scene.mesh = "breast:vertices=300";
    scene.gravity = Vector::Zero();
    scene.duration = 0.4;
    SceneTool ball;
    ball.name = "ball";
    ball.radius = 0.3;
    ball.path = {{0, 0, 0, 1.6, 1, 0, 0, 0}, {0.2, 0, 0, 0.9, 1, 0, 0, 0}};
    scene.tools = {ball};
    run(scene, {.directory = folder.path});
    Playback playback(folder.path);
    PictureRequest request = square(200);
    request.camera = {90, 0, 0.7};  // from the side: the ball is at the left of the body
    request.look.colour = ColourBy::plain;
    request.look.ground = false;
    Studio studio(request);
    const auto blue_middle = [&](const Snapshot& snapshot) {
        const Image image = studio.picture(snapshot, {});
        double count = 0, sum = 0;
        for (int y = 60; y < image.height - 30; ++y)
            for (int x = 0; x < image.width; ++x) {
                const std::uint8_t* p = &image.rgb[3 * (std::size_t(y) * image.width + x)];
                if (p[2] > p[0] + 25) ++count, sum += x;
            }
        EXPECT_GT(count, 50);
        return sum / count;
    };
    Rig rig({scene});
    const double first = blue_middle(after(rig, 0));
    playback.show(0);
    ASSERT_EQ(playback.snapshot().bodies[0].tools.size(), 1u);
    EXPECT_NEAR(blue_middle(playback.snapshot()), first, 1);
    const Snapshot pressed = after(rig, 40);
    EXPECT_GT(blue_middle(pressed), first + 5) << "nearer to the body";
    EXPECT_GT(pressed.bodies[0].tools[0].newton.norm(), 0);
    playback.show(playback.frames() - 1);
    EXPECT_EQ(playback.snapshot().bodies[0].tools[0].pose().position, Vector(0, 0, 0.9));
    EXPECT_NEAR(blue_middle(playback.snapshot()), blue_middle(pressed), 3) << "the arrow hides some of it";

    Drawn drawn;
    make_drawn(pressed.bodies[0], ColourBy::contact, drawn);
    EXPECT_EQ(*std::max_element(drawn.values.begin(), drawn.values.end()), most_pressure(pressed.bodies[0]));
    EXPECT_EQ(*std::min_element(drawn.values.begin(), drawn.values.end()), 0);
}

// Capsule, floor and mesh are drawn too: they change the picture, and a mesh that is missing is said.
TEST(Offscreen, EveryToolIsDrawn) {
    NEED_OPENGL();
    const TemporaryFolder folder("offscreen-shapes");
    PictureRequest request = square(200);
    Studio studio(request);
    Scene scene;
    scene.mesh = "breast:vertices=300";
    Rig bare({scene});
    const Image without = studio.picture(after(bare, 0), {});
    for (const char* text :
         {"radius=0.2, length=0.5, axis=[1,0,0], at=[0,0.3,1.4]", "normal=[0,1,0], at=[0,-1.2,0]",
          "mesh=\"icosphere:vertices=200\", scale=0.3, at=[0,0.3,1.4]"}) {
        Scene with = scene;
        with.tools = {parse_tool(text)};
        Rig rig({with});
        EXPECT_GT(difference(studio.picture(after(rig, 0), {}), without), 0.5) << text;
    }
}

TEST(Offscreen, TwoBodiesAreSideBySide) {
    NEED_OPENGL();
    const auto rig = open_rig({{"breast:vertices=500"}, {}, {Scheme::B, Scheme::C}});
    PictureRequest request;
    request.width = 600, request.height = 300;
    const Image image = Studio(request).picture(after(*rig, 20), {});
    EXPECT_GT(covered(image, 0, 300, 60, 300), 0.15);
    EXPECT_GT(covered(image, 300, 520, 60, 300), 0.15);
}
