#include "innerspring/sim/packed.h"

#include <algorithm>
#include <cmath>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "innerspring/sim/packed_largest.h"
#include "innerspring/sim/volume.h"

namespace innerspring {

namespace {

/// Slices a thread takes at once.
constexpr std::size_t slices_per_block = block_size / slice_width;

/// Fewer vertices than this are stepped by one thread: waking the others costs more (docs/performance.md).
constexpr std::size_t threads_pay_from = 1000;

/// Numbers so small that they have lost bits are taken as 0: they would slow every operation down a
/// hundredfold.
class FlushDenormals {
  public:
#if defined(__x86_64__)
    FlushDenormals() : before_(_mm_getcsr()) {
        _mm_setcsr(before_ | 0x8040);
    }
    ~FlushDenormals() {
        _mm_setcsr(before_);
    }

  private:
    unsigned before_;
#endif
};

std::size_t blocks_of(std::size_t slices) {
    return (slices + slices_per_block - 1) / slices_per_block;
}

template <class Loop>
void each_block(const Packed& p, std::size_t blocks, Team& team, Loop&& loop) {
    if (p.place_of.size() >= threads_pay_from) return team.run(blocks, loop);
    for (std::size_t block = 0; block < blocks; ++block) loop(block);
}

/// Eq. 4 in units of Packed.
double volume_of(Packed& p, const LargeArray<PackedRow>& rows, const VectorKernels& kernel, Team& team) {
    PackedStep step{};
    step.slots = p.slots.data(), step.ranges = p.ranges.data(), step.in = rows.data();
    const std::size_t slices = p.ranges.size(), blocks = blocks_of(slices);
    p.parts.resize(blocks);
    each_block(p, blocks, team, [&](std::size_t block) {
        const FlushDenormals flush;
        const std::size_t first = block * slices_per_block, last = std::min(slices, first + slices_per_block);
        p.parts[block].volume = kernel.volume(step, first, last);
    });
    double sum = 0;
    for (const PackedSums& part : p.parts) sum += part.volume;
    return sum;
}

}  // namespace

void prepare_volume(Packed& p, const Body& body) {
    if (!(body.material.poisson > 0)) {
        p.response = {};
        return;
    }
    p.response.resize(p.ranges.size());
    LargeArray<PackedRow> rest(p.rows[0].begin(), p.rows[0].end());
    for (PackedRow& row : rest) std::fill(std::begin(row.u), std::end(row.u), 0.0f);
    Team alone(1);
    p.rest_volume = volume_of(p, rest, *vector_kernels().front(), alone);
}

namespace {

void take_largest(const Packed& p, LargestMotion& largest) {
    std::array<float, 2> most{0, 0};
    for (const auto& [u2, v2] : largest.blocks) most = {std::max(most[0], u2), std::max(most[1], v2)};
    largest.displacement = std::sqrt(double(most[0])) / p.scale;
    largest.speed = std::sqrt(double(most[1])) / p.scale;
}

}  // namespace

// Either way round what is written lies in order, and what is read may be anywhere: it is asked for ahead.
constexpr std::size_t ahead = 24;

void load(Packed& p, const Body& body, const State& state, Team& team, LargestMotion* largest) {
    const std::size_t slices = p.ranges.size(), last = p.vertex_at.size() - 1;
    if (largest) largest->blocks.assign(blocks_of(slices), {0, 0});
    each_block(p, blocks_of(slices), team, [&](std::size_t block) {
        const FlushDenormals flush;  // the kernel takes them as 0 too
        LargestSquares most;
        for (std::size_t s = block * slices_per_block; s < std::min(slices, (block + 1) * slices_per_block);
             ++s) {
            for (std::size_t lane = 0; lane < slice_width; ++lane) {
                const std::size_t place = s * slice_width + lane;
                const Index i = p.vertex_at[place], later = p.vertex_at[std::min(place + ahead, last)];
                if (later != no_index) {
                    __builtin_prefetch(&state.x[later]);
                    __builtin_prefetch(&state.v[later]);
                    __builtin_prefetch(&body.rest.positions[later]);
                }
                if (i == no_index) continue;
                const Vector u = p.scale * (state.x[i] - body.rest.positions[i]), v = p.scale * state.v[i];
                for (int axis = 0; axis < 3; ++axis) p.rows[0][place].u[axis] = float(u[axis]);
                p.v[s].x[lane] = float(v.x()), p.v[s].y[lane] = float(v.y()), p.v[s].z[lane] = float(v.z());
            }
        }
        if (!largest) return;
        // What was only just written in small pieces cannot be read in large ones without waiting for it.
        for (std::size_t s = block * slices_per_block; s < std::min(slices, (block + 1) * slices_per_block);
             ++s)
            most.look_at(p, s);
        largest->blocks[block] = most.largest();
    });
    if (largest) take_largest(p, *largest);
}

void store(const Packed& p, const Body& body, State& state, Team& team) {
    const double metres = 1 / p.scale;  // exact: a power of two
    const std::size_t n = p.place_of.size();
    each_block(p, block_count(n), team, [&](std::size_t block) {
        for (std::size_t i = block * block_size; i < std::min(n, (block + 1) * block_size); ++i) {
            const Index place = p.place_of[i], later = p.place_of[std::min(i + ahead, n - 1)];
            __builtin_prefetch(&p.rows[0][later]);
            __builtin_prefetch(&p.v[later / slice_width].x[later % slice_width]);
            __builtin_prefetch(&p.v[later / slice_width].y[later % slice_width]);
            __builtin_prefetch(&p.v[later / slice_width].z[later % slice_width]);
            const float* u = p.rows[0][place].u;
            const PackedVectors& v = p.v[place / slice_width];
            const std::size_t lane = place % slice_width;
            state.x[i] = body.rest.positions[i] + metres * Vector(u[0], u[1], u[2]);
            state.v[i] = metres * Vector(v.x[lane], v.y[lane], v.z[lane]);
        }
    });
}

Vector displacement(const Packed& p, Index vertex) {
    const PackedRow& row = p.rows[0][p.place_of[vertex]];
    return Vector(row.u[0], row.u[1], row.u[2]) * (1 / p.scale);
}

Vector displacement_before_at(const Packed& p, Index place) {
    const PackedRow& row = p.rows[1][place];
    return Vector(row.u[0], row.u[1], row.u[2]) * (1 / p.scale);
}

Vector displacement_before(const Packed& p, Index vertex) {
    return displacement_before_at(p, p.place_of[vertex]);
}

Vector velocity_at(const Packed& p, Index place) {
    const PackedVectors& v = p.v[place / slice_width];
    const std::size_t lane = place % slice_width;
    return Vector(v.x[lane], v.y[lane], v.z[lane]) * (1 / p.scale);
}

Vector velocity(const Packed& p, Index vertex) {
    return velocity_at(p, p.place_of[vertex]);
}

void find_largest(const Packed& p, Team& team, LargestMotion& largest) {
    const std::size_t slices = p.ranges.size(), blocks = blocks_of(slices);
    largest.blocks.assign(blocks, {0, 0});
    each_block(p, blocks, team, [&](std::size_t block) {
        LargestSquares most;
        for (std::size_t s = block * slices_per_block; s < std::min(slices, (block + 1) * slices_per_block);
             ++s)
            most.look_at(p, s);
        largest.blocks[block] = most.largest();
    });
    take_largest(p, largest);
}

void push(Packed& p, Index vertex, const Vector& velocity) {
    const std::size_t slice = p.place_of[vertex] / slice_width, lane = p.place_of[vertex] % slice_width;
    PackedVectors& v = p.v[slice];
    v.x[lane] += float(p.scale * velocity.x());
    v.y[lane] += float(p.scale * velocity.y());
    v.z[lane] += float(p.scale * velocity.z());
}

void push(Packed& p, const Body& body, std::span<const Index> vertices, std::span<const double> weights,
          const Vector& impulse) {
    const std::size_t count = vertices.size();
    for (std::size_t n = 0; n < count; ++n) {
        const Index later = p.place_of[vertices[std::min(n + ahead, count - 1)]];
        __builtin_prefetch(&p.v[later / slice_width].x[later % slice_width], 1);
        __builtin_prefetch(&p.v[later / slice_width].y[later % slice_width], 1);
        __builtin_prefetch(&p.v[later / slice_width].z[later % slice_width], 1);
        push(p, vertices[n], weights[n] / body.m[vertices[n]] * impulse);
    }
}

void place_at(Packed& p, Index place, const Vector& displacement, const Vector& velocity) {
    PackedVectors& v = p.v[place / slice_width];
    const std::size_t lane = place % slice_width;
    for (int axis = 0; axis < 3; ++axis) p.rows[0][place].u[axis] = float(p.scale * displacement[axis]);
    v.x[lane] = float(p.scale * velocity.x());
    v.y[lane] = float(p.scale * velocity.y());
    v.z[lane] = float(p.scale * velocity.z());
}

void place(Packed& p, Index vertex, const Vector& displacement, const Vector& velocity) {
    place_at(p, p.place_of[vertex], displacement, velocity);
}

bool advance(Packed& p, const VectorKernels& kernel, double h, const Vector& gravity, Team& team,
             VolumeFlow* volume) {
    const Vector hg = h * p.scale * gravity;
    const PackedStep step{p.slots.data(),
                          p.ranges.data(),
                          p.coefficients.data(),
                          p.rows[0].data(),
                          p.rows[1].data(),
                          p.v.data(),
                          float(h),
                          {float(hg.x()), float(hg.y()), float(hg.z())},
                          p.response.empty() ? nullptr : p.response.data(),
                          p.stiffness_matrix.empty() ? nullptr : p.stiffness_matrix.data()};
    const std::size_t slices = p.ranges.size(), blocks = blocks_of(slices);
    std::atomic<bool> finite{true};
    const auto run = [&](std::size_t block, PackedSums* sums) {
        const FlushDenormals flush;
        const std::size_t first = block * slices_per_block, last = std::min(slices, first + slices_per_block);
        if (!kernel.advance(step, first, last, sums)) finite.store(false, std::memory_order_relaxed);
    };
    if (volume) {
        // Block by block in order, whoever adds them up.
        p.parts.resize(blocks);
        each_block(p, blocks, team, [&](std::size_t block) { run(block, &p.parts[block]); });
        PackedSums sum;
        for (const PackedSums& part : p.parts)
            sum.volume += part.volume, sum.flow += part.flow, sum.give += part.give;
        const double s3 = p.scale * p.scale * p.scale;
        *volume = {(sum.volume - p.rest_volume) / s3, sum.flow / (6 * s3),
                   sum.give / (36 * s3 * p.scale * p.stiffness)};
    } else {
        each_block(p, blocks, team, [&](std::size_t block) { run(block, nullptr); });
    }
    p.rows[0].swap(p.rows[1]);
    return finite;
}

Vector response(const Packed& p, Index vertex) {
    const PackedVectors& r = p.response[p.place_of[vertex] / slice_width];
    const std::size_t lane = p.place_of[vertex] % slice_width;
    return Vector(r.x[lane], r.y[lane], r.z[lane]) / (6 * p.scale * p.scale * p.stiffness);
}

namespace {

bool run_press(const Packed& p, const PackedPress& press, const VectorKernels& kernel, Team& team) {
    const std::size_t slices = p.ranges.size();
    std::atomic<bool> finite{true};
    each_block(p, blocks_of(slices), team, [&](std::size_t block) {
        const FlushDenormals flush;
        const std::size_t first = block * slices_per_block, last = std::min(slices, first + slices_per_block);
        if (!kernel.press(press, first, last)) finite.store(false, std::memory_order_relaxed);
    });
    return finite;
}

}  // namespace

bool press(Packed& p, const VectorKernels& kernel, double h, double P, Team& team) {
    const double unit = 1 / (6 * p.scale * p.stiffness);
    return run_press(
        p, {p.response.data(), p.rows[1].data(), p.rows[0].data(), p.v.data(), float(h * P * unit), float(h)},
        kernel, team);
}

bool shift(Packed& p, const VectorKernels& kernel, double to_u, Team& team) {
    const double unit = 1 / (6 * p.scale * p.stiffness);
    PackedRow* const rows = p.rows[0].data();
    return run_press(p, {p.response.data(), rows, rows, nullptr, 0, float(to_u * unit)}, kernel, team);
}

double volume_excess(Packed& p, const VectorKernels& kernel, Team& team) {
    return (volume_of(p, p.rows[0], kernel, team) - p.rest_volume) / (p.scale * p.scale * p.scale);
}

}  // namespace innerspring
