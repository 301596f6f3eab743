#include "overlay.h"

#include <fmt/format.h>
#include <imgui.h>

#include <cmath>

#include "innerspring/record/colours.h"
#include "live.h"

namespace innerspring::viewer {

namespace {

constexpr ImU32 ink = IM_COL32(40, 42, 46, 255);

void text(ImDrawList& list, double x, double y, const std::string& words, double align = 0) {
    const ImVec2 size = ImGui::CalcTextSize(words.c_str());
    list.AddText({float(std::round(x - align * size.x)), float(std::round(y - size.y / 2))}, ink,
                 words.c_str());
}

void draw_legend(ImDrawList& list, ColourBy colour, const ValueRange& range, const Box2& box, double s) {
    const double tall = std::min(0.5 * box.height, 320 * s), wide = 14 * s;
    const double left = box.x + box.width - 68 * s, top = box.y + (box.height - tall) / 2;
    // So that it can be read over the body.
    list.AddRectFilled({float(left - 6 * s), float(top - 8 * s)},
                       {float(left + 66 * s), float(top + tall + 8 * s)}, IM_COL32(250, 250, 250, 170));
    constexpr int strips = 64;
    for (int n = 0; n < strips; ++n) {
        const Colour c = map_colour((n + 0.5) / strips);
        const double y1 = top + tall * (strips - n) / strips, y0 = top + tall * (strips - n - 1) / strips;
        list.AddRectFilled({float(left), float(y0)}, {float(left + wide), float(y1)},
                           IM_COL32(int(255 * c[0]), int(255 * c[1]), int(255 * c[2]), 255));
    }
    list.AddRect({float(left), float(top)}, {float(left + wide), float(top + tall)}, ink);
    const Ticks ticks = round_ticks(range.low, range.high);
    for (std::size_t n = 0; n < ticks.values.size(); ++n) {
        const double y = top + tall * (1 - (ticks.values[n] - range.low) / (range.high - range.low));
        list.AddLine({float(left + wide), float(y)}, {float(left + wide + 4 * s), float(y)}, ink);
        text(list, left + wide + 7 * s, y, ticks.labels[n]);
    }
    std::string name(legend_of(colour));
    if (ticks.exponent != 0) name = fmt::format("{}  x 1e{}", name, ticks.exponent);
    const float wide_name = ImGui::CalcTextSize(name.c_str()).x;
    list.AddRectFilled({float(box.x + box.width - 18 * s) - wide_name, float(top - 26 * s)},
                       {float(box.x + box.width - 2 * s), float(top - 8 * s)}, IM_COL32(250, 250, 250, 170));
    text(list, box.x + box.width - 10 * s, top - 17 * s, name, 1);
}

/// The force of each tool at the tail of its arrow.
void draw_forces(ImDrawList& list, const BodySnapshot& body, const Camera& camera, const Box2& box,
                 double s) {
    for (const TouchingTool& tool : body.tools) {
        const double newton = tool.newton.norm();
        if (!(newton > 0)) continue;
        const auto [x0, y0] = project(camera, box, tool.place);
        const auto [x1, y1] =
            project(camera, box, tool.place - arrow_length(body, newton) / newton * tool.newton);
        const std::string words = fmt::format("{:.3g} N", newton);
        const ImVec2 size = ImGui::CalcTextSize(words.c_str());
        // Beyond the tail, beside the arrow where that points at the eye.
        const double wide = size.x / 2 + 4 * s, tall = size.y / 2 + 2 * s,
                     seen = std::hypot(x1 - x0, y1 - y0);
        const double x = x1 + (seen > 1 ? (x1 - x0) / seen : 0) * (wide + 8 * s),
                     y = y1 + (seen > 1 ? (y1 - y0) / seen : -1) * (tall + 8 * s);
        list.AddRectFilled({float(x - wide), float(y - tall)}, {float(x + wide), float(y + tall)},
                           IM_COL32(250, 250, 250, 190));
        text(list, x, y, words, 0.5);
    }
}

}  // namespace

std::array<double, 2> project(const Camera& camera, const Box2& box, const Vector& place) {
    const Eigen::Vector4d clip = camera.projection(box.width / box.height) * camera.view() *
                                 Eigen::Vector4d(place.x(), place.y(), place.z(), 1);
    return {box.x + box.width * (clip.x() / clip.w() + 1) / 2,
            box.y + box.height * (1 - clip.y() / clip.w()) / 2};
}

double round_length(double most) {
    const double power = std::pow(10, std::floor(std::log10(most)));
    for (double digit : {5.0, 2.0})
        if (digit * power <= most) return digit * power;
    return power;
}

std::string length_text(double metres) {
    if (metres >= 0.9995) return fmt::format("{:.3g} m", metres);
    if (metres >= 0.009995) return fmt::format("{:.3g} cm", 100 * metres);
    return fmt::format("{:.3g} mm", 1000 * metres);
}

void draw_overlay(const Snapshot& snapshot, std::size_t n, ColourBy colour, const ValueRange& range,
                  const Camera& camera, const Box2& box, double s) {
    const BodySnapshot& body = snapshot.bodies[n];
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.PushClipRect({float(box.x), float(box.y)}, {float(box.x + box.width), float(box.y + box.height)});

    double y = box.y + 16 * s;
    std::string title = body.surface->name;
    if (body.simulated) title += fmt::format(", scheme {}", to_string(body.scheme));
    text(list, box.x + 12 * s, y, title);
    text(list, box.x + 12 * s, y += 17 * s,
         fmt::format("t = {:.3f} s   volume {:+.4f} %", snapshot.time, body.volume_variation_percent));
    if (const double newton = force_sum(body); newton > 0)
        text(list, box.x + 12 * s, y += 17 * s, fmt::format("force {:.3g} N", newton));

    for (const TouchingTool& tool : body.tools)
        if (const double newton = tool.newton.norm(); newton > 0)
            text(list, box.x + 12 * s, y += 17 * s, fmt::format("{} {:.3g} N", tool.tool.name, newton));
    draw_forces(list, body, camera, box, s);
    if (snapshot.felt && snapshot.felt->heard) {
        text(list, box.x + 12 * s, y += 17 * s,
             fmt::format("on the hand {:.3g} N", snapshot.felt->force.norm()));
        draw_felt(*snapshot.felt, camera, box, s);
    }

    const bool last = n + 1 == snapshot.bodies.size();
    if (last && colour != ColourBy::plain && range.low < range.high && box.width > 200 * s &&
        box.height > 160 * s)
        draw_legend(list, colour, range, box, s);

    const double metres_per_point = camera.half_height(box.width / box.height) / (box.height / 2);
    const double length = round_length(std::min(0.3 * box.width, 160 * s) * metres_per_point);
    const double wide = length / metres_per_point, left = box.x + 12 * s,
                 bottom = box.y + box.height - 14 * s;
    for (const auto& [x0, y0, x1, y1] :
         {std::array{left, bottom, left + wide, bottom},
          std::array{left, bottom - 4 * s, left, bottom + 4 * s},
          std::array{left + wide, bottom - 4 * s, left + wide, bottom + 4 * s}})
        list.AddLine({float(x0), float(y0)}, {float(x1), float(y1)}, ink, float(1.5 * s));
    text(list, left + wide / 2, bottom - 11 * s, length_text(length), 0.5);
    list.PopClipRect();
}

}  // namespace innerspring::viewer
