#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

/// A point's place along a curve through space that stays long in small cells (Morton 1966), and its number.
struct CurvePlace {
    std::uint64_t key;
    Index index;
};

/// The lowest 21 bits of n, with two zeros after each.
inline std::uint64_t spread_bits(std::uint64_t n) {
    n = (n | n << 32) & 0x1f00000000ffffu;
    n = (n | n << 16) & 0x1f0000ff0000ffu;
    n = (n | n << 8) & 0x100f00f00f00f00fu;
    n = (n | n << 4) & 0x10c30c30c30c30c3u;
    return (n | n << 2) & 0x1249249249249249u;
}

/// By key, those of one key in the order they had; linear time.
inline void sort_by_key(std::vector<CurvePlace>& places, int key_bits) {
    std::vector<CurvePlace> sorted(places.size());
    for (int shift = 0; shift < key_bits; shift += 8) {
        std::array<std::size_t, 256> next{};
        for (const CurvePlace& p : places) ++next[p.key >> shift & 255];
        std::size_t sum = 0;
        for (std::size_t& n : next) sum += std::exchange(n, sum);
        for (const CurvePlace& p : places) sorted[next[p.key >> shift & 255]++] = p;
        places.swap(sorted);
    }
}

/// The points 0 .. count-1, which must be finite, along the curve. Cells are some sixteenth as wide as points
/// of a surface are apart, up to 2^21 of them to an axis; points in one cell stay in order.
template <class Point>
std::vector<CurvePlace> places_along_curve(std::size_t count, Point point) {
    std::vector<CurvePlace> places(count);
    if (count == 0) return places;
    Vector lower = point(0), upper = lower;
    for (std::size_t n = 1; n < count; ++n) {
        const Vector p = point(n);
        lower = lower.cwiseMin(p), upper = upper.cwiseMax(p);
    }
    const int bits = std::min(21, 4 + int(std::bit_width(count) + 1) / 2);
    // Halves, as the box of finite points may be too wide for a number.
    const double size = (upper / 2 - lower / 2).maxCoeff();
    const double cells = std::ldexp(1.0, bits), scale = size > 1e-250 ? cells / size : 0;
    const auto cell = [&](double x, double low) {
        return std::uint64_t(std::clamp((x / 2 - low / 2) * scale, 0.0, cells - 1));
    };
    for (std::size_t n = 0; n < count; ++n) {
        const Vector p = point(n);
        places[n] = {spread_bits(cell(p[0], lower[0])) << 2 | spread_bits(cell(p[1], lower[1])) << 1 |
                         spread_bits(cell(p[2], lower[2])),
                     Index(n)};
    }
    sort_by_key(places, 3 * bits);
    return places;
}

/// Where the range [first, last) of places falls apart: at the highest bit in which its keys differ; `last`
/// if they are one.
inline std::size_t curve_split(const std::vector<CurvePlace>& places, std::size_t first, std::size_t last) {
    const std::uint64_t differ = places[first].key ^ places[last - 1].key;
    if (differ == 0) return last;
    const std::uint64_t bit = std::bit_floor(differ);
    const auto begin = places.begin() + std::ptrdiff_t(first), end = places.begin() + std::ptrdiff_t(last);
    return std::size_t(
        std::partition_point(begin, end, [bit](const CurvePlace& p) { return !(p.key & bit); }) -
        places.begin());
}

}  // namespace innerspring
