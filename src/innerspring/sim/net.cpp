#include "innerspring/sim/net.h"

#include <Eigen/Core>
#include <cmath>

namespace innerspring {

Net::Net(const Body& body) : body_(body) {}

Net::Value Net::evaluate(const std::vector<Vector>& x, std::span<const double> d,
                         const std::vector<Vector>& z, const std::vector<bool>& pinned,
                         std::vector<Vector>& g, Team& team) {
    const std::size_t n = x.size(), edges = body_.k.size();
    s_.resize(edges);
    blocks_.assign(block_count(edges), {});
    team.run(blocks_.size(), [&](std::size_t block) {
        using Array = Eigen::Array<double, Eigen::Dynamic, 1, 0, int(block_size), 1>;
        const std::size_t first = block * block_size, count = std::min(edges - first, block_size);
        Array length(int(count), 1);
        for (std::size_t e = 0; e < count; ++e) {
            const Edge& edge = body_.edges[first + e];
            length[int(e)] = (x[edge.b] - x[edge.a]).squaredNorm();
        }
        const Eigen::Map<const Eigen::ArrayXd> k(body_.k.data() + first, Eigen::Index(count)),
            rest(body_.rest_length.data() + first, Eigen::Index(count));
        // A spring of no length has no direction: no force.
        length = (length > 0).select(length.sqrt(), rest);
        const Array stretch = length - rest, pull = k * stretch;
        blocks_[block].surface = (pull * stretch).sum() / 2;
        Eigen::Map<Eigen::ArrayXd>(s_.data() + first, Eigen::Index(count)) = pull / length;
    });
    Value value;
    for (const Value& block : blocks_) value.surface += block.surface;
    blocks_.assign(block_count(n), {});
    team.run(blocks_.size(), [&](std::size_t block) {
        Value sum;
        for (std::size_t i = block * block_size; i < std::min(n, (block + 1) * block_size); ++i) {
            if (pinned[i]) {
                g[i].setZero();
                continue;
            }
            const Vector x_i = x[i], from = x_i - z[i];
            Vector f = d[i] * from;
            sum.places += d[i] * from.squaredNorm();
            for (const Spoke& spoke : body_.spokes_of(i)) f += s_[spoke.edge] * (x_i - x[spoke.neighbour]);
            g[i] = f;
            sum.gradient2 += f.squaredNorm();
        }
        blocks_[block] = sum;
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
