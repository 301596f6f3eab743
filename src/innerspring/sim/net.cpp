#include "innerspring/sim/net.h"

#include <Eigen/Core>
#include <cmath>

namespace innerspring {

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
        const std::size_t last = std::min(n, (block + 1) * block_size);
        for (std::size_t i = block * block_size; i < last;) {
            std::size_t end = i;
            while (end < last && !pinned[end]) ++end;
            kernels.pull(pass, i, end, sums);
            for (i = end; i < last && pinned[i]; ++i) g[i].setZero();
        }
        blocks_[block].places = (sums.places[0] + sums.places[1]) + sums.places[2];
        blocks_[block].gradient2 = (sums.gradient2[0] + sums.gradient2[1]) + sums.gradient2[2];
    });
    for (const Value& block : blocks_) value.places += block.places / 2, value.gradient2 += block.gradient2;
    return value;
}

void Net::linearise(const std::vector<Vector>& x, Team& team) {
    const std::size_t edges = body_.k.size();
    along_.resize(edges), across_.resize(edges);
    team.run(block_count(edges), [&](std::size_t block) {
        for (std::size_t e = block * block_size; e < std::min(edges, (block + 1) * block_size); ++e) {
            const Edge& edge = body_.edges[e];
            const Vector d = x[edge.b] - x[edge.a];
            const double length = d.norm(), k = body_.k[e];
            if (length > 0) {
                across_[e] = k * (1 - body_.rest_length[e] / length);
                along_[e] = std::sqrt(k * body_.rest_length[e] / length) / length * d;
            } else {
                across_[e] = k;
                along_[e].setZero();
            }
        }
    });
}

double Net::multiply(std::span<const double> d, const std::vector<Vector>& p, const std::vector<bool>& pinned,
                     std::vector<Vector>& q, Team& team) {
    const std::size_t n = p.size();
    blocks_.assign(block_count(n), {});
    team.run(blocks_.size(), [&](std::size_t block) {
        double sum = 0;
        for (std::size_t i = block * block_size; i < std::min(n, (block + 1) * block_size); ++i) {
            if (pinned[i]) {
                q[i].setZero();
                continue;
            }
            const Vector p_i = p[i];
            Vector f = d[i] * p_i;
            for (const Spoke& spoke : body_.spokes_of(i)) {
                const Vector by = p_i - p[spoke.neighbour];
                const Vector& u = along_[spoke.edge];
                f += across_[spoke.edge] * by + u.dot(by) * u;
            }
            q[i] = f;
            sum += f.dot(p_i);
        }
        blocks_[block].places = sum;
    });
    double sum = 0;
    for (const Value& block : blocks_) sum += block.places;
    return sum;
}

}  // namespace innerspring
