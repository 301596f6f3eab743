#include "rig.h"

#include "innerspring/mesh/error.h"

namespace innerspring::viewer {

Rig::Rig(const std::vector<Scene>& scenes) : scenes_(scenes) {
    for (const Scene& scene : scenes_) {
        bodies_.push_back(std::make_unique<Simulation>(scene));
        if (scene.step.dt != scenes_.front().step.dt)
            throw InputError("bodies side by side need the same dt");
    }
}

Rig::Rig(const Recording& recording) : Rig(recording.scenes) {
    to_replay_.inputs = recording.inputs;
    to_replay_.ticks = recording.ticks;
    to_replay_.hash = recording.hash;
    if (recording.ticks == 0) end_replay();
}

void Rig::apply(const Command& command, std::optional<std::size_t> only) {
    disturbed_ = disturbed_ || replaying();
    give(command, only);
}

void Rig::give(const Command& command, std::optional<std::size_t> only) {
    done_.push_back({ticks_, command, only});
    std::string why;
    std::vector<Simulation*> without;
    for (std::size_t n = 0; n < bodies_.size(); ++n) {
        try {
            if (!only || n == *only)
                bodies_[n]->apply(command);
            else
                without.push_back(bodies_[n].get());
        } catch (const InputError& error) {
            why = error.what();
            without.push_back(bodies_[n].get());
        }
    }
    if (without.size() < bodies_.size())
        for (Simulation* body : without) body->pass_over(command);
    if (!why.empty()) throw InputError(why);
}

void Rig::replay_inputs() {
    const auto& inputs = to_replay_.inputs;
    for (; next_input_ < inputs.size() && inputs[next_input_].tick <= ticks_; ++next_input_) {
        try {
            give(inputs[next_input_].command, inputs[next_input_].body);
        } catch (const InputError&) {  // as it was refused when it was recorded
        }
    }
}

void Rig::end_replay() {
    replay_inputs();  // what was done after the last step
    if (!disturbed_) as_recorded_ = hash() == to_replay_.hash;
}

bool Rig::advance() {
    replay_inputs();
    bool well = true;
    for (const auto& body : bodies_) well = body->advance() && well;
    if (++ticks_ == to_replay_.ticks) end_replay();
    return well;
}

std::uint64_t Rig::hash() const {
    std::uint64_t all = 14695981039346656037u;
    for (const auto& body : bodies_) all = (all ^ state_hash(body->state())) * 1099511628211u;
    return all;
}

Recording Rig::recording() const {
    return {scenes_, done_, ticks_, hash()};
}

std::unique_ptr<Rig> replay(const Recording& recording) {
    auto rig = std::make_unique<Rig>(recording);
    while (rig->ticks() < recording.ticks) rig->advance();
    return rig;
}

}  // namespace innerspring::viewer
