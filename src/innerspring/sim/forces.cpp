#include "innerspring/sim/forces.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

namespace innerspring {

namespace {

using Matrix3 = Eigen::Matrix3d;

Matrix3 full(const Symmetric& s) {
    Matrix3 m;
    m << s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz;
    return m;
}

/// Sums over vertices at x, at rest at q, of stiffness K, a matrix, from which the energy of their springs
/// follows in any frame.
struct SpringSums {
    using Six = Eigen::Matrix<double, 6, 1>;
    Eigen::Matrix<double, 6, 10> Kx = Eigen::Matrix<double, 6, 10>::Zero();  ///< K times 1, x and x x^T
    Eigen::Matrix<double, 3, 4> q = Eigen::Matrix<double, 3, 4>::Zero();     ///< K q times 1 and x^T

    void add(double mean, const Symmetric& N, const Vector& rest, const Vector& x) {
        const Symmetric K{mean + N.xx, N.xy, N.xz, mean + N.yy, N.yz, mean + N.zz};
        Six k;
        k << K.xx, K.xy, K.xz, K.yy, K.yz, K.zz;
        const double y[9] = {x[0],        x[1],        x[2],        x[0] * x[0], x[0] * x[1],
                             x[0] * x[2], x[1] * x[1], x[1] * x[2], x[2] * x[2]};
        Kx.col(0) += k;
        for (int n = 0; n < 9; ++n) Kx.col(n + 1) += y[n] * k;
        const Vector Kq = K * rest;
        q.col(0) += Kq;
        for (int n = 0; n < 3; ++n) q.col(n + 1) += x[n] * Kq;
    }
    void add(const SpringSums& other) { Kx += other.Kx, q += other.q; }
    Matrix3 K_times(int column) const {
        const Six k = Kx.col(column);
        return full({k[0], k[1], k[2], k[3], k[4], k[5]});
    }
};

/// Of the polar decomposition from the frame of the energy [rad]: beyond it other minima are looked for.
constexpr double far = 0.3;

/// Brings R and t from near it to the minimum of sum_i r . K r / 2, r = y - q, y = R^T (x - t): Newton's
/// method in a small motion, y to exp(-[w]) (y - s), which gives r + y x w - s + w x s + w x (w x y) / 2.
/// False if the way was far or not downhill all along, so that there may be lower minima: then it is
/// shortened until the energy falls, as it is from the beginning without `sure`. `energy`: at the end, up to
/// a constant [J]; found only then.
bool minimise(const SpringSums& sums, Matrix3& R, Vector& t, double& energy, bool sure = true) {
    using Matrix6 = Eigen::Matrix<double, 6, 6>;
    using Vector6 = Eigen::Matrix<double, 6, 1>;
    constexpr int second[3][3] = {{4, 5, 6}, {5, 7, 8}, {6, 8, 9}};  // where K x_m x_n is
    const Matrix3 K = sums.K_times(0);
    Matrix3 K1[3], K2[3][3];
    for (int m = 0; m < 3; ++m) {
        K1[m] = sums.K_times(m + 1);
        for (int n = 0; n < 3; ++n) K2[m][n] = sums.K_times(second[m][n]);
    }
    Matrix3 A = R.transpose();
    Vector b = -A * t;
    // With f = K r: sum f, and sum f x^T.
    const auto forces = [&](const Matrix3& turned, const Vector& moved, Vector& F, Matrix3& fx) {
        F = K * moved - sums.q.col(0);
        fx = -sums.q.rightCols<3>();
        for (int m = 0; m < 3; ++m) {
            F += K1[m] * turned.col(m);
            fx.col(m) += K1[m] * moved;
            for (int n = 0; n < 3; ++n) fx.col(n) += K2[m][n] * turned.col(m);
        }
    };
    // sum r . K r / 2 = sum (f - K q) . y / 2, up to a constant.
    const auto energy_at = [&](const Matrix3& turned, const Vector& moved) {
        Vector F;
        Matrix3 fx;
        forces(turned, moved, F, fx);
        return ((fx - sums.q.rightCols<3>()).cwiseProduct(turned).sum() + (F - sums.q.col(0)).dot(moved)) / 2;
    };
    double before = INFINITY;
    for (int iteration = 0; iteration < (sure ? 30 : 200); ++iteration) {
        Vector F;
        Matrix3 fx;
        forces(A, b, F, fx);
        const Matrix3 fy = fx * A.transpose() + F * b.transpose();
        // sum K y_c and sum K y_c y_d.
        Matrix3 Ky[3], Kyy[3][3];
        for (int c = 0; c < 3; ++c) {
            Ky[c] = b[c] * K;
            for (int m = 0; m < 3; ++m) Ky[c] += A(c, m) * K1[m];
        }
        for (int c = 0; c < 3; ++c)
            for (int d = c; d < 3; ++d) {
                Kyy[c][d] = b[c] * Ky[d] + b[d] * (Ky[c] - b[c] * K);
                for (int m = 0; m < 3; ++m)
                    for (int n = 0; n < 3; ++n) Kyy[c][d] += A(c, m) * A(d, n) * K2[m][n];
                Kyy[d][c] = Kyy[c][d];
            }
        Vector6 g;  // by s and w
        g << -F, fy(1, 2) - fy(2, 1), fy(2, 0) - fy(0, 2), fy(0, 1) - fy(1, 0);
        Matrix6 H;
        H.topLeftCorner<3, 3>() = K;
        Matrix3 cross, spin;
        cross << 0, -F.z(), F.y(), F.z(), 0, -F.x(), -F.y(), F.x(), 0;
        // e_c x e_j is the third axis, or minus it.
        for (int j = 0; j < 3; ++j)
            for (const int c : {(j + 1) % 3, (j + 2) % 3}) {
                const double sign_c = c == (j + 1) % 3 ? -1 : 1;
                cross.col(j) -= sign_c * Ky[c].col(3 - j - c);
            }
        for (int j = 0; j < 3; ++j)
            for (int k = 0; k < 3; ++k) {
                double sum = (fy(j, k) + fy(k, j)) / 2;
                for (const int c : {(j + 1) % 3, (j + 2) % 3})
                    for (const int d : {(k + 1) % 3, (k + 2) % 3}) {
                        const bool same = (c == (j + 1) % 3) == (d == (k + 1) % 3);
                        const double K_yy = Kyy[c][d](3 - j - c, 3 - k - d);
                        sum += same ? K_yy : -K_yy;
                    }
                spin(j, k) = sum - (j == k ? fy.trace() : 0);
            }
        H.topRightCorner<3, 3>() = cross;
        H.bottomLeftCorner<3, 3>() = cross.transpose();
        H.bottomRightCorner<3, 3>() = spin;
        Eigen::LLT<Matrix6> llt(H);
        if (llt.info() != Eigen::Success) {  // far from any minimum: downhill
            llt.compute(H + H.cwiseAbs().rowwise().sum().maxCoeff() * Matrix6::Identity());
            sure = false;
        }
        Vector6 step = -llt.solve(g);
        double angle = step.tail<3>().norm();
        if (!step.allFinite() || !(angle < 1e3)) break;
        if (angle > far) sure = false;
        const double here = sure || angle < 1e-6 ? 0 : energy_at(A, b);
        Matrix3 A_next;
        Vector b_next;
        for (int cut = 0;; ++cut) {
            const Vector w = step.tail<3>();
            const Matrix3 turn = angle > 0 ? Eigen::AngleAxisd(-angle, w / angle).toRotationMatrix()
                                           : Matrix3(Matrix3::Identity());
            A_next = turn * A, b_next = turn * (b - step.head<3>());
            if (sure || angle < 1e-6 || cut == 40 || energy_at(A_next, b_next) < here) break;
            step /= 2, angle /= 2;
        }
        A = A_next, b = b_next;
        R = A.transpose(), t = -R * b;
        // Convergence is quadratic: the next one would be rounding.
        if (angle < 1e-9 || (angle < 1e-6 && angle >= before)) break;
        before = angle;
    }
    if (!sure) energy = energy_at(A, b);
    return sure;
}

}  // namespace

HomeFrame home_frame(const Body& body, Positions x, Team& team) {
    HomeFrame frame;
    if (!body.free) return frame;
    struct Sums {
        double K = 0;
        Vector q = Vector::Zero(), x = Vector::Zero();
        Matrix3 xq = Matrix3::Zero();
        SpringSums springs;
    };
    // About one vertex, so that a body far from the origin loses no digits.
    const Vector q0 = body.rest.positions[0], x0 = x[0];
    const bool anisotropic = !body.N.empty();
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
            if (anisotropic) s.springs.add(K, body.N[i], q, y);
        }
    });
    Sums sum;
    for (const Sums& s : blocks) {
        sum.K += s.K, sum.q += s.q, sum.x += s.x, sum.xq += s.xq;
        if (anisotropic) sum.springs.add(s.springs);
    }
    const Vector q_mean = sum.q / sum.K, x_mean = sum.x / sum.K;
    const Matrix3 A = sum.xq - sum.K * x_mean * q_mean.transpose();
    const Eigen::JacobiSVD<Matrix3> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Vector sign(1, 1,
                (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0
                    ? -1
                    : 1);  // a rotation, never a reflection
    frame.R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
    frame.t = x0 + x_mean - frame.R * (q0 + q_mean);
    if (anisotropic) {
        const Matrix3 polar = frame.R;
        Vector t = x_mean - polar * q_mean;
        double least = 0;
        if (!minimise(sum.springs, frame.R, t, least)) {
            // The least of all minima is continuous in x where one of them is not.
            for (int start = 0; start < 9; ++start) {
                Matrix3 R = polar * Eigen::AngleAxisd((start / 3 + 1) * EIGEN_PI / 2, Vector::Unit(start % 3))
                                        .toRotationMatrix();
                Vector s = x_mean - R * q_mean;
                double energy = INFINITY;
                minimise(sum.springs, R, s, energy, false);
                if (energy < least) least = energy, frame.R = R, t = s;
            }
        }
        frame.t = x0 + t - frame.R * q0;
    }
    return frame;
}

double inner_energy(const Body& body, const HomeFrame& frame, Positions x) {
    double energy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Vector u = x[i] - (frame.R * body.rest.positions[i] + frame.t);
        energy -= u.dot(inner_force(body, frame, i, u)) / 2;
    }
    return energy;
}

void add_inner_forces(const Body& body, const HomeFrame& frame, Positions x, std::span<Vector> f) {
    for (std::size_t i = 0; i < x.size(); ++i)
        f[i] += inner_force(body, frame, i, x[i] - (frame.R * body.rest.positions[i] + frame.t));
}

namespace {

/// Adds R N_i R^T u_of(i) to `out` where not fixed; returns the sum of its product with u_of(i), those
/// that are fixed too if asked.
template <class U>
double add_turned(const Body& body, const Matrix3& R, U&& u_of, const std::vector<bool>& fixed,
                  bool count_fixed, std::span<Vector> out, Team& team) {
    const std::size_t n = body.vertices();
    std::vector<double> blocks(block_count(n), 0.0);
    team.run(blocks.size(), [&](std::size_t block) {
        for (std::size_t i = block * block_size; i < std::min(n, (block + 1) * block_size); ++i) {
            if (fixed[i] && !count_fixed) continue;
            const Vector u = u_of(i), Nu = R * (body.N[i] * Vector(R.transpose() * u));
            blocks[block] += u.dot(Nu);
            if (!fixed[i]) out[i] += Nu;
        }
    });
    double sum = 0;
    for (double part : blocks) sum += part;
    return sum;
}

}  // namespace

double add_deviation(const Body& body, const HomeFrame& frame, Positions x, const std::vector<bool>& fixed,
                     std::span<Vector> g, Team& team) {
    if (body.N.empty()) return 0;
    const auto u = [&](std::size_t i) -> Vector {
        return x[i] - (frame.R * body.rest.positions[i] + frame.t);
    };
    // What is fixed pulls at a frame that moves.
    return add_turned(body, frame.R, u, fixed, body.free, g, team) / 2;
}

double multiply_deviation(const Body& body, const HomeFrame& frame, std::span<const Vector> p,
                          const std::vector<bool>& fixed, std::span<Vector> q, Team& team) {
    if (body.N.empty()) return 0;
    return add_turned(
        body, frame.R, [&](std::size_t i) { return p[i]; }, fixed, false, q, team);
}

Eigen::Matrix3d deviation_sum(const Body& body) {
    Matrix3 sum = Matrix3::Zero();
    for (const Symmetric& N : body.N) sum += full(N);
    return sum;
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
