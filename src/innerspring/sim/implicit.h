#pragma once
#include <Eigen/SparseCholesky>

#include "innerspring/sim/kernel.h"
#include "innerspring/sim/step.h"

namespace innerspring {

/// Implicit Euler as a minimisation (ours): x' is the minimum of
///     Phi(x) = sum_i m_i |x_i - y_i|^2 / (2 h^2) + h c_i |v_i - v_home,i|^2 / 2 + U(x),
///     y_i = x_i^n + h v_i^n + h^2 (g + f_i / m_i),  v_i = (x_i - x_i^n) / h,  U the inner and surface
///     energies.
/// v_home is zero for a held body, else the rigid motion nearest to v, so that damping changes no momentum.
/// Being the nearest, it moves with x without changing the gradient. The constant matrix A = M/h^2 + C/h +
/// diag(K) + L, L the Laplacian of the k_e, is never below Phi's Hessian (see stability.h), so x - A^-1 grad
/// Phi always descends: stable at any h and stiffness. A is factorised once, the same for x, y and z; L-BFGS
/// with A as its first matrix brings quick convergence (as Liu, Bouaziz & Kavan 2017 do for projective
/// dynamics).
class ImplicitSolver {
  public:
    ImplicitSolver(const Body& body, double h);
    StepReport step(const Loads& loads, const StepOptions& options, State& state, Team& team);

  private:
    using Field = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;  ///< one row per vertex
    struct Pair {
        Field s, y;      ///< change of position and of gradient
        double inverse;  ///< 1 / (s . y)
    };
    void factorize(const Loads& loads);
    double evaluate(const Field& x, Field& gradient, Team& team) const;
    Field descend(const Field& gradient) const;  ///< -(L-BFGS matrix)^-1 gradient

    const Body& body_;
    double h_;
    std::vector<Index> pinned_;  ///< sorted; the factor is for these
    bool factorized_ = false;
    Eigen::SparseMatrix<double> A_;
    Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> factor_;
    std::vector<bool> is_pinned_;
    Field target_, start_;  ///< y and x^n of the step at hand
    std::vector<Pair> pairs_;
};

}  // namespace innerspring
