#pragma once
#include <optional>

#include "innerspring/haptic/servo.h"
#include "innerspring/haptic/touch.h"
#include "innerspring/sim/refiner.h"

namespace innerspring {

/// Between the hand's world and the scene's: x_scene = scene + metres R (x_hand - hand), F_hand = newtons R^T
/// F_scene. A stiffness of the scene is felt as metres * newtons times as large.
struct HandMapping {
    Vector hand = Vector::Zero();   ///< the middle of the device's workspace [m]
    Vector scene = Vector::Zero();  ///< what lies there [m]
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    double metres = 1;   ///< of the scene per metre of the hand
    double newtons = 1;  ///< at the hand per newton of the body

    Vector to_scene(const Vector& x) const { return scene + metres * (rotation * (x - hand)); }
    Vector to_hand(const Vector& x) const { return hand + rotation.conjugate() * (x - scene) / metres; }
    Vector turn_to_hand(const Vector& n) const { return rotation.conjugate() * n; }
};

/// The mapping that suits body and device (ours). The box around body and twice the tool's width on each side
/// fits into the smallest extent of the workspace; the force of a press by a fifth of the body's radius R
/// with a ball of the tool's size a, F = pi (E/R) R* d^2, 1/R* = 1/R + 1/a (tests/sim/test_contact.cpp), is
/// 0.6 of the force the device gives for long, or less, so that the stiffness 2 F/d stays below half of
/// `stiffness` [N/m], the coupling's. What is given (positive) is kept.
HandMapping fit_mapping(const Body& body, const Tool& tool, const DeviceInfo& info, double stiffness,
                        double metres = 0, double newtons = 0);

/// The body with the tool in the hand: takes the proxy, steps, and says what there is to feel.
class BodySide {
  public:
    /// `tool`: index into loads.tools. Throws InputError for what cannot be stepped, and for rules that
    /// cannot be. Keeps a reference to loads, and a body of its own, whose mesh follows the rules.
    BodySide(const Body& body, Loads& loads, std::size_t tool, const StepOptions& options,
             const HandMapping& mapping, std::vector<RefineRule> refine = {});

    /// The tool goes to the hand's proxy in a step of dt. A body that leaves the numbers begins anew at rest;
    /// the contact is then not a number either.
    LocalContact step(const HandState& hand);

    const Body& body() const { return body_; }
    const Loads& loads() const { return loads_; }
    const Workspace& workspace() const { return workspace_; }
    const State& state() const { return state_; }
    const HandMapping& mapping() const { return mapping_; }
    const Touch& touch() const { return touch_; }
    const Vector& force() const { return force_; }  ///< on the tool, mean over the last step [N], scene
    const Vector& tool_position() const { return position_; }  ///< [m], scene
    int resets() const { return resets_; }  ///< how often it left the numbers and began anew at rest
    int refinements() const { return refiner_ ? refiner_->changes() : 0; }  ///< and undoings, so far
    std::uint64_t mesh_version() const { return mesh_version_; }            ///< another one: another mesh
    /// Why the mesh no longer follows the rules; empty: it does.
    const std::string& refine_failure() const { return refine_failure_; }

  private:
    void follow_rules();

    Body body_;
    Loads& loads_;
    std::size_t tool_;
    StepOptions options_;
    HandMapping mapping_;
    Workspace workspace_;
    State state_;
    std::optional<Refiner> refiner_;
    std::uint64_t mesh_version_ = 0;
    std::string refine_failure_;
    TouchFinder finder_;
    Touch touch_;
    Vector force_ = Vector::Zero(), position_ = Vector::Zero();
    Eigen::Quaterniond turned_;  ///< of the tool itself, before the hand turns it
    std::uint64_t steps_ = 0;
    int resets_ = 0;
};

}  // namespace innerspring
