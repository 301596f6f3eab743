#include "innerspring/sim/preconditioner.h"

#include <algorithm>
#include <cmath>

namespace innerspring {

Preconditioner::Preconditioner(const Body& body) : factor_(body) {
    find_normals(body);
}

namespace {

std::vector<Vector> unit_normals(Positions x, Triangles triangles) {
    std::vector<Vector> normals = vertex_normals(x, triangles);
    for (Vector& n : normals)
        if (!(n.squaredNorm() > 0)) n = Vector::UnitX();  // any will do
    return normals;
}

}  // namespace

void Preconditioner::find_normals(const Body& body) {
    rest_normal_ = unit_normals(body.rest.positions, body.rest.triangles);
    normal_ = rest_normal_;
}

void Preconditioner::follow(const Body& body, const std::vector<Vector>& x) {
    normal_ = unit_normals(x, body.rest.triangles);
}

std::span<const double> Preconditioner::in_plane(const Body& body, std::span<const double> d) {
    deviation_.clear();
    if (body.N.empty()) return d;
    plane_.resize(d.size());
    for (std::size_t i = 0; i < d.size(); ++i) {
        deviation_.push_back(rest_normal_[i].dot(body.N[i] * rest_normal_[i]));
        plane_[i] = d[i] - deviation_[i] / 2;
    }
    return plane_;
}

void Preconditioner::factorize(const Body& body, std::span<const double> d, const std::vector<bool>& pinned) {
    factor_.factorize(body, in_plane(body, d), pinned);
}

void Preconditioner::adapt(const Body& body, std::span<const double> d, const std::vector<bool>& pinned,
                           const SurfaceChange& surface, const BodyChange& change) {
    find_normals(body);
    factor_.adapt(body, in_plane(body, d), pinned, surface, change);
}

void Preconditioner::adapt_order(const Body& body, const SurfaceChange& surface, const BodyChange& change) {
    factor_.adapt_tree(body, surface, change);
    find_normals(body);
}

void Preconditioner::set_normal_stiffness(const Body& body, std::span<const double> d,
                                          const std::vector<Vector>& x, double share) {
    compliance_.resize(body.vertices());
    for (std::size_t i = 0; i < body.vertices(); ++i) {
        double D = 0;
        for (const Spoke& spoke : body.spokes_of(i)) {
            const Vector by = x[spoke.neighbour] - x[i];
            const double length2 = by.squaredNorm();
            if (!(length2 > 0)) continue;
            const double along = normal_[i].dot(by) * normal_[i].dot(by) / length2;
            D += spoke.k * (along + (1 - along) * std::max(0.0, 1 - spoke.rest / std::sqrt(length2)));
        }
        compliance_[i] = 1 / (d[i] + (deviation_.empty() ? 0 : deviation_[i]) + share * D);
    }
}

void Preconditioner::turn(const Body& body, const Eigen::Matrix3d& R) {
    for (std::size_t i = 0; i < body.vertices(); ++i) normal_[i] = R * rest_normal_[i];
}

template <class Real>
double Preconditioner::run(const std::vector<Vector>& r, std::vector<Vector>& z, std::vector<Real>& w,
                           Team& team) const {
    const Dissection& tree = factor_.tree();
    const std::size_t n = r.size(), blocks = block_count(n);
    w.resize(factor_.solve_size(), Real(0));
    blocks_.assign(blocks, 0);
    const auto each_block = [&](auto&& visit) {
        team.run(blocks, [&](std::size_t block) {
            double value = 0;
            for (std::size_t i = block * block_size; i < std::min(n, (block + 1) * block_size); ++i)
                visit(i, value);
            blocks_[block] = value;
        });
    };
    each_block([&](std::size_t i, double& most) { most = std::max(most, r[i].cwiseAbs().maxCoeff()); });
    double largest = *std::max_element(blocks_.begin(), blocks_.end());
    if (!(largest > 0)) largest = 1;
    const double down = 1 / largest, up = largest * factor_.scale();
    each_block([&](std::size_t i, double&) {
        const Vector v = r[i] - normal_[i].dot(r[i]) * normal_[i];
        Real* to = &w[4 * std::size_t(tree.place_of[i])];
        to[0] = Real(v.x() * down), to[1] = Real(v.y() * down), to[2] = Real(v.z() * down);
    });
    factor_.solve(w.data());
    each_block([&](std::size_t i, double& sum) {
        const Real* from = &w[4 * std::size_t(tree.place_of[i])];
        Vector v(up * double(from[0]), up * double(from[1]), up * double(from[2]));
        v += (normal_[i].dot(r[i]) * compliance_[i] - normal_[i].dot(v)) * normal_[i];
        sum += v.dot(r[i]);
        z[i] = v;
    });
    double sum = 0;
    for (double block : blocks_) sum += block;
    return sum;
}

double Preconditioner::apply(const std::vector<Vector>& r, std::vector<Vector>& z, Team& team) const {
    return factor_.in_float() ? run(r, z, float_work_, team) : run(r, z, double_work_, team);
}

}  // namespace innerspring
