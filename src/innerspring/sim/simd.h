#pragma once
// Vector operations, one struct per instruction set. `load` and `store` are for addresses aligned to the
// vector; `rows` takes rows of eight floats (q, u) apart into x, y and z of each, `put` writes rows of four,
// `stride` floats apart and aligned to 16 bytes; `displace` writes rows (q, u) with something added to u;
// `add` adds floats to doubles, lane by lane. No fused multiply-add and no approximate root or reciprocal:
// every kernel then gives the same bits.
#include <cmath>
#include <cstddef>
#include <cstdint>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "innerspring/sim/vector_kernels.h"

namespace innerspring {
namespace {

inline const float* row_at(const void* rows, std::uint32_t offset) {
    return reinterpret_cast<const float*>(static_cast<const char*>(rows) + offset);
}

/// Plain floats, for any processor.
struct Portable {
    static constexpr std::size_t width = 1;
    using F = float;
    static F all(float a) { return a; }
    static F load(const float* p) { return *p; }
    static void store(float* p, F a) { *p = a; }
    static F root(F a) { return std::sqrt(a); }
    static bool below(F a, float bound) { return a < bound; }
    static void rows(const void* base, const std::uint32_t* offset, F* q, F* u) {
        const float* row = row_at(base, *offset);
        for (int axis = 0; axis < 3; ++axis) q[axis] = row[axis], u[axis] = row[axis + 4];
    }
    static void put(float* out, int, F x, F y, F z) { out[0] = x, out[1] = y, out[2] = z; }
    static void displace(const PackedRow* in, PackedRow* out, F x, F y, F z) {
        out->u[0] = in->u[0] + x, out->u[1] = in->u[1] + y, out->u[2] = in->u[2] + z;
    }
    using Wide = double;
    static void clear(Wide& sum) { sum = 0; }
    static void add(Wide& sum, F a) { sum += double(a); }
};

#if defined(__x86_64__)
struct Sse2 {
    static constexpr std::size_t width = 4;
    using F = __m128;
    static F all(float a) { return _mm_set1_ps(a); }
    static F load(const float* p) { return _mm_load_ps(p); }
    static F load_anywhere(const float* p) { return _mm_loadu_ps(p); }
    static void store(float* p, F a) { _mm_store_ps(p, a); }
    static F root(F a) { return _mm_sqrt_ps(a); }
    static bool below(F a, float bound) { return _mm_movemask_ps(_mm_cmplt_ps(a, all(bound))) == 0xf; }
    /// Four rows to x, y and z of four vertices.
    static void transpose(F a, F b, F c, F d, F* out) {
        const F ab = _mm_unpacklo_ps(a, b), cd = _mm_unpacklo_ps(c, d);
        out[0] = _mm_movelh_ps(ab, cd), out[1] = _mm_movehl_ps(cd, ab);
        out[2] = _mm_movelh_ps(_mm_unpackhi_ps(a, b), _mm_unpackhi_ps(c, d));
    }
    static void rows(const void* base, const std::uint32_t* o, F* q, F* u) {
        const float *a = row_at(base, o[0]), *b = row_at(base, o[1]), *c = row_at(base, o[2]),
                    *d = row_at(base, o[3]);
        transpose(load(a), load(b), load(c), load(d), q);
        transpose(load(a + 4), load(b + 4), load(c + 4), load(d + 4), u);
    }
    static void four_rows(F x, F y, F z, F* row) {
        const F o = _mm_setzero_ps(), xy = _mm_unpacklo_ps(x, y), zo = _mm_unpacklo_ps(z, o);
        const F xy_high = _mm_unpackhi_ps(x, y), zo_high = _mm_unpackhi_ps(z, o);
        row[0] = _mm_movelh_ps(xy, zo), row[1] = _mm_movehl_ps(zo, xy);
        row[2] = _mm_movelh_ps(xy_high, zo_high), row[3] = _mm_movehl_ps(zo_high, xy_high);
    }
    static void put(float* out, int stride, F x, F y, F z) {
        F row[4];
        four_rows(x, y, z, row);
        for (int n = 0; n < 4; ++n) store(out + n * stride, row[n]);
    }
    static void displace(const PackedRow* in, PackedRow* out, F x, F y, F z) {
        F row[4];
        four_rows(x, y, z, row);
        for (int n = 0; n < 4; ++n) store(out[n].u, load(in[n].u) + row[n]);
    }
    struct Wide {
        __m128d low, high;
    };
    static void clear(Wide& sum) { sum.low = sum.high = _mm_setzero_pd(); }
    static void add(Wide& sum, F a) {
        sum.low = sum.low + _mm_cvtps_pd(a), sum.high = sum.high + _mm_cvtps_pd(_mm_movehl_ps(a, a));
    }
};
#endif

#if defined(__AVX2__)
struct Avx2 {
    static constexpr std::size_t width = 8;
    using F = __m256;
    static F all(float a) { return _mm256_set1_ps(a); }
    static F load(const float* p) { return _mm256_load_ps(p); }
    static F load_anywhere(const float* p) { return _mm256_loadu_ps(p); }
    static void store(float* p, F a) { _mm256_store_ps(p, a); }
    static F root(F a) { return _mm256_sqrt_ps(a); }
    static bool below(F a, float bound) {
        return _mm256_movemask_ps(_mm256_cmp_ps(a, all(bound), _CMP_LT_OQ)) == 0xff;
    }
    static F low(F a, F b) {
        return _mm256_castpd_ps(_mm256_unpacklo_pd(_mm256_castps_pd(a), _mm256_castps_pd(b)));
    }
    static F high(F a, F b) {
        return _mm256_castpd_ps(_mm256_unpackhi_pd(_mm256_castps_pd(a), _mm256_castps_pd(b)));
    }
    /// In each half, four rows to x, y and z.
    static void transpose(F a, F b, F c, F d, F* out) {
        const F ab = _mm256_unpacklo_ps(a, b), cd = _mm256_unpacklo_ps(c, d);
        out[0] = low(ab, cd), out[1] = high(ab, cd);
        out[2] = low(_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
    }
    static F pair(const float* a, const float* b) {
        return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(a)), _mm_load_ps(b), 1);
    }
    static void rows(const void* base, const std::uint32_t* o, F* q, F* u) {
        const float* r[8];
        for (int n = 0; n < 8; ++n) r[n] = row_at(base, o[n]);
        transpose(pair(r[0], r[4]), pair(r[1], r[5]), pair(r[2], r[6]), pair(r[3], r[7]), q);
        transpose(pair(r[0] + 4, r[4] + 4), pair(r[1] + 4, r[5] + 4), pair(r[2] + 4, r[6] + 4),
                  pair(r[3] + 4, r[7] + 4), u);
    }
    static void four_rows(F x, F y, F z, F* row) {
        const F o = _mm256_setzero_ps(), xy = _mm256_unpacklo_ps(x, y), zo = _mm256_unpacklo_ps(z, o);
        const F xy_high = _mm256_unpackhi_ps(x, y), zo_high = _mm256_unpackhi_ps(z, o);
        row[0] = low(xy, zo), row[1] = high(xy, zo), row[2] = low(xy_high, zo_high),
        row[3] = high(xy_high, zo_high);
    }
    static void put(float* out, int stride, F x, F y, F z) {
        F row[4];
        four_rows(x, y, z, row);
        for (int n = 0; n < 4; ++n) {
            _mm_store_ps(out + n * stride, _mm256_castps256_ps128(row[n]));
            _mm_store_ps(out + (n + 4) * stride, _mm256_extractf128_ps(row[n], 1));
        }
    }
    static void displace(const PackedRow* in, PackedRow* out, F x, F y, F z) {
        F row[4];
        four_rows(x, y, z, row);
        for (int n = 0; n < 4; ++n) {
            _mm_store_ps(out[n].u, _mm_load_ps(in[n].u) + _mm256_castps256_ps128(row[n]));
            _mm_store_ps(out[n + 4].u, _mm_load_ps(in[n + 4].u) + _mm256_extractf128_ps(row[n], 1));
        }
    }
    struct Wide {
        __m256d low, high;
    };
    static void clear(Wide& sum) { sum.low = sum.high = _mm256_setzero_pd(); }
    static void add(Wide& sum, F a) {
        sum.low = sum.low + _mm256_cvtps_pd(_mm256_castps256_ps128(a));
        sum.high = sum.high + _mm256_cvtps_pd(_mm256_extractf128_ps(a, 1));
    }
};
#endif

#if defined(__AVX512F__) && defined(__AVX512DQ__)
struct Avx512 {
    static constexpr std::size_t width = 16;
    using F = __m512;
    static F all(float a) { return _mm512_set1_ps(a); }
    static F load(const float* p) { return _mm512_load_ps(p); }
    static F load_anywhere(const float* p) { return _mm512_loadu_ps(p); }
    static void store(float* p, F a) { _mm512_store_ps(p, a); }
    static F root(F a) { return _mm512_sqrt_ps(a); }
    static bool below(F a, float bound) { return _mm512_cmp_ps_mask(a, all(bound), _CMP_LT_OQ) == 0xffff; }
    static F low(F a, F b) {
        return _mm512_castpd_ps(_mm512_unpacklo_pd(_mm512_castps_pd(a), _mm512_castps_pd(b)));
    }
    static F high(F a, F b) {
        return _mm512_castpd_ps(_mm512_unpackhi_pd(_mm512_castps_pd(a), _mm512_castps_pd(b)));
    }
    /// In each quarter, four rows to x, y and z.
    static void transpose(F a, F b, F c, F d, F* out) {
        const F ab = _mm512_unpacklo_ps(a, b), cd = _mm512_unpacklo_ps(c, d);
        out[0] = low(ab, cd), out[1] = high(ab, cd);
        out[2] = low(_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d));
    }
    static F pair(const float* a, const float* b) {
        return _mm512_insertf32x8(_mm512_castps256_ps512(_mm256_load_ps(a)), _mm256_load_ps(b), 1);
    }
    /// A whole row is half a vector. With rows n and n + 4 in one, the quarters hold q and u in turn, and two
    /// shuffles bring them apart with the vertices in order.
    static void rows(const void* base, const std::uint32_t* o, F* q, F* u) {
        const float* r[16];
        for (int n = 0; n < 16; ++n) r[n] = row_at(base, o[n]);
        F a[3], b[3];
        transpose(pair(r[0], r[4]), pair(r[1], r[5]), pair(r[2], r[6]), pair(r[3], r[7]), a);
        transpose(pair(r[8], r[12]), pair(r[9], r[13]), pair(r[10], r[14]), pair(r[11], r[15]), b);
        for (int axis = 0; axis < 3; ++axis) {
            q[axis] = _mm512_shuffle_f32x4(a[axis], b[axis], 0x88);
            u[axis] = _mm512_shuffle_f32x4(a[axis], b[axis], 0xdd);
        }
    }
    static void four_rows(F x, F y, F z, F* row) {
        const F o = _mm512_setzero_ps(), xy = _mm512_unpacklo_ps(x, y), zo = _mm512_unpacklo_ps(z, o);
        const F xy_high = _mm512_unpackhi_ps(x, y), zo_high = _mm512_unpackhi_ps(z, o);
        row[0] = low(xy, zo), row[1] = high(xy, zo), row[2] = low(xy_high, zo_high),
        row[3] = high(xy_high, zo_high);
    }
    static void put(float* out, int stride, F x, F y, F z) {
        F row[4];
        four_rows(x, y, z, row);
        for (int n = 0; n < 4; ++n) {
            _mm_store_ps(out + n * stride, _mm512_castps512_ps128(row[n]));
            _mm_store_ps(out + (n + 4) * stride, _mm512_extractf32x4_ps(row[n], 1));
            _mm_store_ps(out + (n + 8) * stride, _mm512_extractf32x4_ps(row[n], 2));
            _mm_store_ps(out + (n + 12) * stride, _mm512_extractf32x4_ps(row[n], 3));
        }
    }
    /// Two rows are a vector, q and u in turn.
    template <int quarter>
    static void displace(const PackedRow* in, PackedRow* out, const F* row) {
        constexpr int both = quarter * 0x55, n = 4 * quarter;
        const F a = load(in[n].q), b = load(in[n + 2].q);
        store(out[n].q, _mm512_mask_add_ps(a, 0xf0f0, a, _mm512_shuffle_f32x4(row[0], row[1], both)));
        store(out[n + 2].q, _mm512_mask_add_ps(b, 0xf0f0, b, _mm512_shuffle_f32x4(row[2], row[3], both)));
    }
    static void displace(const PackedRow* in, PackedRow* out, F x, F y, F z) {
        F row[4];
        four_rows(x, y, z, row);
        displace<0>(in, out, row), displace<1>(in, out, row);
        displace<2>(in, out, row), displace<3>(in, out, row);
    }
    struct Wide {
        __m512d low, high;
    };
    static void clear(Wide& sum) { sum.low = sum.high = _mm512_setzero_pd(); }
    static void add(Wide& sum, F a) {
        sum.low = sum.low + _mm512_cvtps_pd(_mm512_castps512_ps256(a));
        sum.high = sum.high + _mm512_cvtps_pd(_mm512_extractf32x8_ps(a, 1));
    }
};
#endif

}  // namespace
}  // namespace innerspring
