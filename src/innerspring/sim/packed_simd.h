#pragma once
// The explicit step, once, over the vector operations of an instruction set. Fused multiply-adds and
// approximate roots would not be faster, as the shuffles that transpose the neighbours' rows set the pace
// (docs/performance.md).
#include "innerspring/sim/simd.h"
#include "innerspring/sim/vector_kernels.h"

namespace innerspring {
namespace {

enum class Sums { none, volume, pressure };

/// 6 a_i of a slice's vertices as the fan goes by, or its x component.
template <class S, Sums sums>
struct Fan {
    using F = typename S::F;
    F x, y, z;  ///< 6 a_i
    F first[3], last[3];

    Fan() : x(S::all(0)), y(x), z(x), first{x, x, x}, last{x, x, x} {}
    void cross(F dx, F dy, F dz) {
        if constexpr (sums == Sums::pressure) {
            y = y + (last[2] * dx - last[0] * dz);
            z = z + (last[0] * dy - last[1] * dx);
        }
        x = x + (last[1] * dz - last[2] * dy);
    }
    void next(bool begins, F dx, F dy, F dz) {
        if (begins)
            first[0] = dx, first[1] = dy, first[2] = dz;
        else
            cross(dx, dy, dz);
        last[0] = dx, last[1] = dy, last[2] = dz;
    }
    void close() { cross(first[0], first[1], first[2]); }
    /// 18 times the vertices' share of Eq. 4, one after the other.
    void add_volume(const F* q, const F* u, double& sum) const {
        float share[S::width];
        F product = (q[0] + u[0]) * x;
        if constexpr (sums == Sums::pressure)
            product = product + (q[1] + u[1]) * y + (q[2] + u[2]) * z;
        else
            product = S::all(3) * product;
        __builtin_memcpy(share, &product, sizeof share);
        for (float s : share) sum += double(s);
    }
};

/// Sums per lane of a slice, in single precision; a block is short.
template <class S>
struct LaneSums {
    typename S::F lanes[slice_width / S::width];
    LaneSums() {
        for (auto& l : lanes) l = S::all(0);
    }
    double total() const {
        float all[slice_width];
        __builtin_memcpy(all, lanes, sizeof all);
        double sum = 0;
        for (float a : all) sum += double(a);
        return sum;
    }
};

template <class S>
void own_rows(std::size_t i, std::uint32_t* own) {
    for (std::size_t n = 0; n < S::width; ++n) own[n] = std::uint32_t((i + n) * sizeof(PackedRow));
}

/// h times the pull of the inner springs on displacements u, over the masses.
template <class S, bool anisotropic>
void inner_pull(const PackedStep& s, std::size_t slice, std::size_t lane, typename S::F h,
                const typename S::F* u, typename S::F* pull) {
    using F = typename S::F;
    if constexpr (anisotropic) {
        const PackedStiffness& K = s.stiffness[slice];
        const F xy = S::load(K.xy + lane), xz = S::load(K.xz + lane), yz = S::load(K.yz + lane);
        pull[0] = h * (S::load(K.xx + lane) * u[0] + xy * u[1] + xz * u[2]);
        pull[1] = h * (xy * u[0] + S::load(K.yy + lane) * u[1] + yz * u[2]);
        pull[2] = h * (xz * u[0] + yz * u[1] + S::load(K.zz + lane) * u[2]);
    } else {
        const F hK_m = h * S::load(s.coefficients[slice].K_m + lane);
        for (int axis = 0; axis < 3; ++axis) pull[axis] = hK_m * u[axis];
    }
}

template <class S, Sums sums, bool anisotropic>
bool advance(const PackedStep& s, std::size_t first, std::size_t last, PackedSums* result) {
    using F = typename S::F;
    const F h = S::all(s.h), one = S::all(1), zero = S::all(0);
    const F tiny = S::all(1e-37f);  // a spring of no length: 0 over this
    const F hg[3] = {S::all(s.hg[0]), S::all(s.hg[1]), S::all(s.hg[2])};
    bool finite = true;
    double volume = 0;
    LaneSums<S> flow, give;
    for (std::size_t slice = first; slice < last; ++slice) {
        const PackedSlot* const slots = s.slots + s.ranges[slice].first;
        const PackedSlot* const end = slots + s.ranges[slice].count;
        for (std::size_t lane = 0; lane < slice_width; lane += S::width) {
            const std::size_t i = slice * slice_width + lane;
            std::uint32_t own[S::width];
            own_rows<S>(i, own);
            F q[3], u[3];
            S::rows(s.in, own, q, u);
            F fx = zero, fy = zero, fz = zero;
            Fan<S, sums> fan;
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
                if constexpr (sums != Sums::none) fan.next(slot == slots, dx, dy, dz);
            }
            if constexpr (sums != Sums::none) {
                fan.close();
                fan.add_volume(q, u, volume);
            }
            const PackedCoefficients& c = s.coefficients[slice];
            PackedVectors& v = s.v[slice];
            // v' = (v + h (F/m - K/m u + g)) / (1 + h c/m),  u' = u + h v'
            const F inverse_m = S::load(c.inverse_m + lane);
            const F h_m = h * inverse_m;
            F pull[3];
            inner_pull<S, anisotropic>(s, slice, lane, h, u, pull);
            const F damp = one / (one + h * S::load(c.c_m + lane));
            const F vx = (S::load(v.x + lane) + (h_m * fx - pull[0]) + hg[0]) * damp;
            const F vy = (S::load(v.y + lane) + (h_m * fy - pull[1]) + hg[1]) * damp;
            const F vz = (S::load(v.z + lane) + (h_m * fz - pull[2]) + hg[2]) * damp;
            const F x = u[0] + h * vx, y = u[1] + h * vy, z = u[2] + h * vz;
            S::store(v.x + lane, vx), S::store(v.y + lane, vy), S::store(v.z + lane, vz);
            S::put(s.out[i].u, sizeof(PackedRow) / sizeof(float), x, y, z);
            finite &= S::below((vx * vx + vy * vy + vz * vz) + (x * x + y * y + z * z), 1e30f);
            if constexpr (sums == Sums::pressure) {
                PackedVectors& area = s.area[slice];
                S::store(area.x + lane, fan.x), S::store(area.y + lane, fan.y),
                    S::store(area.z + lane, fan.z);
                F& f = flow.lanes[lane / S::width];
                F& g = give.lanes[lane / S::width];
                f = f + (fan.x * vx + fan.y * vy + fan.z * vz);
                g = g + (fan.x * fan.x + fan.y * fan.y + fan.z * fan.z) * (inverse_m * damp);
            }
        }
    }
    if constexpr (sums != Sums::none) result->volume = volume / 18;
    if constexpr (sums == Sums::pressure) result->flow = flow.total(), result->give = give.total();
    return finite;
}

template <class S>
double volume_of_slices(const PackedStep& s, std::size_t first, std::size_t last) {
    using F = typename S::F;
    double volume = 0;
    for (std::size_t slice = first; slice < last; ++slice) {
        const PackedSlot* const slots = s.slots + s.ranges[slice].first;
        const PackedSlot* const end = slots + s.ranges[slice].count;
        for (std::size_t lane = 0; lane < slice_width; lane += S::width) {
            std::uint32_t own[S::width];
            own_rows<S>(slice * slice_width + lane, own);
            F q[3], u[3];
            S::rows(s.in, own, q, u);
            Fan<S, Sums::pressure> fan;
            for (const PackedSlot* slot = slots; slot != end; ++slot) {
                F qj[3], uj[3];
                S::rows(s.in, slot->offset + lane, qj, uj);
                fan.next(slot == slots, (qj[0] - q[0]) + (uj[0] - u[0]), (qj[1] - q[1]) + (uj[1] - u[1]),
                         (qj[2] - q[2]) + (uj[2] - u[2]));
            }
            fan.close();
            fan.add_volume(q, u, volume);
        }
    }
    return volume / 18;
}

template <class S>
bool press_slices(const PackedPress& s, std::size_t first, std::size_t last) {
    using F = typename S::F;
    const F h = S::all(s.h), one = S::all(1), to_v = S::all(s.to_v), to_u = S::all(s.to_u);
    bool finite = true;
    for (std::size_t slice = first; slice < last; ++slice)
        for (std::size_t lane = 0; lane < slice_width; lane += S::width) {
            const PackedCoefficients& c = s.coefficients[slice];
            const PackedVectors& area = s.area[slice];
            PackedVectors& v = s.v[slice];
            const std::size_t i = slice * slice_width + lane;
            std::uint32_t own[S::width];
            own_rows<S>(i, own);
            F q[3], u[3];
            S::rows(s.rows, own, q, u);
            const F give = S::load(c.inverse_m + lane) / (one + h * S::load(c.c_m + lane));
            const F rx = give * S::load(area.x + lane), ry = give * S::load(area.y + lane),
                    rz = give * S::load(area.z + lane);
            const F vx = S::load(v.x + lane) + to_v * rx, vy = S::load(v.y + lane) + to_v * ry,
                    vz = S::load(v.z + lane) + to_v * rz;
            const F x = u[0] + to_u * rx, y = u[1] + to_u * ry, z = u[2] + to_u * rz;
            S::store(v.x + lane, vx), S::store(v.y + lane, vy), S::store(v.z + lane, vz);
            S::put(s.rows[i].u, sizeof(PackedRow) / sizeof(float), x, y, z);
            finite &= S::below((vx * vx + vy * vy + vz * vz) + (x * x + y * y + z * z), 1e30f);
        }
    return finite;
}

template <class S, Sums sums>
bool advance_kind(const PackedStep& step, std::size_t first, std::size_t last, PackedSums* result) {
    return step.stiffness ? advance<S, sums, true>(step, first, last, result)
                          : advance<S, sums, false>(step, first, last, result);
}

template <class S>
bool advance_slices(const PackedStep& step, std::size_t first, std::size_t last, PackedSums* sums) {
    return !sums        ? advance_kind<S, Sums::none>(step, first, last, nullptr)
           : !step.area ? advance_kind<S, Sums::volume>(step, first, last, sums)
                        : advance_kind<S, Sums::pressure>(step, first, last, sums);
}

}  // namespace
}  // namespace innerspring
