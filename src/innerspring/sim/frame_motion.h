#pragma once
#include <Eigen/Cholesky>

#include "innerspring/sim/forces.h"

namespace innerspring {

/// The frame of a free body follows x: its Hessian is H - B S^-1 B^T, S the 6 x 6 second derivative of the
/// inner energy by a small translation and rotation of the frame, B_i the mixed one. In the frame, about the
/// mean of x, with y_i = R^T (x_i - mean), r_i = R^T (x_i - h_i) and f_i = K_i r_i (K_i a matrix if
/// anisotropic),
///     B_i = R [-K_i, K_i [y_i]x - [f_i]x],
///     S = sum_i [K_i, -K_i [y_i]x; ., [y_i]x^T K_i [y_i]x + sym(f_i y_i^T) - f_i . y_i].
class FrameMotion {
  public:
    FrameMotion(const Body& body, const HomeFrame& frame, const std::vector<Vector>& x)
        : body_(body), R_(frame.R), y_(x.size()), f_(x.size()) {
        Vector mean = Vector::Zero();
        double K = 0;
        for (std::size_t i = 0; i < x.size(); ++i) mean += body.K[i] * x[i], K += body.K[i];
        mean /= K;
        Matrix6 S = Matrix6::Zero();
        for (std::size_t i = 0; i < x.size(); ++i) {
            y_[i] = R_.transpose() * (x[i] - mean);
            f_[i] = stretched(i, R_.transpose() * (x[i] - (frame.R * body.rest.positions[i] + frame.t)));
            for (int j = 0; j < 3; ++j) {
                const Vector e = Vector::Unit(j), turned = stretched(i, y_[i].cross(e));
                S.col(j).head<3>() += stretched(i, e);
                S.col(j + 3).head<3>() -= turned;
                S.col(j + 3).tail<3>() +=
                    turned.cross(y_[i]) + (f_[i] * y_[i][j] + y_[i] * f_[i][j]) / 2 - f_[i].dot(y_[i]) * e;
            }
        }
        S.bottomLeftCorner<3, 3>() = S.topRightCorner<3, 3>().transpose();
        S_.compute(S);
        // Not so only where the frame is about to flip; then it is held.
        positive_ = S_.info() == Eigen::Success;
    }

    /// q -= B S^-1 B^T p where not pinned; returns what p . q changes by.
    double add_to(const std::vector<Vector>& p, const std::vector<bool>& pinned,
                  std::vector<Vector>& q) const {
        if (!positive_) return 0;
        Vector6 b = Vector6::Zero();
        for (std::size_t i = 0; i < p.size(); ++i) {
            const Vector local = R_.transpose() * p[i], Kp = stretched(i, local);
            b.head<3>() -= Kp;
            b.tail<3>() += Kp.cross(y_[i]) + f_[i].cross(local);
        }
        const Vector6 a = S_.solve(b);
        const Vector s = a.head<3>(), w = a.tail<3>();
        for (std::size_t i = 0; i < p.size(); ++i)
            if (!pinned[i]) q[i] -= R_ * (stretched(i, y_[i].cross(w) - s) - f_[i].cross(w));
        return -a.dot(b);
    }

  private:
    using Matrix6 = Eigen::Matrix<double, 6, 6>;
    using Vector6 = Eigen::Matrix<double, 6, 1>;

    /// K_i v in the frame.
    Vector stretched(std::size_t i, const Vector& v) const {
        return body_.N.empty() ? Vector(body_.K[i] * v) : Vector(body_.K[i] * v + body_.N[i] * v);
    }

    const Body& body_;
    Eigen::Matrix3d R_;
    std::vector<Vector> y_, f_;
    Eigen::LLT<Matrix6> S_;
    bool positive_ = false;
};

}  // namespace innerspring
