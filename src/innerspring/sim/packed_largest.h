#pragma once
#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "innerspring/sim/packed.h"

namespace innerspring {

/// The largest squares of displacement and speed of the slices looked at, four vertices at a time where the
/// processor can; what is no number is left out. The largest of numbers is the same in any order.
struct LargestSquares {
#if defined(__x86_64__)
    __m128 u2 = _mm_setzero_ps(), v2 = _mm_setzero_ps();

    static __m128 squares(__m128 x, __m128 y, __m128 z) {
        return _mm_add_ps(_mm_add_ps(_mm_mul_ps(x, x), _mm_mul_ps(y, y)), _mm_mul_ps(z, z));
    }
    void look_at(const Packed& p, std::size_t slice) {
        const PackedRow* row = &p.rows[0][slice * slice_width];
        const PackedVectors& v = p.v[slice];
        for (std::size_t lane = 0; lane < slice_width; lane += 4, row += 4) {
            __m128 x = _mm_load_ps(row[0].u), y = _mm_load_ps(row[1].u), z = _mm_load_ps(row[2].u),
                   o = _mm_load_ps(row[3].u);
            _MM_TRANSPOSE4_PS(x, y, z, o);
            u2 = _mm_max_ps(squares(x, y, z), u2);
            v2 = _mm_max_ps(
                squares(_mm_load_ps(v.x + lane), _mm_load_ps(v.y + lane), _mm_load_ps(v.z + lane)), v2);
        }
    }
    static float largest(__m128 a) {
        alignas(16) float lanes[4];
        _mm_store_ps(lanes, a);
        return std::max(std::max(lanes[0], lanes[1]), std::max(lanes[2], lanes[3]));
    }
    std::array<float, 2> largest() const {
        return {largest(u2), largest(v2)};
    }
#else
    float u2 = 0, v2 = 0;

    static float squares(float x, float y, float z) {
        return x * x + y * y + z * z;
    }
    void look_at(const Packed& p, std::size_t slice) {
        const PackedVectors& v = p.v[slice];
        for (std::size_t lane = 0; lane < slice_width; ++lane) {
            const float* u = p.rows[0][slice * slice_width + lane].u;
            u2 = std::max(u2, squares(u[0], u[1], u[2]));
            v2 = std::max(v2, squares(v.x[lane], v.y[lane], v.z[lane]));
        }
    }
    std::array<float, 2> largest() const {
        return {u2, v2};
    }
#endif
};

}  // namespace innerspring
