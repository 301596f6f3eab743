#pragma once
#include "simulation.h"

namespace innerspring::viewer {

/// One body, or two side by side under the same hand, with everything that is done to them written down.
class Rig {
  public:
    explicit Rig(const std::vector<Scene>& scenes);
    /// The inputs are applied as their steps come, until they are used up.
    explicit Rig(const Recording& recording);

    /// Applies to every body, or to one, and writes it down. What a body refuses is said by an InputError,
    /// after all have had it: a recording is refused the same things again.
    void apply(const Command& command, std::optional<std::size_t> only = {});

    /// One step of every body. False if one could not.
    bool advance();

    std::size_t size() const { return bodies_.size(); }
    const Simulation& operator[](std::size_t n) const { return *bodies_[n]; }
    std::uint64_t ticks() const { return ticks_; }
    /// At the end of a recording: whether the states are those recorded. None before, nor where something
    /// else was done meanwhile.
    std::optional<bool> as_recorded() const { return as_recorded_; }
    bool replaying() const { return next_input_ < to_replay_.inputs.size() || ticks_ < to_replay_.ticks; }

    /// Of the states of all bodies.
    std::uint64_t hash() const;
    /// Everything since the beginning.
    Recording recording() const;

  private:
    void give(const Command& command, std::optional<std::size_t> only);
    void replay_inputs();
    void end_replay();

    std::vector<Scene> scenes_;
    std::vector<std::unique_ptr<Simulation>> bodies_;
    std::vector<Recording::Input> done_;
    std::uint64_t ticks_ = 0;
    Recording to_replay_;
    std::size_t next_input_ = 0;
    bool disturbed_ = false;
    std::optional<bool> as_recorded_;
};

/// Plays a recording to its end without a clock; the rig's hash is then the recording's.
std::unique_ptr<Rig> replay(const Recording& recording);

}  // namespace innerspring::viewer
