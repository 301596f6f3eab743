#pragma once
#include "innerspring/sim/refine.h"

namespace innerspring {

/// When and where a running simulation refines: one of `at`, `edge_share` and `tool_share`.
struct RefineRule {
    /// Once, at the first step from this time [s] on, within `radius` of `place`.
    std::optional<double> at;
    Vector place = Vector::Zero();  ///< [m], at rest
    double radius = 0;              ///< [m]
    /// Around each patch force while it acts, where an edge is longer than this share of its radius [1]; and
    /// back when it no longer acts.
    double edge_share = 0;
    int levels = 1;  ///< with a time: so many; else at most so many
    /// Under and around each tool, where an edge is longer than this share of its radius [1] (of a mesh: of
    /// the ball about its origin that holds it; planes have none); and back when the tool has gone.
    double tool_share = 0;
};

/// Where a tool was in a step, seen from the surface at rest: moved back by as much as the surface near it is
/// displaced. What rules for tools do follows from these and the loads alone.
struct ToolView {
    double time = -std::numeric_limits<double>::infinity();  ///< [s]
    Index tool = no_index;
    Pose from, to;                 ///< at the start and the end of the step
    Vector back = Vector::Zero();  ///< by so much it was moved [m]
};

/// Follows the rules through a run. What it does depends on the body, the loads, the time and, with tools, on
/// views(): to go on from a saved state, replay() those and run it over the times before.
class Refiner {
  public:
    /// Throws InputError for rules that cannot be.
    Refiner(const Body& body, std::vector<RefineRule> rules);

    /// What is due before the step from `time` to time + dt. `adapted` is called after each change, with
    /// loads carried over. Throws InputError as refine() does. Next to nothing while forces and tools stay
    /// where they are; a look at every vertex and triangle where a tool has moved by a part of its radius.
    void before_step(double time, double dt, Body& body, Loads& loads, State& state,
                     const std::function<void(const Transfer&)>& adapted);

    int changes() const { return changes_; }  ///< refinements and undoings so far

    const std::vector<ToolView>& views() const { return views_; }  ///< all that were taken, in time
    /// In steps before `until` [s] these are taken as they come due instead of looking.
    void replay(std::vector<ToolView> views, double until) {
        replayed_ = std::move(views), replayed_until_ = until;
    }

  private:
    bool look(double time, double dt, const Body& body, const Loads& loads, const State& state);
    bool near(const Loads& loads, const Vector& a, const Vector& b, const Vector& c, double share,
              double margins) const;

    std::vector<RefineRule> rules_;
    std::vector<bool> done_;              ///< per rule with a time
    std::vector<bool> acting_;            ///< per force
    std::optional<Subdivision> history_;  ///< none without rules
    std::vector<ToolView> last_;          ///< per tool
    std::vector<ToolView> views_, replayed_;
    double replayed_until_ = -std::numeric_limits<double>::infinity();  ///< [s]
    int changes_ = 0;
};

}  // namespace innerspring
