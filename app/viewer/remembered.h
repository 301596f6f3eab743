#pragma once
#include <filesystem>
#include <optional>

namespace innerspring::viewer {

/// What the window keeps from one session to the next.
struct Remembered {
    int width = 1280, height = 780;       ///< [point]
    std::optional<int> x, y;              ///< of its upper left corner [point]
    double azimuth = 30, elevation = 20;  ///< of the camera [degree]
    double zoom = 1;                      ///< against the whole body in view
    bool panel = true;
};

/// $XDG_CONFIG_HOME/innerspring/viewer, else ~/.config/innerspring/viewer; nothing if neither is known.
std::optional<std::filesystem::path> remembered_file();
/// What the file says; where it is missing or says nonsense, the defaults.
Remembered recall(const std::filesystem::path& file);
/// Whole or not at all: written beside it, then renamed. Throws RunError.
void remember(const Remembered& remembered, const std::filesystem::path& file);

}  // namespace innerspring::viewer
