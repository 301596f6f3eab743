#include "innerspring/sim/net.h"

#include <algorithm>
#include <cmath>

#include "innerspring/sim/settle.h"

namespace innerspring {

namespace {

/// work(from, to) for the runs of vertices in [first, last) that are not pinned; zero for those that are.
template <class Work>
void each_run(std::size_t first, std::size_t last, const std::vector<bool>& pinned, std::vector<Vector>& out,
              Work work) {
    for (std::size_t i = first; i < last;) {
        std::size_t end = i;
        while (end < last && !pinned[end]) ++end;
        work(i, end);
        for (i = end; i < last && pinned[i]; ++i) out[i].setZero();
    }
}

}  // namespace

Net::Net(const Body& body) : body_(body) {
    adapt();
}

void Net::adapt() {
    rows_.clear(), spokes_.clear();
    for (std::size_t i = 0; i < body_.vertices(); ++i) {
        const auto spokes = body_.spokes_of(i);
        rows_.push_back({std::uint32_t(spokes_.size()), std::uint32_t(spokes.size())});
        for (const Spoke& spoke : spokes) spokes_.push_back({spoke.neighbour, spoke.edge});
    }
}

Net::Value Net::evaluate(const std::vector<Vector>& x, std::span<const double> d,
                         const std::vector<Vector>& z, const std::vector<bool>& pinned,
                         std::vector<Vector>& g, Team& team) {
    static_assert(sizeof(Vector) == 3 * sizeof(double) && sizeof(Edge) == 2 * sizeof(std::uint32_t));
    const std::size_t n = x.size(), edges = body_.k.size();
    s_.resize(edges);
    const VectorKernels& kernels = *vector_kernels().front();
    const NetPass pass{
        &body_.edges.front().a, body_.k.data(),   body_.rest_length.data(), s_.data(), rows_.data(),
        spokes_.data(),         x.front().data(), z.front().data(),         d.data(),  g.front().data()};
    Value value;
    blocks_.assign(block_count(edges), {});
    team.run(blocks_.size(), [&](std::size_t block) {
        const std::size_t first = block * block_size, last = std::min(edges, first + block_size);
        blocks_[block].surface = kernels.stretch(pass, first, last);
    });
    for (const Value& block : blocks_) value.surface += block.surface / 2;
    blocks_.assign(block_count(n), {});
    team.run(blocks_.size(), [&](std::size_t block) {
        NetSums sums;
        each_run(block * block_size, std::min(n, (block + 1) * block_size), pinned, g,
                 [&](std::size_t first, std::size_t last) { kernels.pull(pass, first, last, sums); });
        blocks_[block].places = (sums.places[0] + sums.places[1]) + sums.places[2];
        blocks_[block].gradient2 = (sums.gradient2[0] + sums.gradient2[1]) + sums.gradient2[2];
    });
    for (const Value& block : blocks_) value.places += block.places / 2, value.gradient2 += block.gradient2;
    return value;
}

void Net::linearise(const std::vector<Vector>& x, Team& team) {
    const std::size_t edges = body_.k.size();
    tangent_.resize(edges);
    team.run(block_count(edges), [&](std::size_t block) {
        for (std::size_t e = block * block_size; e < std::min(edges, (block + 1) * block_size); ++e) {
            const Edge& edge = body_.edges[e];
            const Vector d = x[edge.b] - x[edge.a];
            const double length = d.norm(), k = body_.k[e], rest = body_.rest_length[e];
            Eigen::Vector4d& t = tangent_[e];
            if (length > 0)
                t << std::sqrt(k * rest / length) / length * d, k * (1 - rest / length);
            else
                t << 0, 0, 0, k;
        }
    });
}

double Net::multiply(std::span<const double> d, const std::vector<Vector>& p, const std::vector<bool>& pinned,
                     std::vector<Vector>& q, Team& team) {
    const std::size_t n = p.size();
    const VectorKernels& kernels = *vector_kernels().front();
    const TangentPass pass{tangent_.front().data(), rows_.data(),    spokes_.data(), d.data(),
                           p.front().data(),        q.front().data()};
    blocks_.assign(block_count(n), {});
    team.run(blocks_.size(), [&](std::size_t block) {
        double sums[3] = {0, 0, 0};
        each_run(block * block_size, std::min(n, (block + 1) * block_size), pinned, q,
                 [&](std::size_t first, std::size_t last) { kernels.tangent(pass, first, last, sums); });
        blocks_[block].places = (sums[0] + sums[1]) + sums[2];
    });
    double sum = 0;
    for (const Value& block : blocks_) sum += block.places;
    return sum;
}

void Net::settle(std::vector<Vector>& x, std::span<const double> d, const std::vector<Vector>& z,
                 const std::vector<bool>& pinned) {
    constexpr int sweeps = 160;  // fewer leave more to Newton's method, which costs more
    // p_i against its neighbours' -p_i meets d_i + 2 sum across; half of what makes that negative is enough.
    loose_.clear();
    for (Index i = 0; i < x.size(); ++i) {
        double pressed = 0;
        for (const Spoke& spoke : body_.spokes_of(i)) pressed -= std::min(0.0, tangent_[spoke.edge][3]);
        if (8 * pressed > d[i] && !pinned[i]) loose_.push_back(i);
    }
    if (loose_.empty()) return;
    const Settling settling(body_, loose_, d, z);
    for (int sweep = 0; sweep < sweeps; ++sweep) settling.sweep(*vector_kernels().front(), x, sweep % 2 == 1);
}

}  // namespace innerspring
