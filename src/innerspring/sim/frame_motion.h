#pragma once
#include <Eigen/Cholesky>

#include "innerspring/sim/forces.h"

namespace innerspring {

/// The frame of a free body follows x: its Hessian is H - B S^-1 B^T, S the 6 x 6 second derivative of the
/// inner energy by a small translation and rotation of the homes, B_i = K_i [I, -[r_i]x] the mixed one,
/// r_i = h_i - mean of x.
class FrameMotion {
  public:
    FrameMotion(const Body& body, const HomeFrame& frame, const std::vector<Vector>& x)
        : body_(body), r_(x.size()) {
        Vector mean = Vector::Zero();
        double K = 0;
        for (std::size_t i = 0; i < x.size(); ++i) mean += body.K[i] * x[i], K += body.K[i];
        mean /= K;
        Matrix6 S = Matrix6::Zero();
        S.topLeftCorner<3, 3>().diagonal().setConstant(K);
        for (std::size_t i = 0; i < x.size(); ++i) {
            r_[i] = frame.R * body.rest.positions[i] + frame.t - mean;
            const Vector y = x[i] - mean;
            const Eigen::Matrix3d yr = y * r_[i].transpose();
            S.bottomRightCorner<3, 3>() +=
                body.K[i] * (y.dot(r_[i]) * Eigen::Matrix3d::Identity() - (yr + yr.transpose()) / 2);
        }
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
            b.head<3>() += body_.K[i] * p[i];
            b.tail<3>() += body_.K[i] * r_[i].cross(p[i]);
        }
        const Vector6 a = S_.solve(b);
        for (std::size_t i = 0; i < p.size(); ++i)
            if (!pinned[i]) q[i] -= body_.K[i] * (a.head<3>() + a.tail<3>().cross(r_[i]));
        return -a.dot(b);
    }

  private:
    using Matrix6 = Eigen::Matrix<double, 6, 6>;
    using Vector6 = Eigen::Matrix<double, 6, 1>;
    const Body& body_;
    std::vector<Vector> r_;
    Eigen::LLT<Matrix6> S_;
    bool positive_ = false;
};

}  // namespace innerspring
