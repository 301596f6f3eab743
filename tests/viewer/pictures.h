#pragma once
#include <algorithm>
#include <cmath>

#include "innerspring/record/picture.h"

/// Whether a pixel is of the body: the background and the ground's lines are grey, colours and skin are not.
inline bool of_the_body(const innerspring::Image& image, int column, int row) {
    const std::uint8_t* p = &image.rgb[3 * (std::size_t(row) * image.width + column)];
    return std::max({p[0], p[1], p[2]}) - std::min({p[0], p[1], p[2]}) > 16;
}

/// Share of the picture within [0, right) x [top, bottom) that the body covers.
inline double covered(const innerspring::Image& image, int left, int right, int top, int bottom) {
    double count = 0;
    for (int y = top; y < bottom; ++y)
        for (int x = left; x < right; ++x) count += of_the_body(image, x, y);
    return count / (double(right - left) * (bottom - top));
}

/// Mean difference of the channels, 0 .. 255.
inline double difference(const innerspring::Image& a, const innerspring::Image& b) {
    if (a.rgb.size() != b.rgb.size()) return INFINITY;
    double sum = 0;
    for (std::size_t n = 0; n < a.rgb.size(); ++n) sum += std::abs(int(a.rgb[n]) - int(b.rgb[n]));
    return sum / double(a.rgb.size());
}
