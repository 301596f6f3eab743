#include "stage.h"

#include <algorithm>
#include <cmath>

namespace innerspring::viewer {

Box2 part_of(const Box2& box, std::size_t n, std::size_t count) {
    const double width = box.width / double(count);
    return {box.x + double(n) * width, box.y, width, box.height};
}

void make_room(Camera& camera, const Snapshot& snapshot, ColourBy colour, const Box2& box, double scale) {
    const double count = double(snapshot.bodies.size()), width = box.width / count;
    camera.aside = legend_room(colour, {0, 0, width, box.height}, scale) / width / count;
}

void fit(Camera& camera, const Snapshot& snapshot) {
    Vector lower = snapshot.bodies[0].surface->lower, upper = snapshot.bodies[0].surface->upper;
    for (const BodySnapshot& body : snapshot.bodies) {
        lower = lower.cwiseMin(body.surface->lower);
        upper = upper.cwiseMax(body.surface->upper);
    }
    fit(camera, lower, upper);
}

Stage::Aim Stage::aim(const Snapshot& snapshot, const Camera& camera, const Box2& box, double x,
                      double y) const {
    const std::size_t count = snapshot.bodies.size();
    const double share = (x - box.x) / box.width * double(count);
    const std::size_t body = std::size_t(std::clamp(std::floor(share), 0.0, double(count - 1)));
    const Box2 part = part_of(box, body, count);
    return {body, camera.ray(2 * (x - part.x) / part.width - 1, 1 - 2 * (y - part.y) / part.height,
                             part.width / part.height)};
}

void Stage::draw(const Snapshot& snapshot, const Look& look, const Camera& camera, const Box2& box,
                 double window_height, double pixels, double scale, double settle) {
    const std::size_t count = snapshot.bodies.size();
    drawn_.resize(count);
    for (std::size_t n = 0; n < count; ++n) make_drawn(snapshot.bodies[n], look.colour, drawn_[n]);
    const ValueRange now = viewer::range_of(drawn_, look.colour);
    if (look.colour != range_of_ || settle <= 0 || range_.zero || !(range_.low < range_.high)) {
        range_ = now;
        range_of_ = look.colour;
    } else {
        // Wider at once, narrower over a second: the colours do not flicker.
        const double share = std::min(1.0, settle);
        range_.low = now.low < range_.low ? now.low : range_.low + share * (now.low - range_.low);
        range_.high = now.high > range_.high ? now.high : range_.high + share * (now.high - range_.high);
        range_.zero = now.zero;
    }
    for (std::size_t n = 0; n < count; ++n) {
        const Box2 part = part_of(box, n, count);
        const auto pixel = [&](double points) { return int(std::lround(points * pixels)); };
        const Viewport viewport{pixel(part.x), pixel(window_height - part.y - part.height),
                                std::max(1, pixel(part.x + part.width) - pixel(part.x)),
                                std::max(1, pixel(part.height))};
        renderer_.draw(n, snapshot.bodies[n], drawn_[n], look, range_, camera, viewport);
        draw_overlay(snapshot, n, look.colour, range_, camera, part, scale);
    }
}

}  // namespace innerspring::viewer
