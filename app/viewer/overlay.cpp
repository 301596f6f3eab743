#include "overlay.h"

#include <fmt/format.h>
#include <imgui.h>

#include <cmath>

#include "innerspring/record/colours.h"
#include "live.h"

namespace innerspring::viewer {

namespace {

constexpr ImU32 ink = IM_COL32(40, 42, 46, 255), paper = IM_COL32(250, 250, 250, 190);

void text(ImDrawList& list, double x, double y, const std::string& words, double align = 0) {
    const ImVec2 size = ImGui::CalcTextSize(words.c_str());
    list.AddText({float(std::round(x - align * size.x)), float(std::round(y - size.y / 2))}, ink,
                 words.c_str());
}

/// The colours in the upper right corner, which a body seldom reaches; `left` and `below`: where the heading
/// ends, beside or under which the legend's name has its place.
void draw_legend(ImDrawList& list, std::string name, const ValueRange& range, const Box2& box, double left,
                 double below, double s) {
    const Ticks ticks = round_ticks(range.low, range.high);
    if (ticks.exponent != 0) name = fmt::format("{}  x 1e{}", name, ticks.exponent);
    const double right = box.x + box.width, wide_name = ImGui::CalcTextSize(name.c_str()).x;
    const double line = right - wide_name - 24 * s > left ? box.y + 16 * s : below, top = line + 16 * s;
    const double tall = std::min({0.5 * box.height, 320 * s, box.y + box.height - 110 * s - top});
    if (tall < 40 * s) return;
    const double wide = 14 * s, bar = right - 68 * s;
    // So that it can be read over a body all the same.
    list.AddRectFilled({float(right - 18 * s - wide_name), float(line - 9 * s)},
                       {float(right - 2 * s), float(line + 9 * s)}, paper);
    list.AddRectFilled({float(bar - 6 * s), float(top - 7 * s)},
                       {float(right - 2 * s), float(top + tall + 8 * s)}, paper);
    text(list, right - 10 * s, line, name, 1);
    constexpr int strips = 64;
    for (int n = 0; n < strips; ++n) {
        const Colour c = map_colour((n + 0.5) / strips);
        const double y1 = top + tall * (strips - n) / strips, y0 = top + tall * (strips - n - 1) / strips;
        list.AddRectFilled({float(bar), float(y0)}, {float(bar + wide), float(y1)},
                           IM_COL32(int(255 * c[0]), int(255 * c[1]), int(255 * c[2]), 255));
    }
    list.AddRect({float(bar), float(top)}, {float(bar + wide), float(top + tall)}, ink);
    for (std::size_t n = 0; n < ticks.values.size(); ++n) {
        const double y = top + tall * (1 - (ticks.values[n] - range.low) / (range.high - range.low));
        list.AddLine({float(bar + wide), float(y)}, {float(bar + wide + 4 * s), float(y)}, ink);
        text(list, bar + wide + 7 * s, y, ticks.labels[n]);
    }
}

void draw_scale_bar(ImDrawList& list, const Camera& camera, const Box2& box, double s) {
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
}

/// Where x, y and z go, and gravity, in the lower right corner.
void draw_axes(ImDrawList& list, const Camera& camera, const Vector& gravity, const Box2& box, double s) {
    const double x0 = box.x + box.width - 46 * s, y0 = box.y + box.height - 50 * s;
    const auto arrow = [&](const Vector& along, const char* name, ImU32 colour, double length) {
        const double x = camera.right().dot(along), y = -camera.up().dot(along);
        list.AddLine({float(x0), float(y0)}, {float(x0 + length * x), float(y0 + length * y)}, colour,
                     float(1.5 * s));
        const ImVec2 size = ImGui::CalcTextSize(name);
        // Beyond the end, and off the middle where it points at the eye.
        const double beyond = length + 8 * s;
        list.AddText({float(std::round(x0 + beyond * x - size.x / 2)),
                      float(std::round(y0 + beyond * y - size.y / 2))},
                     colour, name);
    };
    arrow(Vector::UnitX(), "x", IM_COL32(180, 50, 30, 255), 20 * s);
    arrow(Vector::UnitY(), "y", IM_COL32(30, 120, 50, 255), 20 * s);
    arrow(Vector::UnitZ(), "z", IM_COL32(40, 70, 180, 255), 20 * s);
    if (!gravity.isZero(0)) arrow(gravity.stableNormalized(), "g", ink, 34 * s);
}

/// The force of each pull and tool at the tail of its arrow.
void draw_forces(ImDrawList& list, const BodySnapshot& body, const Camera& camera, const Box2& box,
                 double s) {
    const auto label = [&](const Vector& force, const Vector& place) {
        const double newton = force.norm();
        if (!(newton > 0)) return;
        const auto [x0, y0] = project(camera, box, place);
        const auto [x1, y1] = project(camera, box, place - arrow_length(body, newton) / newton * force);
        const std::string words = fmt::format("{:.3g} N", newton);
        const ImVec2 size = ImGui::CalcTextSize(words.c_str());
        // Beyond the tail, beside the arrow where that points at the eye.
        const double wide = size.x / 2 + 4 * s, tall = size.y / 2 + 2 * s,
                     seen = std::hypot(x1 - x0, y1 - y0);
        const double x = x1 + (seen > 1 ? (x1 - x0) / seen : 0) * (wide + 8 * s),
                     y = y1 + (seen > 1 ? (y1 - y0) / seen : -1) * (tall + 8 * s);
        list.AddRectFilled({float(x - wide), float(y - tall)}, {float(x + wide), float(y + tall)}, paper);
        text(list, x, y, words, 0.5);
    };
    constexpr std::size_t most_labels = 12;  // more only hide the body
    if (body.pulls.size() <= most_labels)
        for (const Pull& pull : body.pulls) label(pull.newton, pull.place);
    for (const TouchingTool& tool : body.tools) label(tool.newton, tool.place);
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

double legend_room(ColourBy colour, const Box2& box, double scale) {
    const bool shown = colour != ColourBy::plain && box.width > 200 * scale && box.height > 160 * scale;
    return shown ? 76 * scale : 0;
}

void draw_marks(const Marks& marks, const Camera& camera, const Box2& box, double s) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.PushClipRect({float(box.x), float(box.y)}, {float(box.x + box.width), float(box.y + box.height)});
    double y = box.y + 16 * s, wide = 0;
    for (const std::string& line : marks.heading) {
        text(list, box.x + 12 * s, y, line);
        y += 17 * s;
        wide = std::max(wide, 12 * s + ImGui::CalcTextSize(line.c_str()).x);
    }
    if (!marks.legend.empty() && marks.range.low < marks.range.high)
        draw_legend(list, marks.legend, marks.range, box, box.x + wide, y, s);
    draw_scale_bar(list, camera, box, s);
    if (box.width > 260 * s && box.height > 160 * s) draw_axes(list, camera, marks.gravity, box, s);
    list.PopClipRect();
}

void draw_overlay(const Snapshot& snapshot, std::size_t n, ColourBy colour, const ValueRange& range,
                  const Camera& camera, const Box2& box, double s) {
    const BodySnapshot& body = snapshot.bodies[n];
    Marks marks;
    marks.gravity = snapshot.gravity;
    marks.heading.push_back(body.surface->name);
    if (body.simulated) marks.heading.back() += fmt::format(", scheme {}", to_string(body.scheme));
    if (snapshot.replaying) marks.heading.back() += ", replaying";
    marks.heading.push_back(
        fmt::format("t = {:.3f} s   volume {:+.4f} %", snapshot.time, body.volume_variation_percent));
    if (const double newton = force_sum(body); newton > 0)
        marks.heading.push_back(fmt::format("force {:.3g} N", newton));
    for (const TouchingTool& tool : body.tools)
        if (const double newton = tool.newton.norm(); newton > 0)
            marks.heading.push_back(fmt::format("{} {:.3g} N", tool.tool.name, newton));
    if (snapshot.felt && snapshot.felt->heard)
        marks.heading.push_back(fmt::format("on the hand {:.3g} N", snapshot.felt->force.norm()));

    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.PushClipRect({float(box.x), float(box.y)}, {float(box.x + box.width), float(box.y + box.height)});
    draw_forces(list, body, camera, box, s);
    if (snapshot.felt && snapshot.felt->heard) draw_felt(*snapshot.felt, camera, box, s);
    list.PopClipRect();

    const bool last = n + 1 == snapshot.bodies.size();
    if (last && legend_room(colour, box, s) > 0) marks.legend = legend_of(colour), marks.range = range;
    draw_marks(marks, camera, box, s);
}

}  // namespace innerspring::viewer
