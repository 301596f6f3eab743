#pragma once
#include <limits>
#include <vector>

#include "innerspring/mesh/geometry.h"

namespace innerspring {

/// A function of the positions of all vertices with what Newton's method asks of it. All fields have one
/// vector per vertex, zero where it is pinned.
class Minimand {
  public:
    using Field = std::vector<Vector>;
    virtual ~Minimand() = default;
    virtual double evaluate(const Field& x, Field& g) = 0;      ///< value [J] and gradient [N]
    virtual double noise() const { return 0; }                  ///< of the value, beyond 1e-12 of it [J]
    virtual double residual(const Field& g) const = 0;          ///< a norm of the gradient [N]
    virtual void linearise(const Field& x) = 0;                 ///< the Hessian H and the preconditioner M^-1
    virtual double multiply(const Field& p, Field& q) = 0;      ///< q = H p; returns p . q
    virtual double precondition(const Field& r, Field& z) = 0;  ///< z = M^-1 r; returns r . z

    /// Called with a step on trial where the Hessian or the region says that it is too simple: may bring x to
    /// a lower value by simpler means.
    virtual void settle(Field& x) = 0;
};

/// to += factor from.
void add(double factor, const Minimand::Field& from, Minimand::Field& to);
double dot(const Minimand::Field& a, const Minimand::Field& b);

/// Newton's method in a trust region |p|_M <= radius, its steps by conjugate gradients that stop at the rim
/// (Steihaug 1983), shortened where that lowers the value (Nocedal & Yuan 1998). The value never rises. A
/// step that was cut short is settled before it is judged. Fields are kept between runs, so that they are
/// allocated once.
class Newton {
  public:
    using Field = Minimand::Field;
    struct Goal {
        double residual;  ///< [N]
        double scale;     ///< [N]; what makes a residual small
        int most_iterations = 500;
        int most_products = 1 << 30;  ///< in all
        double model = 0.1;   ///< how exactly the steps' linear systems are solved, unless less will do:
        double enough = 0.3;  ///< so much of `residual`
    };
    struct Report {
        bool reached = false;
        bool stepped = false;  ///< the last iteration found a step
        double value = 0, residual = 0;
        int iterations = 0, products = 0, evaluations = 0;
    };
    /// From x with its value and gradient g, to the last point and its gradient.
    Report run(Minimand& f, Field& x, Field& g, double value, const Goal& goal);

  private:
    void model(Minimand& f, const Field& g, double relative, double enough, int most);

    double radius_ = std::numeric_limits<double>::infinity();
    Field p_, r_, z_, d_, q_;  ///< step, g + H p, M^-1 r, direction, H d
    bool cut_short_ = false;   ///< by the rim or by a direction that goes downhill for ever
    int products_ = 0;
    double gain_ = 0, length_ = 0;  ///< -(g p + p H p / 2) [J], |p|_M
    Field trial_, g_trial_;
};

}  // namespace innerspring
