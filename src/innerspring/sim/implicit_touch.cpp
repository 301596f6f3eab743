#include <algorithm>
#include <cmath>

#include "innerspring/sim/implicit.h"

// Implicit steps with tools.
namespace innerspring {

namespace {

constexpr int most_rounds = 15;

/// Rounds after which sticking and sliding are taken to go to and fro.
constexpr int cycles_from = 5;

/// Of the way to a minimum, before none of it is gone.
constexpr double least_share = 0.2;

}  // namespace

/// From at_ with the gradient there, without tools, to the minimum with them: at_ and the points' impulses.
bool ImplicitSolver::touch(Contact& contact, const Loads& loads, double goal, double rounding,
                           double tolerance, StepReport& report,
                           const std::function<bool(double)>& minimise) {
    auto& candidates = contact.candidates();
    const auto press = [&] {
        // Each touched vertex by itself, against no less than its neighbours resist with.
        for (Candidate& c : candidates) {
            double D = d_[c.vertex] + (stiffest_ - 1) * body_.K[c.vertex];
            for (const Spoke& spoke : body_.spokes_of(c.vertex)) D += 2 * spoke.k;
            c.inverse_mass = c.inverse_mass > 0 ? 1 / (h_ * h_ * D) : 0;
            c.x = start_[c.vertex];
            c.v = (at_.x[c.vertex] - c.x) / h_ - h_ * c.inverse_mass * at_.g[c.vertex];
        }
        const bool more = contact.approach(loads, h_);
        contact.press(loads);
        return more;
    };
    for (int round = 0; round < most_rounds; ++round) {
        // The minimum of the round before may lie behind points that were not held. If putting it back leaves
        // more energy than that round began with, less of the way is gone.
        const bool first = round == 0;
        double share = 1;
        if (!first) end_ = at_.x;
        while (true) {
            const bool more = press();
            double change2 = 0;
            still_ = is_pinned_;
            for (const Candidate& c : candidates) {
                if (!c.changed || c.inverse_mass == 0) continue;
                const Vector x = c.x + h_ * c.v;
                change2 += ((x - at_.x[c.vertex]) / (h_ * h_ * c.inverse_mass)).squaredNorm();
                at_.x[c.vertex] = x;
                still_[c.vertex] = true;
            }
            if (!first && share == 1) {
                // What the tools press with is among the forces of the step; friction that waits is a change.
                double force2 = 0, waits2 = 0;
                for (const Contact::Point& p : contact.points()) {
                    force2 += (p.jn * p.jn + p.jt.squaredNorm()) / (h_ * h_);
                    if (!p.known) waits2 += std::pow(loads.tools[p.tool].friction * p.jn / h_, 2);
                }
                goal = std::max(goal, tolerance * std::sqrt(force2));
                if (!more && std::sqrt(change2 + waits2) <= goal) return true;
            }
            hold_.take(contact, candidates, h_);
            if (first && contact.points().empty() && !body_.free && pinned_.empty()) settle_translation();
            if (change2 > 0 || !hold_.empty()) evaluate(at_), ++report.iterations;
            // By the same energies as there; with more points to keep to it may well be more. Sticking and
            // sliding may go to and fro with no energy to tell: halfway between.
            const double noise = 1e-12 * std::abs(from_.value) + volume_.noise(),
                         now = at_.value + hold_.kept_less_now(at_.x);
            const bool cycles = round >= cycles_from && share == 1;
            if (first || more || share == 0 || !(now > from_.value + noise || cycles)) break;
            share = share > least_share ? share / 2 : 0;
            for (std::size_t i = 0; i < end_.size(); ++i)
                at_.x[i] = from_.x[i] + share * (end_[i] - from_.x[i]);
            hold_.release();
            evaluate(at_), ++report.iterations;
        }
        hold_.keep();
        from_.x = at_.x, from_.value = at_.value;
        // At least one step, so that what is left does not stay for ever.
        const bool done = minimise(
            first ? std::clamp(at_.residual / 2, rounding, std::max(goal, tolerance * at_.residual)) : goal);
        report.residual = at_.residual;
        if (!hold_.empty()) {
            hold_.release();
            evaluate(at_), ++report.iterations;
        }
        if (!done) return false;
    }
    return false;
}

}  // namespace innerspring
