#pragma once
#include "innerspring/sim/factor.h"
#include "innerspring/sim/forces.h"

namespace innerspring {

/// An approximate inverse of diag(d) + Hessian of the surface net (ours). A net near its rest lengths resists
/// in its own plane as the Laplacian L of the k_e does, and hardly across it. So: the factor of diag(d) + L
/// in the tangent plane, a diagonal along the normal n,
///     z = (I - n n^T) (diag(d) + L)^-1 (I - n n^T) r + n (n . r) / D_i,
/// symmetric and positive definite whatever n and D are. Of an anisotropic body the tangent plane has d_i and
/// half the trace of N_i in that plane, -n . N_i n / 2 as N_i has none, and the normal d_i + n . N_i n.
class Preconditioner {
  public:
    explicit Preconditioner(const Body& body);

    void factorize(const Body& body, std::span<const double> d, const std::vector<bool>& pinned);
    void adapt(const Body& body, std::span<const double> d, const std::vector<bool>& pinned,
               const SurfaceChange& surface, const BodyChange& change);

    /// Only the order of elimination; factorize() is to follow.
    void adapt_order(const Body& body, const SurfaceChange& surface, const BodyChange& change);

    /// D_i = d_i + share sum_e k_e ((n . u)^2 + (1 - (n . u)^2) max(0, 1 - l/|d|)), u = d/|d| the directions
    /// of the springs at x.
    void set_normal_stiffness(const Body& body, std::span<const double> d, const std::vector<Vector>& x,
                              double share);
    /// The normals of the surface at x from now on. (They are those at rest before.)
    void follow(const Body& body, const std::vector<Vector>& x);
    /// The normals at rest turned by R.
    void turn(const Body& body, const Eigen::Matrix3d& R);

    /// z from r; both zero where pinned. Returns r . z, the same bits for any number of threads.
    double apply(const std::vector<Vector>& r, std::vector<Vector>& z, Team& team) const;

    const Factor& factor() const { return factor_; }

  private:
    template <class Real>
    double run(const std::vector<Vector>& r, std::vector<Vector>& z, std::vector<Real>& w, Team& team) const;
    void find_normals(const Body& body);
    std::span<const double> in_plane(const Body& body, std::span<const double> d);

    Factor factor_;
    std::vector<Vector> rest_normal_, normal_;
    std::vector<double> compliance_;         ///< 1 / D_i [m/N]
    std::vector<double> deviation_, plane_;  ///< anisotropic: n . N_i n at rest, and d_i in the plane [N/m]
    mutable std::vector<float> float_work_;
    mutable std::vector<double> double_work_, blocks_;
};

}  // namespace innerspring
