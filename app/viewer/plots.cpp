#include "plots.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace innerspring::viewer {

namespace {

constexpr std::size_t most_samples = 600;
constexpr ImU32 curve_colours[] = {IM_COL32(31, 90, 160, 255), IM_COL32(205, 92, 20, 255)};

using Curve = std::function<double(const History::Sample&)>;

void plot(const char* name, const char* unit, const std::vector<std::pair<std::string, Curve>>& curves,
          const std::deque<History::Sample>& samples, double s) {
    double low = INFINITY, high = -INFINITY;
    for (const auto& sample : samples)
        for (const auto& [label, value] : curves)
            low = std::min(low, value(sample)), high = std::max(high, value(sample));
    if (low > high) low = 0, high = 1;
    low = std::min(low, 0.0), high = std::max(high, 0.0);
    if (high - low < 1e-12) high = low + 1;

    std::string heading = fmt::format("{} [{}]", name, unit);
    ImGui::TextUnformatted(heading.c_str());
    for (std::size_t n = 0; n < curves.size(); ++n) {
        ImGui::SameLine();
        const double now = samples.empty() ? 0 : curves[n].second(samples.back());
        ImGui::TextColored(ImGui::ColorConvertU32ToFloat4(curve_colours[n]), "%s",
                           fmt::format("{}{:.4g}", curves[n].first, now).c_str());
    }
    const ImVec2 at = ImGui::GetCursorScreenPos();
    // The ends of the scale stand beside the curves.
    const std::string top = fmt::format("{:.3g}", high), bottom = fmt::format("{:.3g}", low);
    const float gutter = float(62 * s), wide = ImGui::GetContentRegionAvail().x - gutter,
                tall = float(36 * s);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.AddRectFilled(at, {at.x + wide, at.y + tall}, IM_COL32(238, 240, 243, 255));
    auto y_of = [&](double v) { return at.y + tall - 2 - float((v - low) / (high - low)) * (tall - 4); };
    list.AddLine({at.x, y_of(0)}, {at.x + wide, y_of(0)}, IM_COL32(150, 150, 150, 255));
    if (samples.size() > 1) {
        const double from = samples.front().time, span = std::max(1e-9, samples.back().time - from);
        std::vector<ImVec2> points;
        for (std::size_t n = 0; n < curves.size(); ++n) {
            points.clear();
            for (const auto& sample : samples)
                points.push_back(
                    {at.x + float((sample.time - from) / span) * wide, y_of(curves[n].second(sample))});
            list.AddPolyline(points.data(), int(points.size()), curve_colours[n], 0, float(1.5 * s));
        }
    }
    const float beside = at.x + wide + float(5 * s);
    list.AddText({beside, at.y}, IM_COL32(90, 90, 90, 255), top.c_str());
    list.AddText({beside, at.y + tall - ImGui::GetTextLineHeight()}, IM_COL32(90, 90, 90, 255),
                 bottom.c_str());
    ImGui::Dummy({wide + gutter, tall});
}

}  // namespace

void History::add(const Snapshot& snapshot) {
    Sample sample{snapshot.time,
                  {},
                  {},
                  {},
                  snapshot.bodies[0].step_ms,
                  snapshot.bodies[0].kinetic + snapshot.bodies[0].elastic};
    for (const BodySnapshot& body : snapshot.bodies) {
        sample.volume_percent.push_back(body.volume_variation_percent);
        sample.force.push_back(force_sum(body));
        sample.tool_force.push_back(tool_force_sum(body));
    }
    // Time that goes back (reset, undo) or other bodies: another story.
    if (!samples_.empty() && (sample.time < samples_.back().time ||
                              sample.volume_percent.size() != samples_.back().volume_percent.size()))
        samples_.clear();
    if (!samples_.empty() && sample.time == samples_.back().time) samples_.pop_back();
    samples_.push_back(std::move(sample));
    if (samples_.size() > most_samples) samples_.pop_front();
}

void draw_plots(const History& history, const Snapshot& snapshot, double s) {
    std::vector<std::pair<std::string, Curve>> volume, force, tools;
    bool pulled = false, touched = false;
    for (std::size_t n = 0; n < snapshot.bodies.size(); ++n) {
        const std::string label =
            snapshot.bodies.size() > 1 ? fmt::format("{} ", to_string(snapshot.bodies[n].scheme)) : "";
        volume.emplace_back(label, [n](const History::Sample& x) { return x.volume_percent[n]; });
        force.emplace_back(label, [n](const History::Sample& x) { return x.force[n]; });
        tools.emplace_back(label, [n](const History::Sample& x) { return x.tool_force[n]; });
    }
    const auto& samples = history.samples();
    for (const History::Sample& sample : samples)
        for (std::size_t n = 0; n < sample.force.size(); ++n)
            pulled |= sample.force[n] > 0, touched |= sample.tool_force[n] > 0;
    plot("volume variation", "%", volume, samples, s);
    if (!snapshot.bodies[0].simulated) return;
    if (pulled || !touched) plot("force", "N", force, samples, s);
    if (touched) plot("force of tools", "N", tools, samples, s);
    if (snapshot.bodies[0].step_ms > 0)
        plot("time of a step", "ms", {{"", [](const History::Sample& x) { return x.step_ms; }}}, samples, s);
    plot("energy", "J", {{"", [](const History::Sample& x) { return x.energy; }}}, samples, s);
}

}  // namespace innerspring::viewer
