#pragma once
#include "innerspring/sim/forces.h"
#include "innerspring/sim/vector_kernels.h"

namespace innerspring {

/// The surface net with a spring from every vertex to a place of its own: what an implicit step and an
/// equilibrium have in common.
///     Phi(x) = sum_i d_i |x_i - z_i|^2 / 2 + sum_e k_e (|x_b - x_a| - l_e)^2 / 2
/// Pinned vertices have neither spring to a place nor gradient. Arrays are per vertex; two passes, over the
/// edges and over the vertices, share out over the team with the same bits for any number of threads.
class Net {
  public:
    explicit Net(const Body& body);
    void adapt();  ///< to the body's springs as they are now

    struct Value {
        double surface = 0, places = 0;  ///< both sums [J]
        double gradient2 = 0;            ///< |gradient|^2 [N^2]
        double total() const { return surface + places; }
    };
    /// Phi and its gradient g = d_i (x_i - z_i) + sum_j s_ij (x_i - x_j), s = k (1 - l/|d|).
    Value evaluate(const std::vector<Vector>& x, std::span<const double> d, const std::vector<Vector>& z,
                   const std::vector<bool>& pinned, std::vector<Vector>& g, Team& team);

    /// Keeps the Hessian of the springs at x: k (u u^T + (1 - l/|d|) (I - u u^T)), u = d/|d|.
    void linearise(const std::vector<Vector>& x, Team& team);

    /// q = (diag(d) + that Hessian) p; p is zero where pinned, and so is q. Returns p . q.
    double multiply(std::span<const double> d, const std::vector<Vector>& p, const std::vector<bool>& pinned,
                    std::vector<Vector>& q, Team& team);

    /// Lowers Phi vertex by vertex where springs were pressed hard enough in the last linearise() to give way
    /// sideways (ours): sweeps of small Newton steps, each with its neighbours held, to and fro (see
    /// Settling). A net without resistance to bending wrinkles from one vertex to the next, which costs
    /// Newton's method a step for every few of them, and this next to nothing.
    void settle(std::vector<Vector>& x, std::span<const double> d, const std::vector<Vector>& z,
                const std::vector<bool>& pinned);

  private:
    const Body& body_;
    std::vector<NetRow> rows_;      ///< per vertex
    std::vector<NetSpoke> spokes_;  ///< close together
    std::vector<double> s_;         ///< per edge: k (1 - l/|d|), of the last evaluate()
    /// Per edge sqrt(k l/|d|) u and k (1 - l/|d|), of the last linearise().
    std::vector<Eigen::Vector4d> tangent_;
    std::vector<Index> loose_;  ///< see settle()
    std::vector<Value> blocks_;
};

}  // namespace innerspring
