#pragma once
#include <cstdint>

#include "innerspring/body/body.h"

namespace innerspring {

/// All that must be saved to go on with the same bits.
struct State {
    double time = 0;          ///< [s]
    std::uint64_t steps = 0;  ///< steps of dt taken
    std::vector<Vector> x;    ///< positions [m], one per vertex
    std::vector<Vector> v;    ///< velocities [m/s], one per vertex
};

/// At rest in the rest shape at time 0.
State rest_state(const Body& body);

/// FNV-1a over every bit of the state; written in each summary.
std::uint64_t state_hash(const State& state);

}  // namespace innerspring
