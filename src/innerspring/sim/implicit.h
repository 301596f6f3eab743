#pragma once
#include <functional>
#include <optional>

#include "innerspring/sim/contact_hold.h"
#include "innerspring/sim/frame_motion.h"
#include "innerspring/sim/kernel.h"
#include "innerspring/sim/net.h"
#include "innerspring/sim/newton.h"
#include "innerspring/sim/preconditioner.h"
#include "innerspring/sim/step.h"
#include "innerspring/sim/volume.h"

namespace innerspring {

/// Implicit Euler as a minimisation (ours): x' is the minimum of
///     Phi(x) = sum_i m_i |x_i - y_i|^2 / (2 h^2) + h c_i |v_i - v_home,i|^2 / 2 + U(x),
///     y_i = x_i^n + h v_i^n + h^2 (g + f_i / m_i),  v_i = (x_i - x_i^n) / h,  U the inner and surface
///     energies.
/// v_home is zero for a held body, else the rigid motion nearest to v, so that damping changes no momentum.
/// Being the nearest, it moves with x without changing the gradient. All but the net is one spring per vertex
/// of stiffness d = m/h^2 + c/h + K. The constant matrix A = diag(d) + L, L the Laplacian of the k_e, is
/// factorised once; split into tangent plane and normal (see Preconditioner) it is the first matrix of
/// L-BFGS (as Liu, Bouaziz & Kavan 2017 do with A for projective dynamics), from where each vertex flies on.
/// Where that stalls, Newton's method goes on from there, or from standing still if Phi is lower there: the
/// step never ends with more than standing still has, and is stable at any h and stiffness. With the volume
/// term (VolumePart) A gets its rank-one part by Sherman and Morrison's formula; a hard constraint starts
/// from the multiplier that keeps V to first order, and what is left of V - V_0 is taken out along A^-1 a.
///
/// Tools add n . x >= b at the points that meet them, and Coulomb friction (ours, in the manner of Moré &
/// Toraldo 1991): rounds of a projected step of every touched vertex by itself, with its neighbours held,
/// which says what presses, sticks and slides and with which forces; then the minimum over the motions these
/// leave; until a round changes nothing beyond the tolerance. No round ends above the one before: of a
/// minimum that lies behind other points only so much of the way is gone that, put back before them, less is
/// left.
class ImplicitSolver : private Minimand {
  public:
    ImplicitSolver(const Body& body, double h);
    /// `contact`: with its candidates for this step, where there are tools.
    StepReport step(const Loads& loads, const StepOptions& options, State& state, Team& team,
                    Contact* contact = nullptr);

    /// Goes on with the body after a refinement or its undoing.
    void adapt(const SurfaceChange& surface, const BodyChange& change);

  private:
    struct Pair {
        Field s, y;      ///< change of position and of gradient
        double inverse;  ///< 1 / (s . y)
    };
    struct Point {
        Field x, g;
        double value = 0, residual = 0;  ///< Phi [J], |g| [N]
    };
    void resize();
    void set_stiffness();
    void factorize(const Loads& loads);
    bool touch(Contact& contact, const Loads& loads, double goal, double rounding, double tolerance,
               StepReport& report, const std::function<bool(double residual)>& minimise);
    bool descend(double goal, double rounding, int most, StepReport& report);
    double direction(const Field& gradient);
    void evaluate(Point& at);
    void correct_rigidly();
    void respond(const Field& x);
    void begin_pressure();
    double restore_volume(const std::vector<bool>& fixed);
    void settle_translation();

    double evaluate(const Field& x, Field& g) override;
    double noise() const override { return volume_.noise(); }
    double residual(const Field& g) const override;
    void linearise(const Field& x) override;
    double multiply(const Field& p, Field& q) override;
    double precondition(const Field& r, Field& z) override;
    void settle(Field& x) override;

    const Body& body_;
    double h_;
    std::vector<Index> pinned_, pinned_now_;  ///< sorted; the factor is for the first
    bool factorized_ = false;
    std::vector<bool> is_pinned_;
    std::vector<double> d_;  ///< m/h^2 + c/h + K [N/m]
    double stiffest_ = 1;    ///< stiffest_share()
    Net net_;
    Preconditioner inverse_;
    VolumePart volume_;
    bool response_known_ = false;          ///< volume_ holds that of a held body at rest
    Field target_, start_, external_, z_;  ///< y, x^n, loads [N] and the places of the step at hand
    Field velocity_, direction_, q_;
    ContactHold hold_;
    std::vector<bool> still_;  ///< pinned or touched
    Newton newton_;
    std::optional<FrameMotion> motion_;  ///< of a free body
    HomeFrame frame_;                    ///< at the place of linearise()
    Team* team_ = nullptr;
    double gradient2_ = 0;  ///< of the last evaluate() [N^2]
    Point at_, trial_;
    Point from_;  ///< where a round of touch() began; its x and value
    Field end_;   ///< and where it ended
    static constexpr std::size_t remembered_pairs = 6;
    std::vector<Pair> pairs_;
    std::size_t kept_ = 0, next_ = 0;  ///< pairs in use, and where the next goes
};

}  // namespace innerspring
