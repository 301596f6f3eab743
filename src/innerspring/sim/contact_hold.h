#pragma once
#include <Eigen/SparseCholesky>

#include "innerspring/sim/contact.h"

namespace innerspring {

/// What is kept of a contact while a body's energy is lowered: the points that tools press on move only along
/// the tool, those that stick not at all, and on those that slide friction is a constant force.
class ContactHold {
  public:
    using Field = std::vector<Vector>;

    /// The points of the contact with an impulse, over h [s].
    void take(const Contact& contact, std::span<const Candidate> candidates, double h);
    void release() { single_.clear(), rows_.clear(), forces_.clear(); }
    bool empty() const { return single_.empty() && rows_.empty(); }

    /// Adds the energy [J] and the gradient [N] of the constant forces.
    double add_forces(const Field& x, Field& g) const;

    /// v += what keeps the points where they may not move.
    void project(Field& v) const;

  private:
    struct Single {
        Index vertex;
        bool sticks;
        Vector normal;
    };
    struct Row {  ///< sum_k weights_k direction . v_k = 0
        std::array<Index, 3> vertices;
        std::array<double, 3> weights;
        int count;
        Vector direction;
    };
    struct Push {
        std::array<Index, 3> vertices;
        std::array<double, 3> weights;
        int count;
        Vector force;  ///< [N]
    };
    void factorize();

    std::vector<Single> single_;  ///< vertices touched in one point only
    std::vector<Row> rows_;       ///< all else
    std::vector<Push> forces_;
    std::vector<int> uses_;  ///< per candidate
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
    mutable Eigen::VectorXd b_, y_;
};

}  // namespace innerspring
