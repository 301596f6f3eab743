#pragma once
// The passes of Net::evaluate and Net::multiply, plain and with four doubles at a time. Every sum goes in the
// order of the plain ones: the same bits from both.
#include <cmath>
#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include "innerspring/sim/vector_kernels.h"

namespace innerspring {
namespace {

/// One spring: s = k (1 - l/|d|); returns k (|d| - l)^2. A spring of no length has no direction: no force.
inline double stretch_one(const NetPass& p, std::size_t e) {
    const double *a = p.x + 3 * std::size_t(p.ends[2 * e]), *b = p.x + 3 * std::size_t(p.ends[2 * e + 1]);
    const double x = b[0] - a[0], y = b[1] - a[1], z = b[2] - a[2];
    const double square = (x * x + y * y) + z * z;
    const double length = square > 0 ? std::sqrt(square) : p.rest[e];
    const double by = length - p.rest[e], pull = p.k[e] * by;
    p.s[e] = pull / length;
    return pull * by;
}

inline double stretch_plain(const NetPass& p, std::size_t first, std::size_t last) {
    double sum[4] = {0, 0, 0, 0};
    for (std::size_t e = first; e < last; ++e) sum[(e - first) % 4] += stretch_one(p, e);
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

inline void pull_plain(const NetPass& p, std::size_t first, std::size_t last, NetSums& sums) {
    for (std::size_t i = first; i < last; ++i)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double x = p.x[3 * i + axis], from = x - p.z[3 * i + axis], own = p.d[i] * from;
            double f = own;
            for (const NetSpoke *spoke = p.spokes + p.rows[i].first, *end = spoke + p.rows[i].count;
                 spoke != end; ++spoke)
                f += p.s[spoke->edge] * (x - p.x[3 * std::size_t(spoke->neighbour) + axis]);
            p.g[3 * i + axis] = f;
            sums.places[axis] += own * from, sums.gradient2[axis] += f * f;
        }
}

inline void tangent_plain(const TangentPass& t, std::size_t first, std::size_t last, double* sums) {
    for (std::size_t i = first; i < last; ++i) {
        const double* p = t.p + 3 * i;
        double f[3] = {t.d[i] * p[0], t.d[i] * p[1], t.d[i] * p[2]};
        for (const NetSpoke *spoke = t.spokes + t.rows[i].first, *end = spoke + t.rows[i].count; spoke != end;
             ++spoke) {
            const double *u = t.edges + 4 * std::size_t(spoke->edge),
                         *n = t.p + 3 * std::size_t(spoke->neighbour);
            const double by[3] = {p[0] - n[0], p[1] - n[1], p[2] - n[2]};
            const double along = (u[0] * by[0] + u[1] * by[1]) + u[2] * by[2];
            for (int axis = 0; axis < 3; ++axis) f[axis] += u[3] * by[axis] + along * u[axis];
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            t.q[3 * i + axis] = f[axis];
            sums[axis] += p[axis] * f[axis];
        }
    }
}

#if defined(__AVX2__)
/// x, y, z and 0; nothing past the third is touched.
inline __m256d load_three(const double* p) {
    return _mm256_maskload_pd(p, _mm256_set_epi64x(0, -1, -1, -1));
}
inline void store_three(double* p, __m256d v) {
    _mm_storeu_pd(p, _mm256_castpd256_pd128(v));
    _mm_store_sd(p + 2, _mm256_extractf128_pd(v, 1));
}

double stretch_avx2(const NetPass& p, std::size_t first, std::size_t last) {
    __m256d sum = _mm256_setzero_pd();
    const auto square = [&](std::size_t e) {
        const __m256d d = _mm256_sub_pd(load_three(p.x + 3 * std::size_t(p.ends[2 * e + 1])),
                                        load_three(p.x + 3 * std::size_t(p.ends[2 * e])));
        return _mm256_mul_pd(d, d);
    };
    std::size_t e = first;
    for (; e + 4 <= last; e += 4) {
        const __m256d ab = _mm256_hadd_pd(square(e), square(e + 1)),
                      cd = _mm256_hadd_pd(square(e + 2), square(e + 3));
        const __m256d l2 =
            _mm256_add_pd(_mm256_permute2f128_pd(ab, cd, 0x20), _mm256_permute2f128_pd(ab, cd, 0x31));
        const __m256d rest = _mm256_loadu_pd(p.rest + e);
        const __m256d length =
            _mm256_blendv_pd(rest, _mm256_sqrt_pd(l2), _mm256_cmp_pd(l2, _mm256_setzero_pd(), _CMP_GT_OQ));
        const __m256d by = _mm256_sub_pd(length, rest), pull = _mm256_mul_pd(_mm256_loadu_pd(p.k + e), by);
        _mm256_storeu_pd(p.s + e, _mm256_div_pd(pull, length));
        sum = _mm256_add_pd(sum, _mm256_mul_pd(pull, by));
    }
    double lane[4];
    _mm256_storeu_pd(lane, sum);
    for (; e < last; ++e) lane[(e - first) % 4] += stretch_one(p, e);
    return (lane[0] + lane[1]) + (lane[2] + lane[3]);
}

void pull_avx2(const NetPass& p, std::size_t first, std::size_t last, NetSums& sums) {
    __m256d places = load_three(sums.places), gradient2 = load_three(sums.gradient2);
    for (std::size_t i = first; i < last; ++i) {
        const __m256d x = load_three(p.x + 3 * i), from = _mm256_sub_pd(x, load_three(p.z + 3 * i));
        const __m256d own = _mm256_mul_pd(_mm256_broadcast_sd(p.d + i), from);
        __m256d f = own;
        for (const NetSpoke *spoke = p.spokes + p.rows[i].first, *end = spoke + p.rows[i].count; spoke != end;
             ++spoke)
            f = _mm256_add_pd(
                f, _mm256_mul_pd(_mm256_broadcast_sd(p.s + spoke->edge),
                                 _mm256_sub_pd(x, load_three(p.x + 3 * std::size_t(spoke->neighbour)))));
        store_three(p.g + 3 * i, f);
        places = _mm256_add_pd(places, _mm256_mul_pd(own, from));
        gradient2 = _mm256_add_pd(gradient2, _mm256_mul_pd(f, f));
    }
    store_three(sums.places, places), store_three(sums.gradient2, gradient2);
}

void tangent_avx2(const TangentPass& t, std::size_t first, std::size_t last, double* sums) {
    __m256d sum = load_three(sums);
    for (std::size_t i = first; i < last; ++i) {
        const __m256d p = load_three(t.p + 3 * i);
        __m256d f = _mm256_mul_pd(_mm256_broadcast_sd(t.d + i), p);
        for (const NetSpoke *spoke = t.spokes + t.rows[i].first, *end = spoke + t.rows[i].count; spoke != end;
             ++spoke) {
            const __m256d u = _mm256_loadu_pd(t.edges + 4 * std::size_t(spoke->edge));
            const __m256d by = _mm256_sub_pd(p, load_three(t.p + 3 * std::size_t(spoke->neighbour)));
            // (x + y, x + y, z + 0, z + 0), and the halves together
            const __m256d product = _mm256_mul_pd(u, by), half = _mm256_hadd_pd(product, product);
            const __m256d along = _mm256_add_pd(half, _mm256_permute2f128_pd(half, half, 1));
            f = _mm256_add_pd(
                f, _mm256_add_pd(_mm256_mul_pd(_mm256_permute4x64_pd(u, 0xff), by), _mm256_mul_pd(along, u)));
        }
        store_three(t.q + 3 * i, f);
        sum = _mm256_add_pd(sum, _mm256_mul_pd(p, f));
    }
    store_three(sums, sum);
}
#endif

}  // namespace
}  // namespace innerspring
