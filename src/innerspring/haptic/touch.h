#pragma once
#include "innerspring/haptic/coupling.h"
#include "innerspring/sim/refine.h"
#include "innerspring/sim/state.h"
#include "innerspring/sim/step.h"

namespace innerspring {

/// What the body is at a tool, after a step: in the scene's frame and units.
struct Touch {
    bool touching = false;
    Vector point = Vector::Zero();    ///< mean of where it presses, by force [m]
    Vector normal = Vector::UnitZ();  ///< along which it pushes the tool
    double force = 0;  ///< along the normal, of the springs as they stand, without damping and inertia [N]
    double stiffness = 0;  ///< tangent: how that grows as the tool goes in [N/m]
    double damping = 0;    ///< how the body resists the motion of the tool [N s/m]
};

/// The tangent stiffness from the body's own springs (ours): motions u_i along the normal n of the vertices
/// in contact and `rings` of neighbours around them; farther ones stay. Their springs are
///     A u = (n . K_i n + sum_j h_ij) u_i - sum_j h_ij u_j,   h = k_e ((n.d)^2 + max(0, 1 - l/|d|) (1 -
///     (n.d)^2)),
/// d the direction and l the rest length of a surface spring. Vertices on the tool move with it, by
/// c_i = |n_i . n|; corners of faces that are pressed between their vertices carry shares phi_i of the force
/// (sum 1), and it is sum_i phi_i u_i that moves with the tool. With u' the answer to c alone (energy k',
/// mean m' = sum phi u') and u" the answer to phi with the tool still (m" = sum phi u"),
///     k = k' + (1 - m')^2 / m",   u = u' + u" (1 - m') / m",   b = sum_i c_i u_i^2.
/// The force is that of the springs (and gravity) of the vertices in contact; at rest it is the contact's.
/// That of a step also holds what damping and inertia take when the tool jumps once a step, which the hand is
/// not to feel as a spring. A free body, whose homes move, answers with the force of the step.
class TouchFinder {
  public:
    /// What is remembered from one step to the next [1]. A vertex that bounces on the tool is in contact in
    /// one step and not in the next, and its spring pushes all the time: those that were in contact a moment
    /// ago count, by a mean that forgets.
    double keep = 0;
    static constexpr int rings = 5, sweeps = 40;
    static constexpr std::size_t most = 500;  ///< neighbours
    Touch find(const Body& body, const State& state, const ContactReport& report, const Tool& tool,
               std::size_t index, const Vector& gravity = Vector::Zero());
    /// Keeps what is remembered of the vertices that are still there.
    void adapt(const Transfer& transfer);

  private:
    void gather(const Body& body, const State& state, const Vector& n);
    void relax();

    struct Pressed {
        Index vertex;
        double normal;  ///< mean [N]
    };
    std::vector<Pressed> pressed_;
    std::vector<double> new_normal_;  ///< per vertex of the body, zero between calls
    Vector force_ = Vector::Zero();   ///< mean of the direction's source [N]
    std::vector<Index> patch_;        ///< vertices in contact, then ring by ring
    std::vector<Index> place_;        ///< per vertex of the body: in the patch, or no_index
    std::vector<double> share_;       ///< phi, per patch vertex; 0: carries nothing itself
    std::vector<bool> moved_;         ///< per patch vertex: on the tool
    std::vector<double> u_, first_u_, load_, diagonal_;  ///< per patch vertex
    std::vector<std::pair<Index, double>> entries_;      ///< (place, h) of neighbours in the patch
    std::vector<Index> first_;                           ///< of a vertex's entries
};

}  // namespace innerspring
