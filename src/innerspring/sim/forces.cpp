#include "innerspring/sim/forces.h"

#include <Eigen/SVD>

namespace innerspring {

HomeFrame home_frame(const Body& body, Positions x, Team& team) {
    HomeFrame frame;
    if (!body.free) return frame;
    struct Sums {
        double K = 0;
        Vector q = Vector::Zero(), x = Vector::Zero();
        Eigen::Matrix3d xq = Eigen::Matrix3d::Zero();
    };
    // About one vertex, so that a body far from the origin loses no digits.
    const Vector q0 = body.rest.positions[0], x0 = x[0];
    std::vector<Sums> blocks(block_count(x.size()));
    team.run(blocks.size(), [&](std::size_t block) {
        Sums& s = blocks[block];
        for (std::size_t i = block * block_size; i < std::min(x.size(), (block + 1) * block_size); ++i) {
            const double K = body.K[i];
            const Vector q = body.rest.positions[i] - q0, y = x[i] - x0;
            s.K += K;
            s.q += K * q;
            s.x += K * y;
            s.xq += K * y * q.transpose();
        }
    });
    Sums sum;
    for (const Sums& s : blocks) sum.K += s.K, sum.q += s.q, sum.x += s.x, sum.xq += s.xq;
    const Vector q_mean = sum.q / sum.K, x_mean = sum.x / sum.K;
    const Eigen::Matrix3d A = sum.xq - sum.K * x_mean * q_mean.transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Vector sign(1, 1,
                (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0
                    ? -1
                    : 1);  // a rotation, never a reflection
    frame.R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
    frame.t = x0 + x_mean - frame.R * (q0 + q_mean);
    return frame;
}

double inner_energy(const Body& body, const HomeFrame& frame, Positions x) {
    double energy = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
        energy += body.K[i] * (x[i] - (frame.R * body.rest.positions[i] + frame.t)).squaredNorm() / 2;
    return energy;
}

void add_inner_forces(const Body& body, const HomeFrame& frame, Positions x, std::span<Vector> f) {
    for (std::size_t i = 0; i < x.size(); ++i)
        f[i] -= body.K[i] * (x[i] - (frame.R * body.rest.positions[i] + frame.t));
}

double surface_energy(const Body& body, Positions x) {
    double energy = 0;
    for (std::size_t e = 0; e < body.k.size(); ++e) {
        const Edge& edge = body.edges[e];
        const double stretch = (x[edge.a] - x[edge.b]).norm() - body.rest_length[e];
        energy += body.k[e] * stretch * stretch / 2;
    }
    return energy;
}

void add_surface_forces(const Body& body, Positions x, std::span<Vector> f) {
    for (std::size_t i = 0; i < x.size(); ++i) f[i] += surface_force(body, x.data(), i);
}

double gravity_energy(const Body& body, const Vector& gravity, Positions x) {
    double energy = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
        energy -= body.m[i] * gravity.dot(x[i] - body.rest.positions[i]);
    return energy;
}

void add_gravity(const Body& body, const Vector& gravity, std::span<Vector> f) {
    for (std::size_t i = 0; i < f.size(); ++i) f[i] += body.m[i] * gravity;
}

double load_energy(const Body& body, const Loads& loads, double time, Positions x) {
    double energy = 0;
    for (const Force& load : loads.forces) {
        const Vector now = at(load.profile, time) * load.newton;
        for (std::size_t n = 0; n < load.vertices.size(); ++n) {
            const Index i = load.vertices[n];
            energy -= load.weights[n] * now.dot(x[i] - body.rest.positions[i]);
        }
    }
    return energy;
}

void add_loads(const Loads& loads, double time, std::span<Vector> f) {
    for (const Force& load : loads.forces) {
        const Vector now = at(load.profile, time) * load.newton;
        for (std::size_t n = 0; n < load.vertices.size(); ++n) f[load.vertices[n]] += load.weights[n] * now;
    }
}

}  // namespace innerspring
