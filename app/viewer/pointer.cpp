// What the pointer does in the window.
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "feeling.h"
#include "window.h"

namespace innerspring::viewer {

namespace {

/// A click of the wheel takes the tool deeper by this share of its radius.
constexpr double touch_click = 0.05;
/// With Shift it turns by so much about the line of sight [radian].
constexpr double touch_turn = std::numbers::pi / 18;
/// And the haptic mouse, which begins farther away.
constexpr double mouse_click = 0.2;

bool inside(const Box2& box, double x, double y) {
    return x >= box.x && y >= box.y && x < box.x + box.width && y < box.y + box.height;
}

/// Even-odd rule.
bool inside(const std::vector<std::array<double, 2>>& outline, double x, double y) {
    bool odd = false;
    for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
        const auto &a = outline[i], &b = outline[j];
        if ((a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])) odd = !odd;
    }
    return odd;
}

std::vector<Vector> positions_of(const BodySnapshot& body) {
    std::vector<Vector> x = body.surface->rest;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += Vector(body.u[i][0], body.u[i][1], body.u[i][2]);
    return x;
}

/// Where the middle of a capsule is that comes along a ray, its axis at right angles to it, when it meets the
/// vertices or `hit`.
Vector arrival(const Vector& hit, const Vector& along, double radius, double length, const Vector& axis,
               Positions x) {
    double before = radius;  // the hit
    for (const Vector& place : x) {
        const Vector d = place - hit;
        const double a = d.dot(axis), ahead = -d.dot(along);
        const Vector beside = d + ahead * along - std::clamp(a, -length / 2, length / 2) * axis;
        if (const double rest = radius * radius - beside.squaredNorm(); rest > 0)
            before = std::max(before, ahead + std::sqrt(rest));
    }
    return hit - before * along;
}

}  // namespace

std::array<double, 2> Window::on_screen(const Vector& place) const {
    return project(camera_, part_of(stage_box(), 0, snapshot().bodies.size()), place);
}

double Window::influence() const {
    return panel_.influence * snapshot().bodies[0].surface->radius;
}

Vector Window::rest_place(std::size_t body, const Hit& hit) const {
    return snapshot().bodies[body].surface->rest[hit.vertex];
}

std::optional<Hit> Window::under_pointer(std::size_t& body) const {
    const Stage::Aim aim = stage_->aim(snapshot(), camera_, stage_box(), input_.x, input_.y);
    body = aim.body;
    const BodySnapshot& shown = snapshot().bodies[body];
    return first_hit(aim.ray, positions_of(shown), shown.surface->triangles);
}

void Window::mouse_move(double x, double y) {
    const double dx = x - input_.x, dy = y - input_.y;
    input_.x = x, input_.y = y;
    const Box2 box = part_of(stage_box(), 0, snapshot().bodies.size());
    if (gesture_.kind == Gesture::Kind::orbit) orbit(camera_, 0.4 * dx / scale_, -0.4 * dy / scale_);
    if (gesture_.kind == Gesture::Kind::pan)
        pan(camera_, 2 * dx / box.height, -2 * dy / box.height, box.width / box.height);
    if (gesture_.kind == Gesture::Kind::lasso) gesture_.outline.push_back({x, y});
    gesture_.moved = true;
}

void Window::mouse_button(int button, bool down, int modifiers) {
    if (button < 0 || button > 2) return;
    input_.held[std::size_t(button)] = down;
    if (message_ == hint) message_.clear();
    if (down) input_.buttons[std::size_t(button)] = true;  // a click between two frames is one all the same
    input_.shift = modifiers & GLFW_MOD_SHIFT;
    if (!down) {
        if (button != gesture_.button) return;
        if (session_ && (gesture_.kind == Gesture::Kind::hold || gesture_.kind == Gesture::Kind::push ||
                         gesture_.kind == Gesture::Kind::touch)) {
            move_tool();
            session_->send(Release{});
        }
        if (gesture_.kind == Gesture::Kind::lasso) end_lasso();
        gesture_ = {};
        return;
    }
    if (gesture_.kind != Gesture::Kind::none || !inside(stage_box(), input_.x, input_.y) ||
        gui_->wants_pointer())
        return;
    gesture_ = {};
    gesture_.button = button;
    if (button == GLFW_MOUSE_BUTTON_LEFT) {
        if (options_.feeling && options_.feeling->has_mouse()) return;  // a button of the device
        begin_tool();
    } else {
        const bool pans = button == GLFW_MOUSE_BUTTON_MIDDLE || (modifiers & GLFW_MOD_SHIFT);
        gesture_.kind = pans ? Gesture::Kind::pan : Gesture::Kind::orbit;
    }
}

void Window::begin_tool() {
    if (session_ && panel_.grip == Grip::lasso) {
        gesture_.kind = Gesture::Kind::lasso;
        gesture_.outline = {{input_.x, input_.y}};
        return;
    }
    const auto hit = under_pointer(gesture_.body);
    if (!session_ || !hit) {
        gesture_.kind = Gesture::Kind::orbit;
        return;
    }
    const Vector near = rest_place(gesture_.body, *hit);
    gesture_.taken = hit->point;
    if (panel_.grip == Grip::hold) {
        gesture_.kind = Gesture::Kind::hold;
        session_->send(Grab{near, influence()});
    } else if (panel_.grip == Grip::push) {
        gesture_.kind = Gesture::Kind::push;
        gesture_.moved = true;
        move_tool();
    } else if (panel_.grip == Grip::touch) {
        begin_touch(*hit);
    } else if (input_.shift) {
        session_->send(CoarsenNear{near, influence()});
    } else {
        session_->send(RefineNear{near, influence()});
    }
}

/// The tool comes from the eye until it meets the surface.
void Window::begin_touch(const Hit& hit) {
    const BodySnapshot& shown = snapshot().bodies[gesture_.body];
    Touch touch;
    touch.radius = panel_.ball.radius * shown.surface->radius;
    touch.length = panel_.ball.capsule ? 2 * touch.radius : 0;
    touch.friction = panel_.ball.friction;
    gesture_.kind = Gesture::Kind::touch;
    gesture_.into = stage_->aim(snapshot(), camera_, stage_box(), input_.x, input_.y).ray.along;
    touch.axis = gesture_.into.cross(camera_.up()).stableNormalized();
    touch.at = arrival(hit.point, gesture_.into, touch.radius, touch.length, touch.axis, positions_of(shown));
    gesture_.tool = touch.at;
    session_->send(touch);
}

/// How far the pointer is from the point taken, in the plane through that which faces the eye [m].
Vector Window::pointer_way() const {
    return beside(gesture_.taken) - gesture_.taken;
}

/// Where the pointer's ray meets the plane through a point that faces the eye [m].
Vector Window::beside(const Vector& point) const {
    const Ray ray = stage_->aim(snapshot(), camera_, stage_box(), input_.x, input_.y).ray;
    const Vector normal = camera_.back();
    // Within the picture the ray meets the plane at less than half the angle of view.
    return ray.from + (point - ray.from).dot(normal) / ray.along.dot(normal) * ray.along;
}

/// The haptic mouse goes across with the pointer, and deeper with the wheel.
void Window::move_mouse() {
    if (!options_.feeling->has_mouse()) return;
    const bool aims = gesture_.kind == Gesture::Kind::none && inside(stage_box(), input_.x, input_.y) &&
                      !gui_->wants_pointer();
    if (aims) pointed_ = beside(pointed_);
    options_.feeling->point(pointed_, input_.held[0] ? 1u : 0u);
}

void Window::move_tool() {
    if (!gesture_.moved || !session_) return;
    gesture_.moved = false;
    if (gesture_.kind == Gesture::Kind::hold) session_->send(Drag{pointer_way()});
    if (gesture_.kind == Gesture::Kind::touch)
        session_->send(MoveTool{gesture_.tool + pointer_way() + gesture_.depth * gesture_.into,
                                gesture_.turn * gesture_.into});
    if (gesture_.kind == Gesture::Kind::push) {
        const auto hit = under_pointer(gesture_.body);
        if (!hit) return;  // beside the body: it goes on where it was
        const BodySnapshot& shown = snapshot().bodies[gesture_.body];
        const double R = shown.surface->radius;
        const Triangle& c = shown.surface->triangles[hit->triangle];
        auto at = [&](Index i) {
            return Vector(shown.surface->rest[i] + Vector(shown.u[i][0], shown.u[i][1], shown.u[i][2]));
        };
        const Vector inward = -(at(c[1]) - at(c[0])).cross(at(c[2]) - at(c[0])).stableNormalized();
        session_->send(Push{rest_place(gesture_.body, *hit), influence(),
                            panel_.push_share * shown.material.young * R * R * inward});
    }
}

void Window::end_lasso() {
    if (gesture_.outline.size() < 3) return;
    const std::size_t count = snapshot().bodies.size(),
                      n = stage_
                              ->aim(snapshot(), camera_, stage_box(), gesture_.outline[0][0],
                                    gesture_.outline[0][1])
                              .body;
    const BodySnapshot& shown = snapshot().bodies[n];
    const Box2 box = part_of(stage_box(), n, count);
    PinAt pin;
    const auto& drawn = stage_->drawn()[n];
    for (std::size_t i = 0; i < shown.u.size() && i < drawn.x.size(); ++i) {
        const auto [x, y] = project(camera_, box, drawn.x[i]);
        // What faces the eye; a part behind another is taken with it.
        if (inside(gesture_.outline, x, y) && drawn.normals[i].dot(camera_.eye() - drawn.x[i]) > 0)
            pin.places.push_back(shown.surface->rest[i]);
    }
    if (!pin.places.empty()) session_->send(pin);
    say(fmt::format("{} vertices pinned", pin.places.size()));
}

void Window::scroll(double up) {
    if (!inside(stage_box(), input_.x, input_.y) || gui_->wants_pointer()) {
        input_.wheel += up;
    } else if (gesture_.kind == Gesture::Kind::push) {
        panel_.push_share = std::clamp(panel_.push_share * std::pow(1.15, up), 1e-4, 1.0);
        gesture_.moved = true;
    } else if (gesture_.kind == Gesture::Kind::touch) {
        const double R = snapshot().bodies[gesture_.body].surface->radius;
        if (input_.shift)
            gesture_.turn += touch_turn * up;
        else
            gesture_.depth =
                std::clamp(gesture_.depth + touch_click * panel_.ball.radius * R * up, -2 * R, 2 * R);
        gesture_.moved = true;
    } else if (options_.feeling && options_.feeling->has_mouse() && gesture_.kind == Gesture::Kind::none) {
        const double size = snapshot().bodies[0].tools[0].tool.radius;
        pointed_ -= mouse_click * (size > 0 ? size : 0.2 * snapshot().bodies[0].surface->radius) * up *
                    camera_.back();
    } else {
        zoom(camera_, std::pow(1.12, up));
    }
}

void Window::drop(const std::vector<std::string>& files) {
    if (files.empty()) return;
    OpenRequest request;
    request.what.assign(files.begin(),
                        files.begin() + std::min<std::ptrdiff_t>(2, std::ptrdiff_t(files.size())));
    open(request);
}

}  // namespace innerspring::viewer
