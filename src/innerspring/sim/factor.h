#pragma once
#include <Eigen/Core>

#include "innerspring/sim/dissection.h"
#include "innerspring/sim/large_pages.h"
#include "innerspring/sim/vector_kernels.h"

namespace innerspring {

/// Cholesky factor of the scalar matrix diag(d) + L, L the Laplacian of the surface springs k_e: one matrix
/// for x, y and z. Made in double, node by node of a dissection (left-looking, the columns of a node dense);
/// solved for the three coordinates together, in float where that is enough for a preconditioner: a solution
/// is right to about 1e-7 times the condition number.
class Factor {
  public:
    explicit Factor(const Body& body);

    /// Factorises for d [N/m], per vertex, all > 0. A pinned vertex is cut off: its row is a
    /// multiple of the identity's, and its neighbours keep their springs to it.
    void factorize(const Body& body, std::span<const double> d, const std::vector<bool>& pinned);

    /// The same after a refinement or its undoing: anew only the nodes whose columns changed and those above
    /// them, unless the change is large. `d` and `pinned` are for the body as it is now; elsewhere than
    /// `change` says they are as they were.
    void adapt(const Body& body, std::span<const double> d, const std::vector<bool>& pinned,
               const SurfaceChange& surface, const BodyChange& change);

    /// Only the order, where nothing is factorised yet or all will be anew. The factor of a matrix is the
    /// same to the last bit whichever way it was come by, if the changes of the surface were the same.
    std::optional<std::vector<int>> adapt_tree(const Body& body, const SurfaceChange& surface,
                                               const BodyChange& change);

    /// In place, four numbers for each place of the tree: x, y, z and one that is 0, in the first of
    /// solve_size() numbers. The solution is that of the matrix times scale(); Real is float if in_float(),
    /// else double.
    template <class Real>
    void solve(Real* w) const;
    std::size_t solve_size() const {
        return 4 * (tree_.node_of.size() + widest_ + PanelProduct<float>::beyond);
    }
    double scale() const { return scale_; }
    bool in_float() const { return in_float_; }

    /// x = A^-1 b, per vertex; they may be the same.
    void solve(const Vector* b, Vector* x) const;

    const Dissection& tree() const { return tree_; }
    std::size_t entries() const;                    ///< kept for solving
    int nodes_made() const { return nodes_made_; }  ///< by the last factorize() or adapt()

  private:
    struct Panel {
        Eigen::MatrixXd L;  ///< the columns' triangle above the rows
        int s = 0, r = 0;
        std::size_t places = 0, down = 0, up = 0;  ///< where they start below
    };
    void lay_out(const std::vector<int>& to_make);
    void make(const Body& body, std::span<const double> d, const std::vector<bool>& pinned, int node);
    bool float_is_enough(const Body& body, std::span<const double> d, double& largest) const;

    Dissection tree_;
    std::vector<Panel> panels_;  ///< per node
    std::vector<int> places_;    ///< of each node the columns, then the rows
    /// Of each node, for solving, in the order they are read: B = L_RJ L_JJ^-1, children first; then
    /// ((L_JJ L_JJ^T)^-1, -B^T), parents first. Column by column.
    LargeArray<float> float_;
    LargeArray<double> double_;
    double scale_ = 1;
    bool in_float_ = true;
    int nodes_made_ = 0;
    std::size_t widest_ = 0;
    std::vector<int> local_;  ///< per place, in the panel at hand
    Eigen::MatrixXd product_;
};

}  // namespace innerspring
