#pragma once
#include <atomic>
#include <functional>

#include "innerspring/record/series.h"
#include "innerspring/record/setup.h"
#include "innerspring/sim/equilibrium.h"

namespace innerspring {

struct Progress {
    double share;  ///< 0 .. 1
    double seconds_left;
    double volume_variation_percent;  ///< now
};

struct RunOptions {
    std::filesystem::path directory;                     ///< made if missing
    bool resume = false;                                 ///< go on from the state in the directory
    std::function<void(const Progress&)> progress = {};  ///< called about ten times a second; may be empty
    const std::atomic<bool>* stop = nullptr;             ///< when it becomes true the run is saved and ends
    bool pictures = true;                                ///< false: no volume.svg and no picture.png
};

/// How a run ended and what it found; what summary.json holds.
struct Summary {
    Subject subject;
    Integrator integrator = Integrator::symplectic;
    Precision precision = Precision::full;
    double dt_s = 0;
    int substeps = 1;       ///< per step; the most where refinement changed them
    double duration_s = 0;  ///< reached
    VolumeVariation volume_variation_percent;
    Measures last;  ///< at the end
    bool equilibrium_reached = false;
    double residual_n = 0;   ///< largest force left on a vertex at the end [N]
    double tolerance_n = 0;  ///< what counts as equilibrium [N]
    std::uint64_t steps = 0;
    int refinements = 0;            ///< changes of the mesh during the run
    std::size_t vertices_last = 0;  ///< at the end
    double seconds = 0;             ///< spent stepping or solving, measuring and writing left out [s]
    double ns_per_vertex_step = 0;  ///< per vertex and sub-step
    std::uint64_t state_hash = 0;
    std::vector<std::string> warnings;
    std::string
        failure;  ///< empty if all went well; else one line: blow-up or no equilibrium, when and where
    bool stopped = false;  ///< by RunOptions::stop
};

/// Simulates a scene and writes summary.json, series.csv, frames/*.vtp, frames.pvd, volume.svg, picture.png,
/// scene.resolved.toml and state.bin (for resuming) into the directory. Every file is whole at any moment,
/// whatever kills the program. Throws InputError for bad input, RunError if a file cannot be written. A
/// blow-up is reported in the summary, with the last good state kept.
Summary run(const Scene& scene, const RunOptions& options);

}  // namespace innerspring
