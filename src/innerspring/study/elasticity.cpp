#include "innerspring/study/elasticity.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <cmath>

#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

using Matrix = Eigen::Matrix3d;
using Sparse = Eigen::SparseMatrix<double>;

/// Ends of the edges whose middles are nodes 4..9.
constexpr std::array<std::array<int, 2>, 6> sides = {{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

/// Gradients of the barycentric coordinates [1/m], and the volume [m^3].
struct Corners {
    Eigen::Matrix<double, 3, 4> gradient;
    double volume;
};

Corners corners_of(const QuadraticMesh& mesh, const std::array<Index, 10>& e) {
    Matrix J;
    for (int k = 0; k < 3; ++k) J.col(k) = mesh.nodes[e[std::size_t(k + 1)]] - mesh.nodes[e[0]];
    Corners c;
    c.volume = J.determinant() / 6;
    c.gradient.rightCols<3>() = J.inverse().transpose();
    c.gradient.col(0) = -c.gradient.rightCols<3>().rowwise().sum();
    return c;
}

/// Gradients of the shape functions L(2L-1) of a corner and 4 L_a L_b of a middle, at barycentric L.
Eigen::Matrix<double, 3, 10> shape_gradients(const Corners& c, const Eigen::Vector4d& L) {
    Eigen::Matrix<double, 3, 10> g;
    for (int a = 0; a < 4; ++a) g.col(a) = (4 * L[a] - 1) * c.gradient.col(a);
    for (int s = 0; s < 6; ++s) {
        const auto [a, b] = sides[std::size_t(s)];
        g.col(4 + s) = 4 * (L[a] * c.gradient.col(b) + L[b] * c.gradient.col(a));
    }
    return g;
}

/// K_ab = integral of  lambda g_a g_b^T + mu (g_b g_a^T + g_a.g_b I); four points, exact for these (degree
/// 2).
Eigen::Matrix<double, 30, 30> stiffness(const Corners& c, double lambda, double mu) {
    const double b = (5 - std::sqrt(5.0)) / 20, a = 1 - 3 * b;
    Eigen::Matrix<double, 30, 30> K = Eigen::Matrix<double, 30, 30>::Zero();
    for (int q = 0; q < 4; ++q) {
        Eigen::Vector4d L = Eigen::Vector4d::Constant(b);
        L[q] = a;
        const Eigen::Matrix<double, 3, 10> g = shape_gradients(c, L) * std::sqrt(c.volume / 4);
        const Eigen::Matrix<double, 10, 10> dot = g.transpose() * g;
        for (int m = 0; m < 10; ++m)
            for (int n = 0; n < 10; ++n)
                K.block<3, 3>(3 * m, 3 * n) += lambda * g.col(m) * g.col(n).transpose() +
                                               mu * g.col(n) * g.col(m).transpose() +
                                               mu * dot(m, n) * Matrix::Identity();
    }
    return K;
}

Eigen::VectorXd flat(std::span<const Vector> u) {
    Eigen::VectorXd v(3 * std::ptrdiff_t(u.size()));
    for (std::size_t i = 0; i < u.size(); ++i) v.segment<3>(3 * std::ptrdiff_t(i)) = u[i];
    return v;
}

Matrix cross_matrix(const Vector& r) {
    Matrix X;
    X << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
    return X;
}

/// Three translations and three rotations, orthonormal.
Eigen::Matrix<double, Eigen::Dynamic, 6> rigid_motions(const std::vector<Vector>& x) {
    Vector mean = Vector::Zero();
    for (const Vector& p : x) mean += p / double(x.size());
    Eigen::Matrix<double, Eigen::Dynamic, 6> R(3 * std::ptrdiff_t(x.size()), 6);
    for (std::size_t i = 0; i < x.size(); ++i)
        R.middleRows<3>(3 * std::ptrdiff_t(i)) << Matrix::Identity(), cross_matrix(x[i] - mean);
    for (int k = 0; k < 6; ++k) {  // Gram and Schmidt
        for (int j = 0; j < k; ++j) R.col(k) -= R.col(j) * R.col(j).dot(R.col(k));
        R.col(k).normalize();
    }
    return R;
}

}  // namespace

QuadraticMesh quadratic(const TetMesh& mesh) {
    QuadraticMesh q{mesh.positions, mesh.positions.size(), {}, {}};
    for (const auto& t : mesh.tetrahedra) {
        std::array<Index, 10> e{t[0], t[1], t[2], t[3]};
        for (std::size_t s = 0; s < 6; ++s) {
            const Index a = t[std::size_t(sides[s][0])], b = t[std::size_t(sides[s][1])];
            const auto [found, added] =
                q.middles.try_emplace(QuadraticMesh::key(a, b), Index(q.nodes.size()));
            if (added) q.nodes.push_back((mesh.positions[a] + mesh.positions[b]) / 2);
            e[4 + s] = found->second;
        }
        q.elements.push_back(e);
    }
    return q;
}

std::vector<bool> held_nodes(const QuadraticMesh& mesh, std::span<const Index> corners) {
    std::vector<bool> held(mesh.nodes.size(), false);
    for (const Index i : corners) held[i] = true;
    for (const auto& e : mesh.elements)
        for (std::size_t s = 0; s < 6; ++s)
            held[e[4 + s]] = held[e[std::size_t(sides[s][0])]] && held[e[std::size_t(sides[s][1])]];
    return held;
}

void add_body_force(const QuadraticMesh& mesh, const Vector& per_volume, std::span<Vector> f) {
    // The integral of a shape function is -V/20 for a corner, V/5 for a middle.
    for (const auto& e : mesh.elements) {
        const Vector whole = corners_of(mesh, e).volume * per_volume;
        for (std::size_t n = 0; n < 10; ++n) f[e[n]] += (n < 4 ? -0.05 : 0.2) * whole;
    }
}

void add_surface_forces(const QuadraticMesh& mesh, Triangles surface, std::span<const SurfaceForce> forces,
                        std::span<Vector> f) {
    for (const SurfaceForce& s : forces) {
        const Triangle& t = surface[s.triangle];
        for (int k = 0; k < 3; ++k) {
            const int l = (k + 1) % 3;
            const Index a = t[std::size_t(k)], b = t[std::size_t(l)];
            f[a] += s.at[k] * (2 * s.at[k] - 1) * s.force;
            f[mesh.middle(a, b)] += 4 * s.at[k] * s.at[l] * s.force;
        }
    }
}

namespace {

/// Three Laplacians, one for each axis, factorised: within the constants of Korn's inequality of the
/// elasticity of the same solid, whatever its mesh. The trace of a block K_ab of the stiffness is
/// (lambda + 4 mu) times the integral of g_a.g_b.
class Laplacians {
  public:
    template <class Matrix>
    Laplacians& compute(const Matrix& K) {
        std::vector<Eigen::Triplet<double, int>> entries;
        for (std::ptrdiff_t column = 0; column < K.cols(); ++column)
            for (typename Matrix::InnerIterator it(K, column); it; ++it)
                if (it.row() % 3 == column % 3)
                    // Nothing may be held: a little more on the diagonal.
                    entries.emplace_back(int(it.row() / 3), int(column / 3),
                                         it.value() * (it.row() == column ? 1 + 1e-4 : 1));
        Sparse S(K.rows() / 3, K.cols() / 3);
        S.setFromTriplets(entries.begin(), entries.end());
        factor_.compute(S);
        return *this;
    }
    template <class Matrix>
    Laplacians& analyzePattern(const Matrix&) {
        return *this;
    }
    template <class Matrix>
    Laplacians& factorize(const Matrix& K) {
        return compute(K);
    }
    /// An orthonormal basis of the rigid motions where nothing is held, else empty: they are kept out of what
    /// comes and goes, where rounding would let them grow.
    Eigen::Matrix<double, Eigen::Dynamic, 6> rigid;

    Eigen::VectorXd solve(const Eigen::VectorXd& residual) const {
        const Eigen::VectorXd b = without_rigid(residual);
        using Axes = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
        const Eigen::Matrix<double, Eigen::Dynamic, 3> x =
            factor_.solve(Eigen::Map<const Axes>(b.data(), b.size() / 3, 3));
        Eigen::VectorXd z(b.size());
        Eigen::Map<Axes>(z.data(), x.rows(), 3) = x;
        return without_rigid(std::move(z));
    }
    Eigen::ComputationInfo info() const { return factor_.info(); }

  private:
    Eigen::VectorXd without_rigid(Eigen::VectorXd v) const {
        if (rigid.rows() == v.size()) v -= rigid * (rigid.transpose() * v).eval();
        return v;
    }

    Eigen::SimplicialLDLT<Sparse, Eigen::Lower> factor_;
};

}  // namespace

struct ElasticSolid::Solver {
    Sparse K;  ///< over the unknowns, lower half
    Eigen::ConjugateGradient<Sparse, Eigen::Lower, Laplacians> cg;
};

ElasticSolid::~ElasticSolid() = default;
ElasticSolid::ElasticSolid(ElasticSolid&&) noexcept = default;

ElasticSolid::ElasticSolid(QuadraticMesh mesh, const ElasticMaterial& m, std::vector<bool> held)
    : mesh_(std::move(mesh)), held_(std::move(held)), solver_(std::make_unique<Solver>()) {
    if (!(m.young > 0 && std::isfinite(m.young)))
        throw InputError(fmt::format("Young's modulus of the reference: {:g} Pa must be positive", m.young));
    if (!(m.poisson > -1 && m.poisson <= largest_element_poisson))
        throw InputError(
            fmt::format("Poisson's ratio of the elements: {:g} must lie above -1 and be at most {}",
                        m.poisson, largest_element_poisson));
    const double lambda = m.young * m.poisson / ((1 + m.poisson) * (1 - 2 * m.poisson)),
                 mu = m.young / (2 * (1 + m.poisson));
    std::vector<Eigen::Triplet<double, int>> entries;
    entries.reserve(mesh_.elements.size() * 465);
    for (std::size_t n = 0; n < mesh_.elements.size(); ++n) {
        const auto& e = mesh_.elements[n];
        const Corners c = corners_of(mesh_, e);
        if (!(c.volume > 0)) throw InputError(fmt::format("tetrahedron {} is flat or inverted", n));
        const Eigen::Matrix<double, 30, 30> K = stiffness(c, lambda, mu);
        for (int i = 0; i < 30; ++i)
            for (int j = 0; j < 30; ++j) {
                const int row = 3 * int(e[std::size_t(i / 3)]) + i % 3,
                          column = 3 * int(e[std::size_t(j / 3)]) + j % 3;
                if (row >= column) entries.emplace_back(row, column, K(i, j));
            }
    }
    const auto size = 3 * std::ptrdiff_t(mesh_.nodes.size());
    whole_.resize(size, size);
    whole_.setFromTriplets(entries.begin(), entries.end());

    unknown_.assign(mesh_.nodes.size(), no_index);
    Index unknowns = 0;
    for (std::size_t i = 0; i < held_.size(); ++i)
        if (!held_[i]) unknown_[i] = unknowns++;
    floating_ = unknowns == mesh_.nodes.size();
    entries.clear();
    for (std::ptrdiff_t column = 0; column < size; ++column)
        for (Sparse::InnerIterator it(whole_, column); it; ++it) {
            const Index i = unknown_[std::size_t(it.row() / 3)], j = unknown_[std::size_t(column / 3)];
            if (i != no_index && j != no_index)
                entries.emplace_back(3 * int(i) + int(it.row() % 3), 3 * int(j) + int(column % 3),
                                     it.value());
        }
    solver_->K.resize(3 * int(unknowns), 3 * int(unknowns));
    solver_->K.setFromTriplets(entries.begin(), entries.end());
    solver_->cg.setTolerance(1e-12);
    solver_->cg.setMaxIterations(5000);
    if (floating_) solver_->cg.preconditioner().rigid = rigid_motions(mesh_.nodes);
    if (unknowns > 0) solver_->cg.compute(solver_->K);
}

std::vector<Vector> ElasticSolid::solve(std::vector<Vector> f, std::span<const Vector> prescribed) const {
    std::vector<Vector> u(mesh_.nodes.size(), Vector::Zero());
    const std::vector<double> one(u.size(), 1.0);
    for (std::size_t i = 0; i < u.size(); ++i)
        if (held_[i] && !prescribed.empty()) u[i] = prescribed[i];
    if (floating_) remove_rigid_motion(mesh_.nodes, one, f);  // no net force, no net torque is left
    const Eigen::VectorXd rest = flat(f) - whole_.selfadjointView<Eigen::Lower>() * flat(u);
    Eigen::VectorXd b(solver_->K.rows());
    for (std::size_t i = 0; i < u.size(); ++i)
        if (unknown_[i] != no_index)
            b.segment<3>(3 * std::ptrdiff_t(unknown_[i])) = rest.segment<3>(3 * std::ptrdiff_t(i));
    if (b.size() == 0 || b.norm() == 0) return u;
    const Eigen::VectorXd x = solver_->cg.solve(b);
    if (solver_->cg.info() != Eigen::Success || !x.allFinite())
        throw RunError(fmt::format("the elements' equations were not solved: {:.2g} left after {} iterations",
                                   solver_->cg.error(), solver_->cg.iterations()));
    for (std::size_t i = 0; i < u.size(); ++i)
        if (unknown_[i] != no_index) u[i] = x.segment<3>(3 * std::ptrdiff_t(unknown_[i]));
    if (floating_) remove_rigid_motion(mesh_.nodes, one, u);
    return u;
}

double ElasticSolid::energy(std::span<const Vector> u) const {
    const Eigen::VectorXd v = flat(u);
    return v.dot(whole_.selfadjointView<Eigen::Lower>() * v) / 2;
}

void remove_rigid_motion(std::span<const Vector> x, std::span<const double> weight, std::span<Vector> u) {
    double sum = 0;
    Vector centre = Vector::Zero(), mean = Vector::Zero(), torque = Vector::Zero();
    for (std::size_t i = 0; i < x.size(); ++i)
        sum += weight[i], centre += weight[i] * x[i], mean += weight[i] * u[i];
    centre /= sum, mean /= sum;
    Matrix inertia = Matrix::Zero();
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Matrix X = cross_matrix(x[i] - centre);
        inertia -= weight[i] * X * X;
        torque += weight[i] * X * u[i];
    }
    const Vector turn = inertia.ldlt().solve(torque);
    for (std::size_t i = 0; i < x.size(); ++i) u[i] -= mean + turn.cross(x[i] - centre);
}

}  // namespace innerspring
