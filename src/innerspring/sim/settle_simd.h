#pragma once
// Net::settle over the vectors of an instruction set, eight vertices side by side that are no neighbours. The
// operations and their order are the same for every width: the same bits from all.
#include <algorithm>
#include <cmath>
#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include "innerspring/sim/vector_kernels.h"

namespace innerspring {
namespace {

/// Operations on doubles, `width` at a time. `of` picks one number of each of several vertices.
struct OneDouble {
    static constexpr std::size_t width = 1;
    using D = double;
    static D all(double a) { return a; }
    static D load(const double* p) { return *p; }
    static void store(double* p, D a) { *p = a; }
    static D of(const double* x, const std::uint32_t* offset) { return x[*offset]; }
    static D above_zero(D a) { return a > 0 ? a : 0; }
    /// 1 / sqrt(a), 0 unless a > 0.
    static D inverse_root(D a) { return a > 0 ? 1 / std::sqrt(a) : 0; }
};

#if defined(__AVX2__)
struct FourDoubles {
    static constexpr std::size_t width = 4;
    using D = __m256d;
    static D all(double a) { return _mm256_set1_pd(a); }
    static D load(const double* p) { return _mm256_loadu_pd(p); }
    static void store(double* p, D a) { _mm256_storeu_pd(p, a); }
    static D of(const double* x, const std::uint32_t* o) {
        return _mm256_set_pd(x[o[3]], x[o[2]], x[o[1]], x[o[0]]);
    }
    static D above_zero(D a) { return _mm256_max_pd(a, _mm256_setzero_pd()); }
    static D inverse_root(D a) {
        return _mm256_and_pd(_mm256_div_pd(all(1), _mm256_sqrt_pd(a)),
                             _mm256_cmp_pd(a, _mm256_setzero_pd(), _CMP_GT_OQ));
    }
};
#endif

#if defined(__AVX512F__) && defined(__AVX512DQ__)
struct EightDoubles {
    static constexpr std::size_t width = 8;
    using D = __m512d;
    static D all(double a) { return _mm512_set1_pd(a); }
    static D load(const double* p) { return _mm512_loadu_pd(p); }
    static void store(double* p, D a) { _mm512_storeu_pd(p, a); }
    static D of(const double* x, const std::uint32_t* offset) {
        const __m256i o = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(offset));
        return _mm512_i32gather_pd(o, x, 8);
    }
    static D above_zero(D a) { return _mm512_max_pd(a, _mm512_setzero_pd()); }
    static D inverse_root(D a) {
        return _mm512_maskz_div_pd(_mm512_cmp_pd_mask(a, _mm512_setzero_pd(), _CMP_GT_OQ), all(1),
                                   _mm512_sqrt_pd(a));
    }
};
#endif

/// Each vertex takes a Newton step towards the least energy of its own springs, with those pressed taken for
/// slack across: x -= H^-1 g,
///     g = d (x - z) + sum s (x - x_j), s = k (1 - l/|x - x_j|),
///     H = d + sum max(0, s) (I - u u^T) + k u u^T, u along the spring.
template <class V>
void settle_groups(const SettlePass& p, std::size_t first, std::size_t last) {
    using D = typename V::D;
    for (std::size_t n = first; n < last; ++n)
        for (std::size_t lane = 0; lane < p.groups[n].vertices; lane += V::width) {
            const SettleGroup& group = p.groups[n];
            const std::uint32_t* own = group.offset + lane;
            const D x = V::of(p.x, own), y = V::of(p.x + 1, own), z = V::of(p.x + 2, own),
                    d = V::load(group.d + lane);
            D gx = d * (x - V::load(group.z[0] + lane)), gy = d * (y - V::load(group.z[1] + lane)),
              gz = d * (z - V::load(group.z[2] + lane));
            D across = d, xx = V::all(0), xy = xx, xz = xx, yy = xx, yz = xx, zz = xx;
            for (const SettleSlot *slot = p.slots + group.first, *end = slot + group.count; slot != end;
                 ++slot) {
                const std::uint32_t* other = slot->offset + lane;
                const D bx = x - V::of(p.x, other), by = y - V::of(p.x + 1, other),
                        bz = z - V::of(p.x + 2, other);
                const D inverse = V::inverse_root((bx * bx + by * by) + bz * bz), k = V::load(slot->k + lane),
                        s = k * (V::all(1) - V::load(slot->rest + lane) * inverse), taut = V::above_zero(s),
                        along = (k - taut) * inverse * inverse;
                gx = gx + s * bx, gy = gy + s * by, gz = gz + s * bz;
                across = across + taut;
                const D ux = along * bx, uy = along * by, uz = along * bz;
                xx = xx + ux * bx, xy = xy + ux * by, xz = xz + ux * bz;
                yy = yy + uy * by, yz = yz + uy * bz, zz = zz + uz * bz;
            }
            xx = xx + across, yy = yy + across, zz = zz + across;
            // By the adjugate.
            const D a = yy * zz - yz * yz, b = xz * yz - xy * zz, c = xy * yz - xz * yy;
            const D e = xx * zz - xz * xz, f = xy * xz - xx * yz, i = xx * yy - xy * xy;
            const D by_det = V::all(1) / ((xx * a + xy * b) + xz * c);
            double to[3][V::width];
            V::store(to[0], x - ((a * gx + b * gy) + c * gz) * by_det);
            V::store(to[1], y - ((b * gx + e * gy) + f * gz) * by_det);
            V::store(to[2], z - ((c * gx + f * gy) + i * gz) * by_det);
            for (std::size_t m = 0; m < std::min<std::size_t>(V::width, group.vertices - lane); ++m)
                for (std::size_t axis = 0; axis < 3; ++axis) p.x[own[m] + axis] = to[axis][m];
        }
}

}  // namespace
}  // namespace innerspring
