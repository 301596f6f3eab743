#include "innerspring/record/colours.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace innerspring {

Colour map_colour(double t) {
    // Viridis at ninths; the first two points raised a little, so that shading still shows on them.
    constexpr double points[10][3] = {{74, 16, 98},   {74, 48, 126},  {62, 74, 137},  {49, 104, 142},
                                      {38, 130, 142}, {31, 158, 137}, {53, 183, 121}, {109, 205, 89},
                                      {180, 222, 44}, {253, 231, 37}};
    const double s = 9 * std::clamp(t, 0.0, 1.0);
    const int i = std::min(8, static_cast<int>(s));
    Colour colour{};
    for (int k = 0; k < 3; ++k)
        colour[k] = (points[i][k] + (s - i) * (points[i + 1][k] - points[i][k])) / 255;
    return colour;
}

Ticks round_ticks(double low, double high) {
    const int magnitude = static_cast<int>(std::floor(std::log10(high - low)));
    double step = 0, best = 1000, widest = 0;
    for (int power = magnitude - 1; power <= magnitude; ++power) {
        for (const double digit : {1.0, 2.0, 2.5, 5.0}) {
            const double candidate = digit * std::pow(10.0, power);
            const double gaps = std::floor(high / candidate + 1e-9) - std::ceil(low / candidate - 1e-9);
            const double off = std::abs(gaps - 4), span = gaps * candidate;
            // Of two as near to five ticks the one that reaches farther.
            if (off < best || (off == best && span > widest)) best = off, widest = span, step = candidate;
        }
    }
    Ticks ticks;
    if (!(step > 0)) return ticks;

    const int largest =
        static_cast<int>(std::floor(std::log10(std::max(std::abs(low), std::abs(high))) + 1e-9));
    if (largest >= 4 || largest < -2) ticks.exponent = 3 * static_cast<int>(std::floor(largest / 3.0));
    const double unit = std::pow(10.0, ticks.exponent);
    int decimals = 0;
    while (decimals < 12) {
        const double digits = step / unit * std::pow(10.0, decimals);
        if (digits > 0.5 && std::abs(digits - std::round(digits)) < 1e-6 * digits) break;
        ++decimals;
    }
    const double first = std::ceil(low / step - 1e-9);
    for (double i = first; i <= std::floor(high / step + 1e-9); ++i) {
        ticks.values.push_back(i * step);
        ticks.labels.push_back(fmt::format("{:.{}f}", i == 0 ? 0.0 : i * step / unit, decimals));
    }
    return ticks;
}

}  // namespace innerspring
