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
}

void Rig::apply(const Command& command) {
    done_.push_back({ticks_, command});
    std::string why;
    std::vector<Simulation*> refused;
    for (const auto& body : bodies_) {
        try {
            body->apply(command);
        } catch (const InputError& error) {
            why = error.what();
            refused.push_back(body.get());
        }
    }
    if (refused.empty()) return;
    if (refused.size() < bodies_.size())
        for (Simulation* body : refused) body->pass_over(command);
    throw InputError(why);
}

bool Rig::advance() {
    const auto& inputs = to_replay_.inputs;
    for (; next_input_ < inputs.size() && inputs[next_input_].tick <= ticks_; ++next_input_) {
        try {
            apply(inputs[next_input_].command);
        } catch (const InputError&) {  // as it was refused when it was recorded
        }
    }
    bool well = true;
    for (const auto& body : bodies_) well = body->advance() && well;
    ++ticks_;
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
    // What was done after the last step.
    for (const Recording::Input& input : recording.inputs) {
        if (input.tick < recording.ticks) continue;
        try {
            rig->apply(input.command);
        } catch (const InputError&) {
        }
    }
    return rig;
}

}  // namespace innerspring::viewer
