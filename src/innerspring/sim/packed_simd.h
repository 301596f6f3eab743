#pragma once
// The explicit step, once, over the vector operations of an instruction set. Fused multiply-adds and
// approximate roots would not be faster, as the shuffles that transpose the neighbours' rows set the pace
// (docs/performance.md).
#include "innerspring/sim/simd.h"
#include "innerspring/sim/vector_kernels.h"

namespace innerspring {
namespace {

template <class S, bool Volume>
bool advance(const PackedStep& s, std::size_t first, std::size_t last, double* volume) {
    using F = typename S::F;
    const F h = S::all(s.h), one = S::all(1), zero = S::all(0);
    const F tiny = S::all(1e-37f);  // a spring of no length: 0 over this
    const F hg[3] = {S::all(s.hg[0]), S::all(s.hg[1]), S::all(s.hg[2])};
    bool finite = true;
    double sum = 0;
    for (std::size_t slice = first; slice < last; ++slice) {
        const PackedSlot* const slots = s.slots + s.ranges[slice].first;
        const PackedSlot* const end = slots + s.ranges[slice].count;
        for (std::size_t lane = 0; lane < slice_width; lane += S::width) {
            const std::size_t i = slice * slice_width + lane;
            std::uint32_t own[S::width];
            for (std::size_t n = 0; n < S::width; ++n) own[n] = std::uint32_t((i + n) * sizeof(PackedRow));
            F q[3], u[3];
            S::rows(s.in, own, q, u);
            F fx = zero, fy = zero, fz = zero;
            F A = zero, y_first = zero, z_first = zero, y_last = zero, z_last = zero;
            for (const PackedSlot* slot = slots; slot != end; ++slot) {
                F qj[3], uj[3];
                S::rows(s.in, slot->offset + lane, qj, uj);
                const F ex = qj[0] - q[0], ey = qj[1] - q[1], ez = qj[2] - q[2];  // e: d at rest
                const F wx = uj[0] - u[0], wy = uj[1] - u[1], wz = uj[2] - u[2];
                const F dx = ex + wx, dy = ey + wy, dz = ez + wz;
                // k (1 - l/|d|) = k (|d|^2 - l^2) / (|d|^2 + |d| l), and |d|^2 - l^2 = w (e + d): nothing
                // cancels, and at rest the force is 0.
                const F gain = wx * (ex + dx) + wy * (ey + dy) + wz * (ez + dz);
                const F d2 = dx * dx + dy * dy + dz * dz, l2 = ex * ex + ey * ey + ez * ez;
                const F tension = S::load(slot->k + lane) * gain / (d2 + S::root(d2 * l2) + tiny);
                fx = fx + tension * dx, fy = fy + tension * dy, fz = fz + tension * dz;
                if constexpr (Volume) {
                    if (slot == slots)
                        y_first = dy, z_first = dz;
                    else
                        A = A + (y_last * dz - z_last * dy);
                    y_last = dy, z_last = dz;
                }
            }
            if constexpr (Volume) {
                A = A + (y_last * z_first - z_last * y_first);
                float x_A[S::width];
                const F product = (q[0] + u[0]) * A;
                __builtin_memcpy(x_A, &product, sizeof x_A);
                for (float a : x_A) sum += double(a);
            }
            const PackedCoefficients& c = s.coefficients[slice];
            PackedVectors& v = s.v[slice];
            // v' = (v + h (F/m - K/m u + g)) / (1 + h c/m),  u' = u + h v'
            const F h_m = h * S::load(c.inverse_m + lane), hK_m = h * S::load(c.K_m + lane);
            const F damp = one / (one + h * S::load(c.c_m + lane));
            const F vx = (S::load(v.x + lane) + (h_m * fx - hK_m * u[0]) + hg[0]) * damp;
            const F vy = (S::load(v.y + lane) + (h_m * fy - hK_m * u[1]) + hg[1]) * damp;
            const F vz = (S::load(v.z + lane) + (h_m * fz - hK_m * u[2]) + hg[2]) * damp;
            const F x = u[0] + h * vx, y = u[1] + h * vy, z = u[2] + h * vz;
            S::store(v.x + lane, vx), S::store(v.y + lane, vy), S::store(v.z + lane, vz);
            S::put(s.out[i].u, sizeof(PackedRow) / sizeof(float), x, y, z);
            finite &= S::below((vx * vx + vy * vy + vz * vz) + (x * x + y * y + z * z), 1e30f);
        }
    }
    if constexpr (Volume) *volume = sum / 6;
    return finite;
}

template <class S>
bool advance_slices(const PackedStep& step, std::size_t first, std::size_t last, double* volume) {
    return volume ? advance<S, true>(step, first, last, volume)
                  : advance<S, false>(step, first, last, nullptr);
}

}  // namespace
}  // namespace innerspring
