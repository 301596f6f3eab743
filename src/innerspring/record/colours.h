#pragma once
#include <array>
#include <string>
#include <vector>

namespace innerspring {

using Colour = std::array<double, 3>;  ///< red, green, blue, 0..1

/// sRGB of a sequential, perceptually uniform map, dark blue to yellow, lighter all along; t is clamped to
/// 0..1.
Colour map_colour(double t);

/// About five round numbers within [low, high], which must differ.
struct Ticks {
    std::vector<double> values;
    std::vector<std::string> labels;  ///< value / 10^exponent
    int exponent = 0;
};
Ticks round_ticks(double low, double high);

}  // namespace innerspring
