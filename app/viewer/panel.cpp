#include "panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "live.h"

namespace innerspring::viewer {

namespace {

/// Over the logarithm, whatever the size of the numbers: a vertex may weigh a microgram.
bool slider(const char* label, double& value, double low, double high, const char* unit = "") {
    float t = float(std::log(value / low) / std::log(high / low));
    const std::string text = fmt::format("{:.4g}{}", value, unit);
    const bool moved = ImGui::SliderFloat(label, &t, 0, 1, text.c_str(), ImGuiSliderFlags_NoInput);
    if (moved) value = low * std::pow(high / low, double(t));
    return moved;
}

void draw_numbers(const Snapshot& snapshot) {
    for (const BodySnapshot& body : snapshot.bodies) {
        const std::string name = body.surface->name;
        ImGui::TextUnformatted(body.simulated
                                   ? fmt::format("{}, scheme {}", name, to_string(body.scheme)).c_str()
                                   : name.c_str());
        draw_row("vertices",
                 fmt::format("{}, {} triangles", body.surface->rest.size(), body.surface->triangles.size()));
        draw_row("volume", fmt::format("{:+.5f} %", body.volume_variation_percent));
        if (body.material.poisson > 0 && body.simulated)
            draw_row("pressure", fmt::format("{:.4g} Pa", body.pressure));
        draw_row("displacement", fmt::format("{:.4g} m at most", body.max_displacement));
        for (const TouchingTool& tool : body.tools)
            draw_row(fmt::format("tool {}", tool.tool.name).c_str(),
                     body.simulated ? fmt::format("{:.4g} N", tool.newton.norm()) : "");
        if (!body.tools.empty() && body.simulated)
            draw_row("contact", fmt::format("{:.4g} Pa at most", most_pressure(body)));
        if (body.simulated)
            draw_row("steps", fmt::format("{:g} s, {} in {}", snapshot.dt, body.integrator, body.substeps));
    }
    if (!snapshot.bodies[0].simulated) return;
    if (snapshot.steps_per_second == 0 && snapshot.bodies[0].step_ms == 0) return;  // no clock: off screen
    const bool slow = !snapshot.paused && snapshot.real_time_factor < 0.9 * snapshot.speed;
    draw_row("real-time factor", fmt::format("{:.2f}{}", snapshot.real_time_factor,
                                             slow ? fmt::format(" ({:g} asked for)", snapshot.speed) : ""));
    draw_row("steps per second",
             fmt::format("{:.0f}, {:.3g} ms each", snapshot.steps_per_second, snapshot.bodies[0].step_ms));
}

void draw_time(const Snapshot& snapshot, PanelActions& actions) {
    if (ImGui::Button(snapshot.paused ? "run###pause" : "pause###pause")) actions.pause = !snapshot.paused;
    ImGui::SameLine();
    if (ImGui::Button("step")) actions.step = true;
    ImGui::SameLine();
    if (ImGui::Button("reset")) actions.commands.push_back(Reset{});
    ImGui::SameLine();
    if (ImGui::Button("undo")) actions.commands.push_back(Undo{});
    ImGui::SameLine();
    if (ImGui::Button("fit")) actions.fit = true;
    ImGui::SameLine();
    if (ImGui::Button("replay")) actions.replay = true;
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("everything again, from the beginning, with the same bits");
    double speed = snapshot.speed;
    if (slider("speed", speed, 0.01, 4, " x")) actions.speed = speed;
}

void draw_body(const Snapshot& snapshot, PanelState& state, PanelActions& actions) {
    const std::size_t count = snapshot.bodies.size();
    if (count > 1) {
        const char* const names[] = {"left", "right"};
        if (ImGui::RadioButton("both", !state.body)) state.body.reset();
        for (std::size_t n = 0; n < 2; ++n) {
            ImGui::SameLine();
            if (ImGui::RadioButton(names[n], state.body == n)) state.body = n;
        }
    }
    const BodySnapshot& body = snapshot.bodies[state.body.value_or(0)];
    for (Scheme scheme : {Scheme::A, Scheme::B, Scheme::C}) {
        if (scheme != Scheme::A) ImGui::SameLine();
        const std::string name = fmt::format("scheme {}", to_string(scheme));
        const bool now = (count == 1 || state.body) && body.scheme == scheme;
        if (ImGui::RadioButton(name.c_str(), now) && !now) actions.commands.push_back(SetScheme{scheme});
    }
    // The ends of the sliders depend on what the body was when they were taken.
    const Material& from = state.before_slider ? *state.before_slider : body.material;
    Material m = body.material;
    const double stiff = from.young * body.surface->radius;
    bool moved = false, held = false;
    auto row_of = [&](const char* label, double& value, double low, double high) {
        moved |= slider(label, value, low, high);
        held |= ImGui::IsItemActive();
    };
    row_of("E [Pa]", m.young, 0.1 * from.young, 10 * from.young);
    row_of("E_s [N/m]", m.surface, 1e-3 * stiff, 10 * stiff);
    row_of("mass [kg]", m.mass, 0.1 * from.mass, 10 * from.mass);
    row_of("damping", m.damping, 0.01, 10);
    float poisson = float(m.poisson);
    if (ImGui::SliderFloat("nu, bulk", &poisson, 0, 0.5f, "%.3f")) {
        m.poisson = std::clamp(double(poisson), 0.0, 0.5);
        moved = true;
    }
    held |= ImGui::IsItemActive();
    if (moved) actions.commands.push_back(Tune{m});
    if (held && !state.before_slider) state.before_slider = body.material;
    if (!held) state.before_slider.reset();
}

void draw_gravity(const Snapshot& snapshot, PanelState& state, PanelActions& actions) {
    const bool was_on = !snapshot.gravity.isZero(0);
    bool on = was_on;
    if (ImGui::Checkbox("gravity", &on))
        actions.commands.push_back(Gravity{on ? state.gravity : Vector(Vector::Zero())});
    ImGui::SameLine();
    ImGui::TextUnformatted(fmt::format("{:.3g} m/s^2", state.gravity.norm()).c_str());
    ImGui::SameLine();
    actions.down |= ImGui::SmallButton("down here");
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("gravity goes down in the picture as it is seen now");
    float tilt = float(state.tilt), towards = float(state.towards);
    const float each = (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x) / 2;
    ImGui::SetNextItemWidth(each);
    bool turned = ImGui::SliderFloat("##tilt", &tilt, 0, 180, "%.0f deg from -y");
    ImGui::SameLine(), ImGui::SetNextItemWidth(each);
    turned |= ImGui::SliderFloat("##towards", &towards, -180, 180, "%.0f deg about y");
    if (turned) {
        turn_gravity(state, tilt, towards);
        if (on) actions.commands.push_back(Gravity{state.gravity});
    }
}

const char* meaning_of(Grip grip) {
    switch (grip) {
        case Grip::hold:
            return "drag the body: it comes along";
        case Grip::push:
            return "press on the body; wheel: force";
        case Grip::touch:
            return "press and drag; wheel: depth, Shift: turn";
        case Grip::refine:
            return "click the body; Shift: coarsen";
        case Grip::lasso:
            return "draw around what is to stay";
    }
    return "";
}

void draw_tools(const Snapshot& snapshot, PanelState& state, PanelActions& actions) {
    const std::pair<Grip, const char*> grips[] = {{Grip::hold, "hold"},
                                                  {Grip::push, "push"},
                                                  {Grip::touch, "ball"},
                                                  {Grip::refine, "refine"},
                                                  {Grip::lasso, "pin"}};
    for (const auto& [grip, name] : grips) {
        if (grip != Grip::hold) ImGui::SameLine();
        if (ImGui::RadioButton(name, state.grip == grip)) state.grip = grip;
    }
    ImGui::TextDisabled("%s", meaning_of(state.grip));
    const BodySnapshot& body = snapshot.bodies[0];
    const double R = body.surface->radius, unit = body.material.young * R * R;
    double radius = state.influence * R, push = state.push_share * unit;
    if (state.grip == Grip::touch) {
        double ball = state.ball.radius * R;
        if (slider("radius [m]", ball, 0.05 * R, R)) state.ball.radius = ball / R;
        float friction = float(state.ball.friction);
        if (ImGui::SliderFloat("friction", &friction, 0, 2, "%.2f")) state.ball.friction = friction;
        ImGui::Checkbox("as a capsule", &state.ball.capsule);
    } else {
        if (slider("radius [m]", radius, 0.05 * R, R)) state.influence = radius / R;
        if (slider("push [N]", push, 1e-4 * unit, unit)) state.push_share = push / unit;
    }
    if (!body.pinned.empty()) {
        if (ImGui::Button("let pins go")) actions.commands.push_back(Unpin{});
        ImGui::SameLine();
        ImGui::TextUnformatted(fmt::format("{} vertices pinned", body.pinned.size()).c_str());
    }
}

void draw_look(PanelState& state) {
    Look& look = state.look;
    if (ImGui::BeginCombo("colours", std::string(to_string(look.colour)).c_str())) {
        for (ColourBy colour : all_colours) {
            if (ImGui::Selectable(std::string(to_string(colour)).c_str(), colour == look.colour))
                look.colour = colour;
            if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", std::string(meaning_of(colour)).c_str());
        }
        ImGui::EndCombo();
    }
    ImGui::Checkbox("flat", &look.flat);
    ImGui::SameLine(), ImGui::Checkbox("edges", &look.wireframe);
    ImGui::SameLine(), ImGui::Checkbox("ground", &look.ground);
    ImGui::Checkbox("homes", &look.homes);
    ImGui::SameLine(), ImGui::Checkbox("virtual tetrahedra", &look.tetrahedra);
    ImGui::SameLine(), ImGui::Checkbox("fibres", &look.fibres);
}

void draw_help(PanelState& state, const Box2& box, double s) {
    ImGui::SetNextWindowPos({float(std::max(box.x / 2, 262 * s)), float(box.y + box.height / 2)},
                            ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSize({float(520 * s), 0});
    if (ImGui::Begin("Keys and mouse", &state.help,
                     ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove))
        for (const Shortcut& shortcut : shortcuts()) {
            ImGui::TextUnformatted(shortcut.keys);
            ImGui::SameLine(float(195 * s));
            ImGui::TextUnformatted(shortcut.what);
        }
    ImGui::End();
}

}  // namespace

void set_gravity(PanelState& state, const Vector& gravity) {
    constexpr double degree = 180 / std::numbers::pi;
    state.gravity = gravity;
    state.tilt = degree * std::atan2(std::hypot(gravity.x(), gravity.z()), -gravity.y());
    state.towards = degree * std::atan2(gravity.x(), gravity.z());
}

void turn_gravity(PanelState& state, double tilt, double towards) {
    constexpr double radian = std::numbers::pi / 180;
    const double t = tilt * radian, a = towards * radian;
    state.tilt = tilt, state.towards = towards;
    state.gravity =
        state.gravity.norm() * Vector(std::sin(t) * std::sin(a), -std::cos(t), std::sin(t) * std::cos(a));
}

std::span<const Shortcut> shortcuts() {
    static constexpr Shortcut all[] = {
        {"left drag on the body", "the grip: hold, push, ball, refine, pin"},
        {"left drag beside it", "orbit"},
        {"right drag", "orbit"},
        {"middle drag, Shift+right", "pan"},
        {"wheel", "zoom; pushing: force; with the ball: depth"},
        {"Shift+wheel", "with the ball: turn it"},
        {"haptic --device mouse", "pointer: across; wheel: depth, zoom with right"},
        {"H  P  B  F  L", "hold, push, ball, refine, pin (lasso)"},
        {"B again", "a capsule; a ball"},
        {"R  C", "refine, coarsen under the pointer"},
        {"1  2  3", "scheme A, B, C"},
        {"X", "of two: scheme, sliders of both or one"},
        {"G  Shift+G", "gravity on and off; down in this picture"},
        {"Space  .", "pause; one step or frame"},
        {"+  -", "twice as fast; slow motion"},
        {"Backspace  Z", "reset; undo"},
        {"V", "next colours"},
        {"W  S", "edges; flat or smooth"},
        {"O  T  Y", "homes; virtual tetrahedra; fibres"},
        {"0", "fit the body into the view"},
        {"F2  F3  F4  F5", "save picture, VTP, scene, session"},
        {"F6", "replay the session from its beginning"},
        {"Tab  ?  Q", "panel; these keys; close"}};
    return all;
}

PanelActions draw_panel(const Snapshot& snapshot, const History& history, PanelState& state, const Box2& box,
                        bool fits, double s) {
    PanelActions actions;
    if (state.open && fits) {
        ImGui::SetNextWindowPos({float(box.x), float(box.y)});
        ImGui::SetNextWindowSize({float(box.width), float(box.height)});
        ImGui::Begin("innerspring", nullptr,
                     ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                         ImGuiWindowFlags_NoTitleBar);
        ImGui::PushItemWidth(ImGui::GetContentRegionAvail().x * 0.66f);
        const bool simulated = snapshot.bodies[0].simulated && !snapshot.felt;
        draw_numbers(snapshot);
        ImGui::Separator();
        if (simulated) {
            draw_time(snapshot, actions);
            ImGui::Separator();
            draw_body(snapshot, state, actions);
            draw_gravity(snapshot, state, actions);
            ImGui::Separator();
            draw_tools(snapshot, state, actions);
            ImGui::Separator();
        }
        if (snapshot.felt) {
            draw_live(*snapshot.felt);
            ImGui::Separator();
        }
        draw_look(state);
        ImGui::Separator();
        ImGui::TextDisabled("save");
        ImGui::SameLine(), actions.picture |= ImGui::SmallButton("picture");
        if (!snapshot.felt) ImGui::SameLine(), actions.vtp |= ImGui::SmallButton("VTP");
        if (simulated) {
            ImGui::SameLine(), actions.scene |= ImGui::SmallButton("scene");
            ImGui::SameLine(), actions.recording |= ImGui::SmallButton("session");
        }
        ImGui::SameLine();
        if (ImGui::SmallButton("?")) state.help = !state.help;
        ImGui::Separator();
        draw_plots(history, snapshot, s);
        ImGui::PopItemWidth();
        ImGui::End();
    }
    if (state.help) draw_help(state, box, s);
    return actions;
}

}  // namespace innerspring::viewer
