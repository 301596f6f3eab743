#pragma once
#include <filesystem>

#include "innerspring/sim/refiner.h"

namespace innerspring {

/// A state on disk, with what resuming needs to be sure that it continues the same run.
struct SavedState {
    std::uint64_t scene_hash = 0;  ///< of the resolved scene, duration left out
    double energy_bound = 0;       ///< the watch's account of energy so far [J]
    State state;
    std::vector<ToolView> views;  ///< the Refiner's
};

std::uint64_t text_hash(std::string_view text);

/// Binary, little endian, with a checksum; whole or not there.
void write_state(const SavedState& saved, const std::filesystem::path& file);

/// Throws InputError if the file is missing, not a state, or damaged.
SavedState read_state(const std::filesystem::path& file);

}  // namespace innerspring
