#include "innerspring/sim/refiner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/error.h"
#include "innerspring/sim/forces.h"

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

/// How far ahead of a tool the surface is made ready, as a share of its radius: a vertex that comes while
/// nothing touches it takes no force from its neighbours. It stays until the tool is twice as far.
constexpr double ahead = 0.5;

/// [m]; 0: a plane.
double radius_of(const Tool& tool) {
    return tool.shape == ToolShape::plane  ? 0
           : tool.shape == ToolShape::mesh ? tool.mesh->radius
                                           : tool.radius;
}

/// Of the ball about its origin that holds a tool [m].
double bound_of(const Tool& tool) {
    return radius_of(tool) + tool.length / 2;
}

/// Signed distance of a point to a tool [m]; infinite beyond `within` [m].
double distance(const Tool& tool, const Pose& pose, const Vector& x, double within) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const Vector away = x - pose.position;
    const double most = bound_of(tool) + within;
    if (away.squaredNorm() > most * most) return infinity;
    const Vector local = pose.rotation.conjugate() * away;
    const bool inside =
        tool.shape == ToolShape::mesh && overlap(tool.mesh->tree.nodes[0].box, {local, local});
    return nearest(tool, local, inside ? infinity : within).distance;
}

/// How far any point of a tool is between two poses at most [m].
double apart(const Tool& tool, const Pose& a, const Pose& b) {
    return (a.position - b.position).norm() + a.rotation.angularDistance(b.rotation) * bound_of(tool);
}

}  // namespace

Refiner::Refiner(const Body& body, std::vector<RefineRule> rules)
    : rules_(std::move(rules)), done_(rules_.size(), false) {
    if (!rules_.empty()) history_.emplace(body.rest);
    for (const RefineRule& r : rules_) {
        if (r.levels < 1 || r.levels > most_levels)
            throw InputError(
                fmt::format("refine: levels is {}; it must be from 1 to {}", r.levels, most_levels));
        if (!r.at && !(r.edge_share > 0 || r.tool_share > 0))
            throw InputError("refine: edge_share or tool_share must be positive");
        if (!r.place.allFinite() || !(r.radius >= 0 && std::isfinite(r.radius)))
            throw InputError("refine: its place and radius must be finite, the radius not negative");
    }
}

/// Where each tool is now, as seen from the surface at rest; false if none has moved much since the last
/// look.
bool Refiner::look(double time, double dt, const Body& body, const Loads& loads, const State& state) {
    const std::size_t count = loads.tools.size();
    if (last_.size() != count) last_.assign(count, {});
    if (time < replayed_until_ - dt / 2) {
        bool any = false;
        for (const ToolView& view : replayed_)
            if (std::abs(view.time - time) < dt / 2) {
                last_.at(view.tool) = view;
                views_.push_back(view);
                any = true;
            }
        return any;
    }
    HomeFrame frame;
    if (body.free) {
        Team alone(1);
        frame = home_frame(body, state.x, alone);
    }
    const Eigen::Quaterniond back(frame.R.transpose());
    const auto at_rest = [&](const Pose& p) {
        return Pose{back * (p.position - frame.t), back * p.rotation};
    };
    bool any = false;
    for (Index k = 0; k < count; ++k) {
        const Tool& tool = loads.tools[k];
        const double margin = ahead * radius_of(tool);
        if (margin == 0) continue;
        const Pose now = pose_at(tool, time);
        ToolView view{time, k, at_rest(now), at_rest(pose_at(tool, time + dt))};
        const ToolView& last = last_[k];
        if (last.tool != no_index &&
            apart(tool, view.to, {last.to.position - last.back, last.to.rotation}) <= margin / 4)
            continue;
        any = true;
        const double within = 2 * margin + apart(tool, view.from, view.to);
        double sum = 0;
        Vector moved = Vector::Zero();
        for (std::size_t i = 0; i < body.vertices(); ++i) {
            const double d = std::max(0.0, distance(tool, now, state.x[i], within));
            if (!(d < within)) continue;
            const double weight = (1 - d / within) * (1 - d / within);
            sum += weight;
            moved += weight * (back * (state.x[i] - frame.t) - body.rest.positions[i]);
        }
        if (sum > 0) {
            view.back = -moved / sum;
            view.from.position += view.back;
            view.to.position += view.back;
        }
        last_[k] = view;
        views_.push_back(view);
    }
    return any;
}

/// Whether a triangle at rest that is too coarse for it is within so many margins of a tool's way.
bool Refiner::near(const Loads& loads, const Vector& a, const Vector& b, const Vector& c, double share,
                   double margins) const {
    const Vector middle = (a + b + c) / 3;
    const double size = std::sqrt(
        std::max({(a - middle).squaredNorm(), (b - middle).squaredNorm(), (c - middle).squaredNorm()}));
    for (const ToolView& view : last_) {
        if (view.tool == no_index) continue;
        const Tool& tool = loads.tools[view.tool];
        const double radius = radius_of(tool);
        // No point of the way is farther from one of its ends than half of it.
        const double within = margins * ahead * radius + size + apart(tool, view.from, view.to) / 2;
        if (std::min(distance(tool, view.from, middle, within), distance(tool, view.to, middle, within)) <=
                within &&
            longest_side(a, b, c) > share * radius)
            return true;
    }
    return false;
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
    // Edges at rest do not change by themselves: there is something to do only where a force begins or ends
    // or a tool has moved.
    const auto any_rule = [this](auto&& has) { return std::ranges::any_of(rules_, has); };
    bool changed = false;
    std::vector<bool> acting(loads.forces.size());
    for (std::size_t f = 0; f < acting.size(); ++f) acting[f] = acts(loads.forces[f], time, dt);
    if (acting != acting_) {
        acting_ = acting;
        changed = any_rule([](const RefineRule& r) { return r.edge_share > 0; });
        for (const RefineRule& r : rules_)
            for (int level = 0; r.edge_share > 0 && level < r.levels; ++level)
                for (std::size_t f = 0; f < acting.size(); ++f) {
                    const Force& force = loads.forces[f];
                    if (acting[f])
                        apply(refine(
                            body, *history_, state,
                            coarse_triangles(body, force.centre, force.radius, r.edge_share * force.radius)));
                }
    }
    if (any_rule([](const RefineRule& r) { return r.tool_share > 0; }) &&
        look(time, dt, body, loads, state)) {
        changed = true;
        for (const RefineRule& r : rules_) {
            if (!(r.tool_share > 0)) continue;
            const auto& x = body.rest.positions;
            std::vector<Index> coarse;
            const auto add = [&](Index t) {
                const Triangle& c = body.rest.triangles[t];
                if (near(loads, x[c[0]], x[c[1]], x[c[2]], r.tool_share, 1) && history_->depth(t) < r.levels)
                    coarse.push_back(t);
            };
            for (Index t = 0; t < body.rest.triangles.size(); ++t) add(t);
            while (!coarse.empty()) {
                const Transfer transfer = refine(body, *history_, state, coarse);
                apply(transfer);
                coarse.clear();
                for (const auto& [t, corners] : transfer.surface.added) add(t);
                make_set(coarse);
            }
        }
    }
    if (!changed) return;
    apply(coarsen(body, *history_, state, [&](const Vector& a, const Vector& b, const Vector& c) {
        for (std::size_t n = 0; n < rules_.size(); ++n) {
            const RefineRule& r = rules_[n];
            if (r.at && done_[n] && nearest_corner(r.place, a, b, c) <= r.radius + longest_side(a, b, c))
                return true;
            if (r.tool_share > 0 && near(loads, a, b, c, r.tool_share, 2)) return true;
            if (!(r.edge_share > 0)) continue;
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
