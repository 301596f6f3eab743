#pragma once
#include <Eigen/SparseCholesky>

#include "innerspring/sim/contact.h"

namespace innerspring {

/// What is kept of a contact while a body's energy is lowered: the points that tools press on move only along
/// the tool, and those that stick not at all. On those that slide friction pulls with
///     f = P(f_0 - D s),   P onto |f| <= mu f_n,
/// s how far they slip along the tool, f_0 and f_n as they were found, D a few times the stiffness of the net
/// there (an augmented Lagrangian, Alart & Curnier 1991: what D is does not change where it ends).
///
/// A point of a face stays the same point of it while the face turns. By an angle b it would get a(1 - cos b)
/// into a ball of radius a: the curvature of the constraint, which the force f_n makes an energy
///     f_n a |t|^2 / 2,   t = sum_k grad w_k (n . x_k),
/// t the slope of the face against the plane that touches the ball, w_k the barycentric coordinates. Without
/// it a long step turns the face too far, and the next one back. At rest t is 0.
class ContactHold {
  public:
    using Field = std::vector<Vector>;

    /// The points of the contact with an impulse, over h [s].
    void take(const Contact& contact, std::span<const Candidate> candidates, double h);
    void reserve(std::size_t vertices);  ///< so that nothing is allocated but for points within triangles
    /// All but the energy of slopes.
    void release() { single_.clear(), rows_.clear(), now_.sliding.clear(); }
    void clear() { release(), now_.slopes.clear(); }
    bool empty() const { return single_.empty() && rows_.empty() && now_.slopes.empty(); }

    /// Adds the gradient [N] of friction and slopes and returns their energy [J].
    double add_gradient(const Field& x, Field& g) const { return now_.add_gradient(x, &g); }
    /// Of the energies as they are: what the ones that were kept last would be less these [J].
    void keep() { kept_ = now_; }
    double kept_less_now(const Field& x) const {
        return kept_.add_gradient(x, nullptr) - now_.add_gradient(x, nullptr);
    }

    void linearise(const Field& x);
    /// q += the Hessian of both times p; returns p . that.
    double multiply(const Field& p, Field& q) const;

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
    struct Slope {
        std::array<Index, 3> vertices;
        std::array<Vector, 3> gradients;  ///< of w_k [1/m]
        Vector normal;
        double stiffness;  ///< f_n a [N m]
        Vector at(const Field& x) const;
    };
    struct Energies {
        std::vector<Sliding> sliding;
        std::vector<Slope> slopes;
        double add_gradient(const Field& x, Field* g) const;
    };
    static Vector pull_at(const Sliding& s, const Field& x);
    void take_slope(const Contact::Point& p, std::span<const Candidate> candidates, double h);
    void factorize();
    void project_rows(Field& v) const;

    std::vector<Single> single_;  ///< vertices touched in one point only
    std::vector<Row> rows_;       ///< all else
    Energies now_, kept_;
    std::vector<int> uses_;  ///< per candidate
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
    mutable Eigen::VectorXd b_, y_;
};

}  // namespace innerspring
