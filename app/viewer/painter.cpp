#include "painter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "gui.h"
#include "innerspring/mesh/error.h"
#include "overlay.h"

namespace innerspring::viewer {

namespace {

/// The silhouette takes this share of what is left beside heading and legend.
constexpr double filled = 0.86;

/// What stays from one picture to the next.
struct Easel {
    Offscreen context;
    Gui gui{1};
    Renderer renderer;
    std::optional<Canvas> canvas;
    int width = 0, height = 0;
    ~Easel() { context.make_current(); }
};

/// From the direction of `look`, and as near as all positions are seen beside the legend's column and
/// between lines of `heading` at top and bottom [point].
Camera camera_of(const PictureOptions& options, Positions frame, double room, double heading) {
    Camera camera;
    const Vector back = -options.look.stableNormalized();
    camera.azimuth = std::atan2(back.x(), back.z()) * 180 / std::numbers::pi;
    camera.elevation = std::clamp(std::asin(back.y()) * 180 / std::numbers::pi, -89.9, 89.9);
    const auto [lower, upper] = bounding_box(frame);
    fit(camera, lower, upper);
    const Box2 all{0, 0, double(options.width), double(options.height)};
    camera.aside = room / all.width;
    const double half_width = (all.width - room) / 2, half_height = all.height / 2 - heading;
    for (int n = 0; n < 4; ++n) {  // nearer, perspective is stronger: again
        double taken = 0;
        for (const Vector& x : frame) {
            const auto [px, py] = project(camera, all, x);
            taken = std::max(
                {taken, std::abs(px - half_width) / half_width, std::abs(py - all.height / 2) / half_height});
        }
        if (taken > 0) zoom(camera, filled / taken);
    }
    return camera;
}

ValueRange range_of(std::span<const double> values, const PictureOptions& options) {
    if (values.empty()) return {};
    if (options.low != options.high) return {options.low, options.high};
    Drawn drawn;
    drawn.values.assign(values.begin(), values.end());
    return viewer::range_of(std::span<const Drawn>(&drawn, 1),
                            ColourBy::mass);  // any without an end of its own
}

Image paint(Easel& easel, Positions x, Triangles triangles, std::span<const double> values,
            const PictureOptions& options, Positions frame) {
    easel.context.make_current();
    if (easel.width != options.width || easel.height != options.height)
        easel.canvas.emplace(options.width, options.height);
    easel.width = options.width, easel.height = options.height;
    if (frame.empty()) frame = x;

    BodySnapshot body;
    SurfaceMesh rest{options.title, {frame.begin(), frame.end()}, {triangles.begin(), triangles.end()}};
    if (frame.size() != x.size()) rest.positions.assign(x.begin(), x.end());
    body.surface = std::make_shared<const Surface>(surface_of(rest));
    Drawn drawn{{x.begin(), x.end()}, vertex_normals(x, triangles), {values.begin(), values.end()}};
    Look look;
    look.colour = values.empty() ? ColourBy::plain : ColourBy::displacement;
    look.wireframe = options.edges;

    const Box2 all{0, 0, double(options.width), double(options.height)};
    const double heading = options.title.empty() ? 0 : 30, room = legend_room(look.colour, all, 1);
    const Camera camera = camera_of(options, frame, room, heading);

    Marks marks;
    if (!options.title.empty()) marks.heading = {options.title};
    marks.range = range_of(values, options);
    if (room > 0) marks.legend = options.legend.empty() ? " " : options.legend;
    easel.canvas->bind();
    easel.gui.begin(all.width, all.height, 1, 1.0 / 60, {});
    easel.renderer.draw(0, body, drawn, look, marks.range, camera,
                        Viewport{0, 0, options.width, options.height});
    draw_marks(marks, camera, all, 1);
    easel.gui.end();
    return easel.canvas->read();
}

}  // namespace

Painter make_painter() {
    return
        [easel = std::make_shared<Easel>()](Positions x, Triangles triangles, std::span<const double> values,
                                            const PictureOptions& options, Positions frame) {
            if (options.up != Vector(Vector::UnitY()) || x.empty() || triangles.empty())
                return draw(x, triangles, values, options, frame);
            return paint(*easel, x, triangles, values, options, frame);
        };
}

Painter best_painter() {
    try {
        return make_painter();
    } catch (const RunError&) {
        return draw;
    }
}

}  // namespace innerspring::viewer
