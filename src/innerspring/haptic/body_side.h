#pragma once
#include "innerspring/haptic/servo.h"
#include "innerspring/haptic/touch.h"

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
    /// `tool`: index into loads.tools. Throws InputError for what cannot be stepped. Keeps references to body
    /// and loads.
    BodySide(const Body& body, Loads& loads, std::size_t tool, const StepOptions& options,
             const HandMapping& mapping);

    /// The tool goes to the hand's proxy in a step of dt.
    LocalContact step(const HandState& hand);

    const State& state() const { return state_; }
    const Touch& touch() const { return touch_; }
    const Vector& force() const { return force_; }  ///< on the tool, mean over the last step [N], scene
    const Vector& tool_position() const { return position_; }  ///< [m], scene
    int resets() const { return resets_; }  ///< how often it left the numbers and began anew at rest

  private:
    const Body& body_;
    Loads& loads_;
    std::size_t tool_;
    StepOptions options_;
    HandMapping mapping_;
    Workspace workspace_;
    State state_;
    TouchFinder finder_;
    Touch touch_;
    Vector force_ = Vector::Zero(), position_ = Vector::Zero();
    Eigen::Quaterniond turned_;  ///< of the tool itself, before the hand turns it
    std::uint64_t steps_ = 0;
    int resets_ = 0;
};

}  // namespace innerspring
