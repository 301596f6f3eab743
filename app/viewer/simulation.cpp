#include "simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/body/tune.h"
#include "innerspring/mesh/error.h"

namespace innerspring::viewer {

namespace {

/// How much stiffer the hand's spring is than the patch it holds: the patch follows the hand by 4/5.
constexpr double grip = 4;
/// What the patch answers by its inner springs alone the hand gives at once, the rest (surface springs,
/// gravity) within so many times the time of the patch's own motion, sqrt(m / K): slow enough for no
/// overshoot. In a step it goes at most this share of the way, so that of an error 1 - 0.3 (1 + grip) = -0.5
/// is left at most.
constexpr double slowness = 20, most_of_the_way = 0.3;
/// The hand pulls with no more than this times E R^2.
constexpr double strongest = 5;

/// A tool goes in a step by dt / tool_lag of the way it has left, so that it moves on between two places of
/// the pointer, and no faster than so many volume radii in a second.
constexpr double tool_lag = 0.03;  ///< [s]
constexpr double fastest_tool = 5;
constexpr double fastest_turn = 10;  ///< [rad/s]

/// Undo keeps so many bytes at most, but always the last moment.
constexpr std::size_t undo_bytes = 256u << 20;
constexpr std::size_t most_undo = 30;

constexpr std::size_t most_triangles = 2000000;

std::size_t bytes_of(const Body& body) {
    return 200 * body.vertices() + sizeof(Spoke) * body.spokes.size() + 120 * body.edges.size();
}

/// Of the weighted mean of a patch that is loaded with the same weights, by the inner springs alone:
/// u_i = w_i F / K_i, so sum w_i u_i = F sum w_i^2 / K_i.
double patch_stiffness(const Body& body, const Force& patch) {
    double compliance = 0;
    for (std::size_t n = 0; n < patch.vertices.size(); ++n)
        compliance += patch.weights[n] * patch.weights[n] / body.K[patch.vertices[n]];
    return 1 / compliance;
}

/// Whether a corner is that near.
bool within(const Vector& place, double radius, const Vector& a, const Vector& b, const Vector& c) {
    return std::min({(a - place).norm(), (b - place).norm(), (c - place).norm()}) <= radius;
}

bool changes_more_than_the_hand(const Command& command) {
    return !std::holds_alternative<Grab>(command) && !std::holds_alternative<Drag>(command) &&
           !std::holds_alternative<Push>(command) && !std::holds_alternative<Touch>(command) &&
           !std::holds_alternative<MoveTool>(command) && !std::holds_alternative<Release>(command) &&
           !std::holds_alternative<Undo>(command);
}

}  // namespace

Simulation::Simulation(const Scene& scene) : scene_(scene) {
    Setup setup = set_up(scene);
    notes_ = std::move(setup.notes);
    now_.body = std::move(setup.body);
    now_.loads = std::move(setup.loads);
    now_.scene_pins = now_.loads.pins.size();
    now_.state = rest_state(now_.body);
    if (!setup.refine.empty()) now_.refiner.emplace(now_.body, std::move(setup.refine));
    renew_workspace();
    start_ = std::make_unique<const Moment>(now_);
}

void Simulation::renew_workspace() {
    workspace_.emplace(now_.body, scene_.step);
    met_ = false;
}

void Simulation::remember(const Command& command, Moment before) {
    const bool same_drag =
        command.index() == last_kind_ && !undo_.empty() &&
        (std::holds_alternative<Tune>(command) || std::holds_alternative<Gravity>(command)) &&
        now_.state.time - last_time_ < 0.5;
    last_kind_ = command.index();
    last_time_ = now_.state.time;
    if (same_drag) return;
    undo_.push_back(std::move(before));
    std::size_t bytes = 0;
    for (const Moment& moment : undo_) bytes += bytes_of(moment.body);
    while (undo_.size() > 1 && (undo_.size() > most_undo || bytes > undo_bytes)) {
        bytes -= bytes_of(undo_.front().body);
        undo_.erase(undo_.begin());
    }
}

void Simulation::apply(const Command& command) {
    if (!changes_more_than_the_hand(command)) return act(command);
    Moment before = now_;
    try {
        act(command);
    } catch (const InputError&) {
        now_ = std::move(before);
        renew_workspace();
        ++mesh_version_, ++body_version_;
        throw;
    }
    remember(command, std::move(before));
}

void Simulation::pass_over(const Command& command) {
    if (changes_more_than_the_hand(command)) remember(command, now_);
}

void Simulation::act(const Command& command) {
    if (const auto* gravity = std::get_if<Gravity>(&command)) {
        if (!gravity->g.allFinite()) throw InputError("gravity must be finite");
        now_.loads.gravity = gravity->g;
    } else if (const auto* grab = std::get_if<Grab>(&command)) {
        act(*grab);
    } else if (const auto* drag = std::get_if<Drag>(&command)) {
        act(*drag);
    } else if (const auto* push = std::get_if<Push>(&command)) {
        act(*push);
    } else if (const auto* touch = std::get_if<Touch>(&command)) {
        act(*touch);
    } else if (const auto* move = std::get_if<MoveTool>(&command)) {
        if (!move->to.allFinite() || !move->turn.allFinite())
            throw InputError("the tool's place and turn must be finite");
        now_.hand.to = move->to;
        const double angle = move->turn.norm();
        now_.hand.turned = now_.hand.taken;
        if (angle > 0)
            now_.hand.turned = Eigen::AngleAxisd(angle, move->turn.stableNormalized()) * now_.hand.taken;
    } else if (std::holds_alternative<Release>(command)) {
        release();
    } else if (const auto* tuned = std::get_if<Tune>(&command)) {
        Material material = tuned->material;
        material.anisotropy = now_.body.material.anisotropy;
        scale_moduli(material.anisotropy, material.young / now_.body.material.young);
        tune(now_.body, material, now_.body.scheme);
        ++body_version_;
        renew_workspace();
    } else if (const auto* scheme = std::get_if<SetScheme>(&command)) {
        tune(now_.body, now_.body.material, scheme->scheme);
        ++body_version_;
        renew_workspace();
    } else if (const auto* fine = std::get_if<RefineNear>(&command)) {
        const auto near = triangles_near(now_.body.rest, fine->near, fine->radius);
        if (now_.body.rest.triangles.size() + 3 * near.size() > most_triangles)
            throw InputError(fmt::format("more than {} triangles are too many to play with", most_triangles));
        try {
            adapted(refine(now_.body, history(), now_.state, near));
        } catch (const InputError&) {  // refused: the triangles may stand in another order
            renew_workspace();
            throw;
        }
    } else if (const auto* coarse = std::get_if<CoarsenNear>(&command)) {
        adapted(
            coarsen(now_.body, history(), now_.state, [&](const Vector& a, const Vector& b, const Vector& c) {
                return !within(coarse->near, coarse->radius, a, b, c);
            }));
    } else if (const auto* pin = std::get_if<PinAt>(&command)) {
        std::vector<bool> pinned(now_.body.vertices(), false);
        for (const Pin& p : now_.loads.pins)
            for (Index i : p.vertices) pinned[i] = true;
        Pin added;
        for (const Vector& place : pin->places) {
            const Index i = nearest_vertex(now_.body.rest.positions, place);
            if (!pinned[i]) added.vertices.push_back(i), pinned[i] = true;
        }
        if (!added.vertices.empty()) now_.loads.pins.push_back(std::move(added));
    } else if (std::holds_alternative<Unpin>(command)) {
        now_.loads.pins.clear();
        now_.scene_pins = 0;
    } else if (std::holds_alternative<Reset>(command)) {
        now_ = *start_;
        failure_.clear();
        ++mesh_version_, ++body_version_;
        renew_workspace();
    } else if (std::holds_alternative<Undo>(command)) {
        if (undo_.empty()) throw InputError("there is nothing to undo");
        now_ = std::move(undo_.back());
        undo_.pop_back();
        last_kind_ = std::variant_npos;
        failure_.clear();
        release();
        ++mesh_version_, ++body_version_;
        renew_workspace();
    }
}

Subdivision& Simulation::history() {
    if (now_.refiner) throw InputError("the scene has its own rules of refinement; they are left alone");
    if (!now_.history) now_.history.emplace(now_.body.rest);
    return *now_.history;
}

void Simulation::adapted(const Transfer& transfer) {
    if (transfer.surface.removed.empty()) return;
    carry_over(now_.loads, now_.body, transfer);
    follow_mesh(transfer);
}

void Simulation::follow_mesh(const Transfer& transfer) {
    workspace_->adapt(now_.body, transfer);
    met_ = false;
    ++mesh_version_, ++body_version_;
    if (now_.hand.kind != Hand::Kind::hold) return;
    // The patch is another one now; the force goes on as it was.
    const Force& force = now_.loads.forces.back();
    now_.hand.stiffness = grip * patch_stiffness(now_.body, force);
    now_.hand.from = mean_place(force, now_.state) + force.newton / now_.hand.stiffness - now_.hand.by;
}

void Simulation::set_hand(Hand::Kind kind, const Vector& near, double radius) {
    if (!near.allFinite()) throw InputError("the hand's place must be finite");
    Force patch =
        patch_force(now_.body, nearest_vertex(now_.body.rest.positions, near), radius, Vector::Zero());
    patch.name = "hand";
    release();
    now_.loads.forces.push_back(std::move(patch));
    now_.hand.kind = kind;
}

void Simulation::act(const Grab& grab) {
    set_hand(Hand::Kind::hold, grab.near, grab.radius);
    const Force& force = now_.loads.forces.back();
    now_.hand.from = mean_place(force, now_.state);
    now_.hand.stiffness = grip * patch_stiffness(now_.body, force);
}

void Simulation::act(const Drag& drag) {
    Hand& hand = now_.hand;
    if (!drag.by.allFinite() || hand.kind != Hand::Kind::hold) return;
    now_.loads.forces.back().newton += hand.stiffness / (1 + grip) * (drag.by - hand.by);
    hand.by = drag.by;
}

void Simulation::act(const Push& push) {
    if (!push.newton.allFinite()) throw InputError("the hand's force must be finite");
    set_hand(Hand::Kind::push, push.near, push.radius);
    now_.loads.forces.back().newton = push.newton;
}

void Simulation::act(const Touch& touch) {
    const Pose pose{touch.at, Eigen::Quaterniond::FromTwoVectors(Vector(Vector::UnitZ()), touch.axis)};
    Tool tool = touch.length == 0 ? sphere_tool(touch.radius, touch.at, touch.friction)
                                  : capsule_tool(touch.radius, touch.length, pose, touch.friction);
    tool.name = "hand";
    require_valid(tool);
    release();
    now_.loads.tools.push_back(std::move(tool));
    now_.hand.kind = Hand::Kind::tool;
    now_.hand.to = touch.at;
    now_.hand.taken = now_.hand.turned = pose.rotation;
    met_ = false;
}

void Simulation::release() {
    if (hand_tool()) {
        now_.loads.tools.pop_back();
        met_ = false;
    } else if (hand_force()) {
        now_.loads.forces.pop_back();
    }
    now_.hand = {};
}

const Force* Simulation::hand_force() const {
    const bool there = now_.hand.kind == Hand::Kind::push || now_.hand.kind == Hand::Kind::hold;
    return there ? &now_.loads.forces.back() : nullptr;
}

const Tool* Simulation::hand_tool() const {
    return now_.hand.kind == Hand::Kind::tool ? &now_.loads.tools.back() : nullptr;
}

Vector mean_place(const Force& force, const State& state) {
    Vector place = Vector::Zero();
    for (std::size_t n = 0; n < force.vertices.size(); ++n)
        place += force.weights[n] * state.x[force.vertices[n]];
    return place;
}

void Simulation::move_hand() {
    const double dt = scene_.step.dt;
    if (now_.hand.kind == Hand::Kind::tool) {
        Tool& tool = now_.loads.tools.back();
        Pose pose = pose_at(tool, now_.state.time);
        const double share = std::min(1.0, dt / tool_lag);
        Vector way = share * (now_.hand.to - pose.position);
        const double most = fastest_tool * now_.body.radius * dt;
        if (const double size = way.norm(); size > most) way *= most / size;
        pose.position += way;
        if (pose.rotation.coeffs() != now_.hand.turned.coeffs()) {
            const double angle = pose.rotation.angularDistance(now_.hand.turned);
            const double part = std::min(share, angle > 0 ? fastest_turn * dt / angle : 1.0);
            pose.rotation = pose.rotation.slerp(part, now_.hand.turned).normalized();
        }
        move_to(tool, now_.state.time, dt, pose);
    }
    if (now_.hand.kind == Hand::Kind::hold) {
        Force& force = now_.loads.forces.back();
        Vector pull = now_.hand.stiffness * (now_.hand.from + now_.hand.by - mean_place(force, now_.state));
        const double most =
            strongest * mean_modulus(now_.body.material) * now_.body.radius * now_.body.radius;
        if (const double size = pull.norm(); size > most) pull *= most / size;
        const Index i = force.centre;
        const double rate = std::sqrt(now_.body.K[i] / now_.body.m[i]) / slowness;
        force.newton += std::min(most_of_the_way, rate * dt) * (pull - force.newton);
        if (const double size = force.newton.norm(); size > most) force.newton *= most / size;
    }
}

bool Simulation::advance() {
    if (!failure_.empty()) return false;
    move_hand();
    StepReport report;
    try {
        if (now_.refiner)
            now_.refiner->before_step(now_.state.time, scene_.step.dt, now_.body, now_.loads, now_.state,
                                      [&](const Transfer& transfer) { follow_mesh(transfer); });
        report = step(now_.body, now_.loads, now_.state, *workspace_);
    } catch (const InputError& error) {
        failure_ = error.what();
        return false;
    }
    met_ = !now_.loads.tools.empty() && report.not_finite == no_index;
    if (report.not_finite != no_index)
        failure_ = fmt::format("stopped at t = {:.4g} s: vertex {} left the numbers; undo or reset",
                               now_.state.time, report.not_finite);
    return failure_.empty();
}

Scene Simulation::scene() const {
    Scene scene = scene_;
    scene.material = now_.body.material;
    scene.scheme = now_.body.scheme;
    scene.gravity = now_.loads.gravity;
    // Vertices pinned by hand are named by place, which survives refinement.
    if (now_.scene_pins == 0) scene.pins.clear();
    for (std::size_t n = now_.scene_pins; n < now_.loads.pins.size(); ++n)
        for (Index i : now_.loads.pins[n].vertices) {
            ScenePin pin;
            pin.near = now_.body.rest.positions[i];
            scene.pins.push_back(pin);
        }
    if (const Tool* tool = hand_tool()) {
        const Pose pose = pose_at(*tool, now_.state.time);
        SceneTool kept;
        kept.radius = tool->radius, kept.length = tool->length, kept.friction = tool->friction;
        kept.at = pose.position;
        if (tool->length > 0) kept.axis = pose.rotation * Vector::UnitZ();
        scene.tools.push_back(kept);
    }
    return scene;
}

}  // namespace innerspring::viewer
