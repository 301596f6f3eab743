#include "remembered.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/write.h"

namespace innerspring::viewer {

std::optional<std::filesystem::path> remembered_file() {
    const char* config = std::getenv("XDG_CONFIG_HOME");
    if (config && *config == '/') return std::filesystem::path(config) / "innerspring" / "viewer";
    const char* home = std::getenv("HOME");
    if (home && *home == '/') return std::filesystem::path(home) / ".config" / "innerspring" / "viewer";
    return std::nullopt;
}

Remembered recall(const std::filesystem::path& file) {
    Remembered r;
    std::ifstream in(file);
    std::string key;
    double value = 0;
    while (in >> key >> value) {
        if (!std::isfinite(value)) continue;
        if (key == "width" && value >= 320 && value <= 16384) r.width = int(value);
        if (key == "height" && value >= 240 && value <= 16384) r.height = int(value);
        if (key == "x" && std::abs(value) <= 32768) r.x = int(value);
        if (key == "y" && std::abs(value) <= 32768) r.y = int(value);
        if (key == "zoom" && value >= 0.05 && value <= 20) r.zoom = value;
        if (key == "azimuth") r.azimuth = std::remainder(value, 360.0);
        if (key == "elevation" && std::abs(value) < 90) r.elevation = value;
        if (key == "panel") r.panel = value != 0;
    }
    return r;
}

void remember(const Remembered& r, const std::filesystem::path& file) {
    std::error_code failed;
    std::filesystem::create_directories(file.parent_path(), failed);
    if (failed) throw RunError(fmt::format("{}: {}", file.parent_path().string(), failed.message()));
    std::string text = fmt::format("width {}\nheight {}\nazimuth {}\nelevation {}\nzoom {}\npanel {}\n",
                                   r.width, r.height, r.azimuth, r.elevation, r.zoom, int(r.panel));
    if (r.x && r.y) text += fmt::format("x {}\ny {}\n", *r.x, *r.y);
    write_whole(file, text);
}

}  // namespace innerspring::viewer
