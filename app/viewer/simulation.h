#pragma once
#include <memory>
#include <optional>

#include "commands.h"
#include "innerspring/record/setup.h"
#include "innerspring/sim/measure.h"

namespace innerspring::viewer {

/// What the hand does to a body. Its force, or its tool, is the last of the loads while it acts.
struct Hand {
    enum class Kind { none, push, hold, tool } kind = Kind::none;
    Vector from = Vector::Zero();  ///< hold: the weighted mean of the patch when it was taken [m]
    Vector by = Vector::Zero();    ///< hold: how far the hand has moved [m]
    double stiffness = 0;          ///< hold: of the spring between them [N/m]
    Vector to = Vector::Zero();    ///< tool: where it is to go [m]
    Eigen::Quaterniond taken = Eigen::Quaterniond::Identity(),
                       turned = Eigen::Quaterniond::Identity();  ///< tool: as it was taken, as it is to be
};

/// One body under the hand, without a thread or a clock: the same scene and the same commands before the same
/// steps give the same bits.
class Simulation {
  public:
    /// Throws InputError as set_up() and Workspace do.
    explicit Simulation(const Scene& scene);
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;

    /// Throws InputError with everything as before.
    void apply(const Command& command);

    /// Takes note of a command that only the other bodies took, so that undo stays in step.
    void pass_over(const Command& command);

    /// One step of dt. False if the body left the numbers or its mesh could not follow the scene's rules: the
    /// last good state is kept, failure() says why.
    bool advance();

    const Body& body() const { return now_.body; }
    const State& state() const { return now_.state; }
    const Loads& loads() const { return now_.loads; }
    const Workspace& workspace() const { return *workspace_; }
    double dt() const { return scene_.step.dt; }
    const std::string& failure() const { return failure_; }

    const Force* hand_force() const;  ///< null where the hand is away or has a tool
    const Tool* hand_tool() const;    ///< null without one
    /// What the tools met in the last step; null where there was none with these tools on this mesh.
    const ContactReport* contact() const { return met_ ? &workspace_->contact() : nullptr; }

    /// Changes whenever the triangles do, and whenever masses or springs do.
    std::uint64_t mesh_version() const { return mesh_version_; }
    std::uint64_t body_version() const { return body_version_; }

    /// The scene with what was changed by hand since: material, scheme, gravity, pins, the hand's tool where
    /// it is. What was refined by hand is not in it, as a scene knows refinement by time only.
    Scene scene() const;
    const std::vector<std::string>& notes() const { return notes_; }

  private:
    /// Everything that undo brings back.
    struct Moment {
        Body body;
        Loads loads;
        State state;
        std::optional<Subdivision> history;  ///< from the first refinement by hand
        std::optional<Refiner> refiner;      ///< of a scene with refinement rules
        Hand hand;
        std::size_t scene_pins = 0;  ///< how many of the pins are the scene's; others were set by hand
    };

    void act(const Command& command);
    void act(const Grab& grab);
    void act(const Drag& drag);
    void act(const Push& push);
    void act(const Touch& touch);
    void move_hand();
    void release();
    void set_hand(Hand::Kind kind, const Vector& near, double radius);
    void adapted(const Transfer& transfer);
    void renew_workspace();
    void follow_mesh(const Transfer& transfer);
    void remember(const Command& command, Moment before);
    Subdivision& history();

    Scene scene_;
    std::vector<std::string> notes_;
    Moment now_;
    std::unique_ptr<const Moment> start_;
    std::optional<Workspace> workspace_;
    std::vector<Moment> undo_;
    std::size_t last_kind_ = std::variant_npos;  ///< of the last command remembered, and when: drags of one
    double last_time_ = 0;                       ///< slider are undone together
    std::uint64_t mesh_version_ = 0, body_version_ = 0;
    bool met_ = false;
    std::string failure_;
};

/// Weighted mean of the vertices a force acts on [m].
Vector mean_place(const Force& force, const State& state);

}  // namespace innerspring::viewer
