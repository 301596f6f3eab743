#include "innerspring/haptic/press_script.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace innerspring {

std::vector<PosePoint> press_script(const Body& body, const Tool& tool, const HandMapping& mapping,
                                    const PressScript& script) {
    if (!(script.direction.norm() > 0 && std::isfinite(script.direction.norm())))
        throw InputError("haptic: the direction of the press must not be zero");
    if (!(script.period > 0 && script.duration > 0 && std::isfinite(script.duration / script.period)) ||
        script.duration > 1e5)
        throw InputError("haptic: period and duration of the press must be positive, and at most 1e5 s");
    if (!std::isfinite(script.depth) || !std::isfinite(script.slide))
        throw InputError("haptic: depth and slide of the press must be finite");
    const Vector n = script.direction.normalized();
    Vector top = body.rest.positions.front();
    for (const Vector& x : body.rest.positions)
        if (n.dot(x) < n.dot(top)) top = x;
    const Vector across = n.unitOrthogonal();
    const double size = tool.shape == ToolShape::mesh ? tool.mesh->radius : tool.radius + tool.length / 2;
    const double clear = 0.1 * body.radius, R = body.radius;
    const auto smooth = [](double s) {
        return (1 - std::cos(std::numbers::pi * std::clamp(s, 0.0, 1.0))) / 2;
    };
    std::vector<PosePoint> points;
    const auto count = static_cast<std::size_t>(std::ceil(script.duration * 100));
    for (std::size_t k = 0; k <= count; ++k) {
        const double time = double(k) / 100, s = 4 * std::fmod(time / script.period, 1.0);
        // In within [0, 1], held to 2, across and back to 3, out to 3.5.
        const double in = smooth(s) * (1 - smooth((s - 3) * 2));
        const double aside = smooth((s - 2) * 2) * (1 - smooth((s - 2.5) * 2));
        const Vector x = top - n * (size + clear) + n * in * (clear + script.depth * R) +
                         across * (aside * script.slide * R);
        points.push_back({time, {mapping.to_hand(x)}});
    }
    return points;
}

}  // namespace innerspring
