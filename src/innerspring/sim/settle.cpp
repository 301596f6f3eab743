#include "innerspring/sim/settle.h"

#include <algorithm>
#include <bit>

namespace innerspring {

namespace {

/// One group after the other: the vertices of a colour, the last again where they end within a group.
void append(const Body& body, std::span<const Index> vertices, std::span<const double> d,
            const std::vector<Vector>& z, std::vector<SettleGroup>& groups, std::vector<SettleSlot>& slots) {
    for (std::size_t n = 0; n < vertices.size(); n += settle_width) {
        SettleGroup& group = groups.emplace_back();
        group.vertices = std::uint32_t(std::min(settle_width, vertices.size() - n));
        group.first = std::uint32_t(slots.size());
        std::size_t most = 0;
        for (std::size_t lane = 0; lane < settle_width; ++lane)
            most = std::max(most, body.spokes_of(vertices[std::min(n + lane, vertices.size() - 1)]).size());
        group.count = std::uint32_t(most);
        slots.resize(slots.size() + most);
        for (std::size_t lane = 0; lane < settle_width; ++lane) {
            const Index i = vertices[std::min(n + lane, vertices.size() - 1)];
            group.offset[lane] = 3 * i;
            group.d[lane] = d[i];
            for (int axis = 0; axis < 3; ++axis) group.z[axis][lane] = z[i][axis];
            SettleSlot* slot = slots.data() + group.first;
            for (const Spoke& spoke : body.spokes_of(i)) {
                slot->offset[lane] = 3 * spoke.neighbour;
                slot->k[lane] = spoke.k, slot->rest[lane] = spoke.rest;
                ++slot;
            }
            for (; slot != slots.data() + slots.size(); ++slot)  // none: no length and no stiffness
                slot->offset[lane] = 3 * i, slot->k[lane] = slot->rest[lane] = 0;
        }
    }
}

}  // namespace

Settling::Settling(const Body& body, std::span<const Index> vertices, std::span<const double> d,
                   const std::vector<Vector>& z) {
    // Each vertex the first colour that none of its neighbours has; what finds none comes by itself.
    constexpr int most = 32;
    std::vector<std::uint8_t> colour(body.vertices(), most);
    std::vector<std::vector<Index>> of(most);
    std::vector<Index> left;
    for (const Index i : vertices) {
        std::uint32_t taken = 0;
        for (const Spoke& spoke : body.spokes_of(i))
            if (colour[spoke.neighbour] < most) taken |= 1u << colour[spoke.neighbour];
        const int free = std::countr_one(taken);
        colour[i] = std::uint8_t(free);
        (free < most ? of[std::size_t(free)] : left).push_back(i);
    }
    for (const auto& same : of) {
        if (same.empty()) break;
        starts_.push_back(groups_.size());
        append(body, same, d, z, groups_, slots_);
    }
    for (const Index& i : left) {
        starts_.push_back(groups_.size());
        append(body, {&i, 1}, d, z, groups_, slots_);
    }
    starts_.push_back(groups_.size());
}

void Settling::sweep(const VectorKernels& kernels, std::vector<Vector>& x, bool back) const {
    static_assert(sizeof(Vector) == 3 * sizeof(double));
    const SettlePass pass{groups_.data(), slots_.data(), x.front().data()};
    for (std::size_t n = 0; n < colours(); ++n) {
        const std::size_t colour = back ? colours() - 1 - n : n;
        kernels.settle(pass, starts_[colour], starts_[colour + 1]);
    }
}

}  // namespace innerspring
