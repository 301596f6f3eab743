#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace innerspring {

struct Curve {
    std::string label;
    std::vector<double> x, y;
    int colour = 0;  ///< 1 .. 7 (blue, orange, green, pink, amber, sky, black); 0: the next one
    int dash = 0;    ///< 1: solid, 2 .. 5: dashed; 0: solid until the colours are used up
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

/// The same as PNG, 1600 x 960 pixels, for papers and screens.
std::string write_png(const Plot& plot, const std::filesystem::path& file);

}  // namespace innerspring
