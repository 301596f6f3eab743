#include "innerspring/sim/state.h"

#include <cstring>

namespace innerspring {

State rest_state(const Body& body) {
    return {0, 0, body.rest.positions, std::vector<Vector>(body.vertices(), Vector::Zero())};
}

std::uint64_t state_hash(const State& state) {
    std::uint64_t hash = 14695981039346656037u;
    auto add = [&](const void* data, std::size_t size) {
        const auto* bytes = static_cast<const unsigned char*>(data);
        for (std::size_t n = 0; n < size; ++n) hash = (hash ^ bytes[n]) * 1099511628211u;
    };
    add(&state.time, sizeof state.time);
    add(&state.steps, sizeof state.steps);
    add(state.x.data(), state.x.size() * sizeof(Vector));
    add(state.v.data(), state.v.size() * sizeof(Vector));
    return hash;
}

}  // namespace innerspring
