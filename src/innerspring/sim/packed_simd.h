#pragma once
// The explicit step, once, over the vector operations of an instruction set. Fused multiply-adds and
// approximate roots would not be faster, as the shuffles that transpose the neighbours' rows set the pace
// (docs/performance.md).
#include "innerspring/sim/simd.h"
#include "innerspring/sim/vector_kernels.h"

// For a lambda that is called at several places of a loop.
#define INNERSPRING_INLINE __attribute__((always_inline))

namespace innerspring {
namespace {

enum class Sums { none, volume, pressure };

/// 6 a_i of a slice's vertices as the fan goes by, or its x component. The sum of d_n x d_{n+1} is twice the
/// area of the ring of neighbours, which any two ways across each quadrangle give:
///     sum over odd n of (d_{n+1} - d_0) x (d_{n+2} - d_n),   d_0 after the last.
/// Empty slots are d_0 and add 0.
template <class S, Sums sums>
struct Fan {
    using F = typename S::F;
    F x, y, z;  ///< 6 a_i

    Fan() : x(S::all(0)), y(x), z(x) {}
    void cross(const F* a, F bx, F by, F bz) {
        if constexpr (sums == Sums::pressure) {
            y = y + (a[2] * bx - a[0] * bz);
            z = z + (a[0] * by - a[1] * bx);
        }
        x = x + (a[1] * bz - a[2] * by);
    }
    /// `visit(slot, d)` finds the d of each slot in turn; there are at least three.
    template <class Visit>
    void go_round(const PackedSlot* slot, std::size_t count, Visit&& visit) {
        const PackedSlot* const end = slot + count;
        F first[3], odd[3], even[3], next[3];
        visit(slot++, first);
        visit(slot++, odd);
        for (; slot + 1 < end; slot += 2) {
            visit(slot, even);
            const F across[3] = {even[0] - first[0], even[1] - first[1], even[2] - first[2]};
            visit(slot + 1, next);
            cross(across, next[0] - odd[0], next[1] - odd[1], next[2] - odd[2]);
            odd[0] = next[0], odd[1] = next[1], odd[2] = next[2];
        }
        if (slot == end) return;
        visit(slot, even);
        const F across[3] = {even[0] - first[0], even[1] - first[1], even[2] - first[2]};
        cross(across, first[0] - odd[0], first[1] - odd[1], first[2] - odd[2]);
    }
    /// 18 times the vertices' share of Eq. 4.
    F volume(const F* q, const F* u) const {
        if constexpr (sums == Sums::pressure)
            return (q[0] + u[0]) * x + (q[1] + u[1]) * y + (q[2] + u[2]) * z;
        else
            return S::all(3) * ((q[0] + u[0]) * x);
    }
};

double sum_of_lanes(const double* lanes) {
    double sum = 0;
    for (std::size_t lane = 0; lane < slice_width; ++lane) sum += lanes[lane];
    return sum;
}

/// Sums per lane of a slice, in single precision; a block is short.
template <class S>
struct LaneSums {
    typename S::F lanes[slice_width / S::width];
    LaneSums() {
        for (auto& l : lanes) l = S::all(0);
    }
    double total() const {
        float all[slice_width];
        double wide[slice_width];
        __builtin_memcpy(all, lanes, sizeof all);
        for (std::size_t lane = 0; lane < slice_width; ++lane) wide[lane] = double(all[lane]);
        return sum_of_lanes(wide);
    }
};

/// The same in double precision, of floats.
template <class S>
struct WideLaneSums {
    typename S::Wide lanes[slice_width / S::width];
    WideLaneSums() {
        for (auto& l : lanes) S::clear(l);
    }
    double total() const {
        double all[slice_width];
        __builtin_memcpy(all, lanes, sizeof all);
        return sum_of_lanes(all);
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
    WideLaneSums<S> volume;
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
            const auto pull = [&](const PackedSlot* slot, F* d) INNERSPRING_INLINE {
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
                d[0] = dx, d[1] = dy, d[2] = dz;
            };
            if constexpr (sums == Sums::none) {
                F d[3];
                for (const PackedSlot* slot = slots; slot != end; ++slot) pull(slot, d);
            } else {
                fan.go_round(slots, s.ranges[slice].count, pull);
                S::add(volume.lanes[lane / S::width], fan.volume(q, u));
            }
            const PackedCoefficients& c = s.coefficients[slice];
            PackedVectors& v = s.v[slice];
            // v' = (v + h (F/m - K/m u + g)) / (1 + h c/m),  u' = u + h v'
            const F inverse_m = S::load(c.inverse_m + lane);
            const F h_m = h * inverse_m;
            F inner[3];
            inner_pull<S, anisotropic>(s, slice, lane, h, u, inner);
            const F damp = one / (one + h * S::load(c.c_m + lane));
            const F vx = (S::load(v.x + lane) + (h_m * fx - inner[0]) + hg[0]) * damp;
            const F vy = (S::load(v.y + lane) + (h_m * fy - inner[1]) + hg[1]) * damp;
            const F vz = (S::load(v.z + lane) + (h_m * fz - inner[2]) + hg[2]) * damp;
            S::store(v.x + lane, vx), S::store(v.y + lane, vy), S::store(v.z + lane, vz);
            if constexpr (sums != Sums::pressure) {
                const F x = u[0] + h * vx, y = u[1] + h * vy, z = u[2] + h * vz;
                S::put(s.out[i].u, sizeof(PackedRow) / sizeof(float), x, y, z);
                finite &= S::below((vx * vx + vy * vy + vz * vz) + (x * x + y * y + z * z), 1e30f);
            } else {  // the pressure is still to come
                finite &= S::below(vx * vx + vy * vy + vz * vz, 1e30f);
                PackedVectors& r = s.response[slice];
                const F lightness = inverse_m * damp;
                const F rx = lightness * fan.x, ry = lightness * fan.y, rz = lightness * fan.z;
                S::store(r.x + lane, rx), S::store(r.y + lane, ry), S::store(r.z + lane, rz);
                F& f = flow.lanes[lane / S::width];
                F& g = give.lanes[lane / S::width];
                f = f + (fan.x * vx + fan.y * vy + fan.z * vz);
                g = g + (fan.x * rx + fan.y * ry + fan.z * rz);
            }
        }
    }
    if constexpr (sums != Sums::none) result->volume = volume.total() / 18;
    if constexpr (sums == Sums::pressure) result->flow = flow.total(), result->give = give.total();
    return finite;
}

template <class S>
double volume_of_slices(const PackedStep& s, std::size_t first, std::size_t last) {
    using F = typename S::F;
    WideLaneSums<S> volume;
    for (std::size_t slice = first; slice < last; ++slice) {
        for (std::size_t lane = 0; lane < slice_width; lane += S::width) {
            std::uint32_t own[S::width];
            own_rows<S>(slice * slice_width + lane, own);
            F q[3], u[3];
            S::rows(s.in, own, q, u);
            Fan<S, Sums::pressure> fan;
            fan.go_round(s.slots + s.ranges[slice].first, s.ranges[slice].count,
                         [&](const PackedSlot* slot, F* d) INNERSPRING_INLINE {
                             F qj[3], uj[3];
                             S::rows(s.in, slot->offset + lane, qj, uj);
                             for (int axis = 0; axis < 3; ++axis)
                                 d[axis] = (qj[axis] - q[axis]) + (uj[axis] - u[axis]);
                         });
            S::add(volume.lanes[lane / S::width], fan.volume(q, u));
        }
    }
    return volume.total() / 18;
}

/// Rows are added to as they are, so that none is taken apart. `moves`: the velocities change too, and all of
/// them move the rows.
template <class S, bool moves>
bool press(const PackedPress& s, std::size_t first, std::size_t last) {
    using F = typename S::F;
    const F to_v = S::all(s.to_v), to_u = S::all(s.to_u);
    bool finite = true;
    for (std::size_t slice = first; slice < last; ++slice)
        for (std::size_t lane = 0; lane < slice_width; lane += S::width) {
            const std::size_t i = slice * slice_width + lane;
            const PackedVectors& r = s.response[slice];
            F x = S::load(r.x + lane), y = S::load(r.y + lane), z = S::load(r.z + lane);
            if constexpr (moves) {
                PackedVectors& v = s.v[slice];
                x = S::load(v.x + lane) + to_v * x, y = S::load(v.y + lane) + to_v * y,
                z = S::load(v.z + lane) + to_v * z;
                S::store(v.x + lane, x), S::store(v.y + lane, y), S::store(v.z + lane, z);
            }
            finite &= S::below(x * x + y * y + z * z, 1e30f);
            S::displace(s.in + i, s.out + i, to_u * x, to_u * y, to_u * z);
        }
    return finite;
}

template <class S, Sums sums>
bool advance_kind(const PackedStep& step, std::size_t first, std::size_t last, PackedSums* result) {
    return step.stiffness ? advance<S, sums, true>(step, first, last, result)
                          : advance<S, sums, false>(step, first, last, result);
}

template <class S>
bool press_slices(const PackedPress& s, std::size_t first, std::size_t last) {
    return s.v ? press<S, true>(s, first, last) : press<S, false>(s, first, last);
}

template <class S>
bool advance_slices(const PackedStep& step, std::size_t first, std::size_t last, PackedSums* sums) {
    return !sums            ? advance_kind<S, Sums::none>(step, first, last, nullptr)
           : !step.response ? advance_kind<S, Sums::volume>(step, first, last, sums)
                            : advance_kind<S, Sums::pressure>(step, first, last, sums);
}

}  // namespace
}  // namespace innerspring
