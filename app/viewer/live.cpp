#include "live.h"

#include <fmt/format.h>
#include <imgui.h>

#include <cmath>

#include "innerspring/haptic/loop.h"

namespace innerspring::viewer {

namespace {

const char* words(ServoHealth health) {
    switch (health) {
        case ServoHealth::good:
            return "well";
        case ServoHealth::stalled:
            return "the body is late: no force";
        case ServoHealth::faulty:
            return "fault: no force";
        case ServoHealth::lost:
            return "the device is lost";
    }
    return "";
}

void times(const char* label, const Histogram& h) {
    draw_row(label, fmt::format("{:.3g}  {:.3g}  {:.3g}  {:.3g} ms", h.quantile_ms(0.5), h.quantile_ms(0.99),
                                h.quantile_ms(0.999), h.max_ms()));
}

}  // namespace

void draw_row(const char* label, const std::string& value) {
    ImGui::TextDisabled("%s", label);
    ImGui::SameLine(ImGui::GetContentRegionMax().x * 0.42f);
    ImGui::TextUnformatted(value.c_str());
}

void draw_live(const FeltHand& felt) {
    if (felt.report) draw_row("device", felt.report->device.name);
    draw_row("state", words(felt.health));
    draw_row("force felt", fmt::format("{:.3f} N", felt.force.norm()));
    if (!felt.report) return;
    const LoopReport& r = *felt.report;
    const ServoStatistics& s = r.servo;
    draw_row("most; coupling", fmt::format("{:.3f} N, {:.0f} N/m", s.force_max, r.gains.stiffness));
    draw_row("servo", fmt::format("{:.1f} Hz, {} periods", r.rate_hz, s.ticks));
    if (s.work.count() > 0) {  // none in lockstep
        draw_row("", "p50  p99  p99.9  most");
        times("period error", s.period_error);
        times("work", s.work);
        draw_row("missed", fmt::format("{}, {} by our work", s.missed, s.missed_by_us));
    }
    draw_row("clamped, braked", fmt::format("{}, {}", s.clamped, s.braked));
    draw_row("observer, least", fmt::format("{:.2e} J", s.observer_least));
    draw_row("from the hand", fmt::format("{:.2e} J", s.observer_total));
    draw_row("stalls, faults", fmt::format("{}, {}; opened again {}", s.stalls, s.faults, r.reopened));
    draw_row("body", fmt::format("{:.0f} steps/s, {} vertices", r.body_steps_per_second, r.vertices));
}

void draw_felt(const FeltHand& felt, const Camera& camera, const Box2& box, double s) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const auto at = [&](const Vector& x) {
        const auto [px, py] = project(camera, box, x);
        return ImVec2(float(px), float(py));
    };
    constexpr ImU32 colour = IM_COL32(200, 20, 120, 255), paper = IM_COL32(255, 255, 255, 255);
    const ImVec2 device = at(felt.device), proxy = at(felt.proxy);
    list.AddLine(device, proxy, colour, float(1.5 * s));
    list.AddCircleFilled(device, float(4.5 * s), paper);
    list.AddCircleFilled(device, float(3.5 * s), colour);
    list.AddCircle(proxy, float(6 * s), colour, 0, float(1.5 * s));
}

}  // namespace innerspring::viewer
