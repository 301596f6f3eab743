#pragma once
#include <nlohmann/json.hpp>

#include "innerspring/study/study.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"

namespace innerspring::support {

/// Few vertices, forces and levels on a small uneven sphere: a whole study in about a second.
inline Scene small_sphere() {
    Scene scene;
    scene.mesh = "sphere:vertices=200";
    return scene;
}

/// Fewer vertices under a sanitizer, which is some fifteen times slower.
inline StudyRun small_study(StudyKind kind, const std::filesystem::path& directory,
                            int vertices = INNERSPRING_SANITIZED ? 2 : 3) {
    StudyRun run;
    run.kind = kind;
    run.options.vertices = vertices;
    run.options.forces = 4;
    run.options.levels = 1;
    run.options.influence_share = 0.6;  // a patch of some twenty vertices of so coarse a mesh
    run.options.region_share = 0.75;
    run.directory = directory;
    run.pictures = false;
    return run;
}

inline nlohmann::json summary(const std::filesystem::path& directory) {
    return nlohmann::json::parse(content(directory / "summary.json"));
}

}  // namespace innerspring::support
