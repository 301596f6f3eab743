#pragma once
#include "innerspring/sim/refine.h"

namespace innerspring {

/// When and where a running simulation refines.
struct RefineRule {
    /// Once, at the first step from this time [s] on, within `radius` of `place`; or, without a time, around
    /// each patch force while it acts, where an edge is longer than `edge_share` of its radius, and back when
    /// it no longer acts.
    std::optional<double> at;
    Vector place = Vector::Zero();  ///< [m], at rest
    double radius = 0;              ///< [m]
    double edge_share = 0;          ///< [1]
    int levels = 1;                 ///< with a time: so many; without: at most so many
};

/// Follows the rules through a run. What it does depends on the body, the loads and the time only, never on
/// the motion: to go on from a saved state, run it over the times before.
class Refiner {
  public:
    /// Throws InputError for rules that cannot be.
    Refiner(const Body& body, std::vector<RefineRule> rules);

    /// What is due before the step from `time` to time + dt. `adapted` is called after each change, with
    /// loads carried over. Throws InputError as refine() does.
    void before_step(double time, double dt, Body& body, Loads& loads, State& state,
                     const std::function<void(const Transfer&)>& adapted);

    int changes() const { return changes_; }  ///< refinements and undoings so far

  private:
    std::vector<RefineRule> rules_;
    std::vector<bool> done_;              ///< per rule with a time
    std::vector<bool> acting_;            ///< per force
    std::optional<Subdivision> history_;  ///< none without rules
    int changes_ = 0;
};

}  // namespace innerspring
