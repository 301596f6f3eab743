#pragma once
#include <Eigen/SparseCholesky>

#include "innerspring/sim/contact.h"

namespace innerspring {

/// What is kept of a contact while a body's energy is lowered: the points that tools press on move only along
/// the tool, and those that stick not at all. On those that slide friction pulls with
///     f = P(f_0 - D s),   P onto |f| <= mu f_n,
/// s how far they slip along the tool, f_0 and f_n as they were found, D a few times the stiffness of the net
/// there (an augmented Lagrangian, Alart & Curnier 1991: what D is does not change where it ends).
class ContactHold {
  public:
    using Field = std::vector<Vector>;

    /// The points of the contact with an impulse, over h [s].
    void take(const Contact& contact, std::span<const Candidate> candidates, double h);
    void reserve(std::size_t vertices);  ///< so that nothing is allocated but for points within triangles
    void release() { single_.clear(), rows_.clear(), sliding_.clear(); }
    bool empty() const { return single_.empty() && rows_.empty(); }

    /// Adds the gradient [N] of friction and returns its energy [J].
    double add_friction(const Field& x, Field& g) const;

    void linearise(const Field& x);
    /// q += the Hessian of friction times p; returns p . that.
    double multiply_friction(const Field& p, Field& q) const;

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
    struct Sliding {
        std::array<Index, 3> vertices;
        std::array<double, 3> weights;
        int count;
        Vector normal, force, stuck;  ///< f_0 [N]; where it would be if it stuck [m]
        double most, stiffness;       ///< mu f_n [N]; D [N/m]
        Vector pull;                  ///< f_0 - D s of the last linearise()
    };
    static Vector pull_at(const Sliding& s, const Field& x);
    void factorize();
    void project_rows(Field& v) const;

    std::vector<Single> single_;  ///< vertices touched in one point only
    std::vector<Row> rows_;       ///< all else
    std::vector<Sliding> sliding_;
    std::vector<int> uses_;  ///< per candidate
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
    mutable Eigen::VectorXd b_, y_;
};

}  // namespace innerspring
