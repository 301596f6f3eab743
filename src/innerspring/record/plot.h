#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace innerspring {

struct Curve {
    std::string label;
    std::vector<double> x, y;
};

struct Plot {
    std::string title, x_label, y_label;  ///< labels with units
    std::vector<Curve> curves;
    bool log_x = false, log_y = false;
};

/// Draws with gnuplot (run as a program) into an SVG, written whole or not at all. Returns an empty string,
/// or one line saying why there is no plot (gnuplot missing or failing): a missing picture does not fail a
/// run.
std::string write_svg(const Plot& plot, const std::filesystem::path& file);

}  // namespace innerspring
