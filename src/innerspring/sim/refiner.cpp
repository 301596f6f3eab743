#include "innerspring/sim/refiner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

bool acts(const Force& force, double time, double dt) {
    return force.radius > 0 && !force.newton.isZero(0) &&
           (at(force.profile, time) != 0 || at(force.profile, time + dt) != 0);
}

double longest_side(const Vector& a, const Vector& b, const Vector& c) {
    return std::sqrt(std::max({(a - b).squaredNorm(), (b - c).squaredNorm(), (c - a).squaredNorm()}));
}

double nearest_corner(const Vector& place, const Vector& a, const Vector& b, const Vector& c) {
    return std::sqrt(
        std::min({(a - place).squaredNorm(), (b - place).squaredNorm(), (c - place).squaredNorm()}));
}

}  // namespace

Refiner::Refiner(const Body& body, std::vector<RefineRule> rules)
    : rules_(std::move(rules)), done_(rules_.size(), false) {
    if (!rules_.empty()) history_.emplace(body.rest);
    for (const RefineRule& r : rules_) {
        if (r.levels < 1 || r.levels > most_levels)
            throw InputError(
                fmt::format("refine: levels is {}; it must be from 1 to {}", r.levels, most_levels));
        if (!r.at && !(r.edge_share > 0)) throw InputError("refine: edge_share must be positive");
        if (!r.place.allFinite() || !(r.radius >= 0 && std::isfinite(r.radius)))
            throw InputError("refine: its place and radius must be finite, the radius not negative");
    }
}

void Refiner::before_step(double time, double dt, Body& body, Loads& loads, State& state,
                          const std::function<void(const Transfer&)>& adapted) {
    if (rules_.empty()) return;
    auto apply = [&](const Transfer& transfer) {
        if (transfer.surface.removed.empty()) return;
        carry_over(loads, body, transfer);
        adapted(transfer);
        ++changes_;
    };
    for (std::size_t n = 0; n < rules_.size(); ++n) {
        const RefineRule& r = rules_[n];
        if (!r.at || done_[n] || time < *r.at - 1e-9 * dt) continue;
        done_[n] = true;
        apply(refine(body, *history_, state, triangles_near(body.rest, r.place, r.radius), r.levels));
    }
    // Edges at rest do not change by themselves: there is something to do only where a force begins or ends.
    std::vector<bool> acting(loads.forces.size());
    for (std::size_t f = 0; f < acting.size(); ++f) acting[f] = acts(loads.forces[f], time, dt);
    if (acting == acting_) return;
    acting_ = acting;
    const bool follows = std::ranges::any_of(rules_, [](const RefineRule& r) { return !r.at; });
    if (!follows) return;
    for (const RefineRule& r : rules_) {
        if (r.at) continue;
        for (int level = 0; level < r.levels; ++level)
            for (std::size_t f = 0; f < acting.size(); ++f) {
                const Force& force = loads.forces[f];
                if (acting[f])
                    apply(refine(
                        body, *history_, state,
                        coarse_triangles(body, force.centre, force.radius, r.edge_share * force.radius)));
            }
    }
    apply(coarsen(body, *history_, state, [&](const Vector& a, const Vector& b, const Vector& c) {
        for (std::size_t n = 0; n < rules_.size(); ++n) {
            const RefineRule& r = rules_[n];
            if (r.at && done_[n] && nearest_corner(r.place, a, b, c) <= r.radius + longest_side(a, b, c))
                return true;
            if (r.at) continue;
            for (std::size_t f = 0; f < acting.size(); ++f)
                if (acting[f] && longest_side(a, b, c) > r.edge_share * loads.forces[f].radius &&
                    nearest_corner(body.rest.positions[loads.forces[f].centre], a, b, c) <
                        loads.forces[f].radius + longest_side(a, b, c))
                    return true;
        }
        return false;
    }));
}

}  // namespace innerspring
