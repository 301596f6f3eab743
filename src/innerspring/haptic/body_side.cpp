#include "innerspring/haptic/body_side.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace innerspring {

namespace {

double tool_size(const Tool& tool) {
    if (tool.shape == ToolShape::mesh) return tool.mesh->radius;
    return tool.radius + tool.length / 2;
}

/// Of what is in contact, over a step: about as long as the paper's body takes to come back.
double memory(const StepOptions& options) {
    return std::exp(-options.dt / 0.02);
}

}  // namespace

HandMapping fit_mapping(const Body& body, const Tool& tool, const DeviceInfo& info, double stiffness,
                        double metres, double newtons) {
    for (const double each : {metres, newtons})
        if (!(each >= 0 && std::isfinite(each)))
            throw InputError("haptic: scales must be positive and finite, or 0 for auto");
    Box box{body.rest.positions.front(), body.rest.positions.front()};
    for (const Vector& x : body.rest.positions) box = join(box, {x, x});
    const double R = body.radius, a = std::max(tool_size(tool), 1e-3 * R);
    const Vector room = info.workspace.upper - info.workspace.lower;
    if (!(room.minCoeff() > 0)) throw DeviceError(info.name + ": its workspace has no extent");
    HandMapping mapping;
    mapping.hand = (info.workspace.lower + info.workspace.upper) / 2;
    mapping.scene = (box.lower + box.upper) / 2;
    mapping.metres = metres > 0 ? metres : ((box.upper - box.lower).maxCoeff() + 4 * a) / room.minCoeff();
    const double d = 0.2 * R, E = body.material.young;
    const double force = std::numbers::pi * (E / R) * d * d / (1 / R + 1 / a);
    if (newtons > 0)
        mapping.newtons = newtons;
    else if (force > 0)
        mapping.newtons = std::min(0.6 * info.max_continuous_force / force,
                                   0.5 * stiffness / (2 * force / d * mapping.metres));
    return mapping;
}

BodySide::BodySide(const Body& body, Loads& loads, std::size_t tool, const StepOptions& options,
                   const HandMapping& mapping, std::vector<RefineRule> refine)
    : body_(body),
      loads_(loads),
      tool_(tool),
      options_(options),
      mapping_(mapping),
      workspace_(body_, options),
      state_(rest_state(body_)) {
    if (tool >= loads.tools.size()) throw InputError("haptic: no tool to hold");
    if (loads.tools[tool].shape == ToolShape::plane)
        throw InputError("haptic: a plane cannot be held; take a sphere, a capsule or a mesh");
    finder_.keep = memory(options);
    turned_ = loads.tools[tool].path.front().pose.rotation;
    if (!refine.empty()) refiner_.emplace(body_, std::move(refine));
}

void BodySide::follow_rules() {
    if (!refiner_ || !refine_failure_.empty()) return;
    try {
        refiner_->before_step(state_.time, options_.dt, body_, loads_, state_, [&](const Transfer& transfer) {
            workspace_.adapt(body_, transfer);
            finder_.adapt(transfer);
            ++mesh_version_;
        });
    } catch (const InputError& error) {  // the body is as before, and goes on
        refine_failure_ = error.what();
    }
}

LocalContact BodySide::step(const HandState& hand) {
    const double dt = options_.dt;
    Tool& tool = loads_.tools[tool_];
    const Pose target{
        mapping_.to_scene(hand.proxy),
        (mapping_.rotation * hand.pose.rotation * mapping_.rotation.conjugate() * turned_).normalized()};
    if (steps_ == 0) tool.path = {{state_.time, target}};  // where the hand is when it begins
    const double time = state_.time;
    move_to(tool, time, dt, target);
    follow_rules();
    const StepReport report = innerspring::step(body_, loads_, state_, workspace_);
    ++steps_;
    LocalContact out;
    out.period = dt;
    out.step = steps_;
    out.friction = tool.friction;
    position_ = target.position;
    force_.setZero();
    if (report.not_finite !=
        no_index) {  // begins anew at rest, and the servo hears of it as of the fault it is
        ++resets_;
        const double now = state_.time + dt;
        state_ = rest_state(body_);
        state_.time = now;
        workspace_ = Workspace(body_, options_);
        touch_ = {};
        out.stiffness = std::numeric_limits<double>::quiet_NaN();
        finder_ = {};
        finder_.keep = memory(options_);
        return out;
    }
    const ContactReport& contact = workspace_.contact();
    if (tool_ < contact.tools.size()) force_ = contact.tools[tool_].force;
    touch_ = finder_.find(body_, state_, contact, tool, tool_, loads_.gravity);
    if (!touch_.touching) return out;
    out.normal = mapping_.turn_to_hand(touch_.normal).normalized();
    out.stiffness = touch_.stiffness * mapping_.metres * mapping_.newtons;
    out.damping = touch_.damping * mapping_.metres * mapping_.newtons;
    out.rest = mapping_.to_hand(position_) + out.normal * (touch_.force * mapping_.newtons / out.stiffness);
    return out;
}

}  // namespace innerspring
