#include "innerspring/sim/implicit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace innerspring {

namespace {

constexpr std::size_t remembered_pairs = 6;

/// How much of the springs' own stiffness along the normal counts (see Preconditioner).
constexpr double normal_share = 4;

/// Evaluations after which Newton's method takes over.
constexpr int most_quick = 40;

/// Of touch().
constexpr int most_rounds = 15;

/// Rounds after which sticking and sliding are taken to go to and fro.
constexpr int cycles_from = 5;

/// Of the way to a minimum, before none of it is gone.
constexpr double least_share = 0.2;

double dot(const std::vector<Vector>& a, const std::vector<Vector>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
    return sum;
}

}  // namespace

ImplicitSolver::ImplicitSolver(const Body& body, double h)
    : body_(body), h_(h), net_(body), inverse_(body), volume_(body), pairs_(remembered_pairs) {
    resize();
    set_stiffness();
}

void ImplicitSolver::resize() {
    const std::size_t n = body_.vertices();
    for (Field* field : {&target_, &start_, &z_, &velocity_, &direction_, &q_, &at_.x, &at_.g, &trial_.x,
                         &trial_.g, &from_.x, &end_})
        field->resize(n);
    external_.assign(n, Vector::Zero());
    still_.reserve(n), hold_.reserve(n);
    for (Pair& pair : pairs_) pair.s.resize(n), pair.y.resize(n);
}

void ImplicitSolver::set_stiffness() {
    stiffest_ = stiffest_share(body_.material);
    d_.resize(body_.vertices());
    for (std::size_t i = 0; i < d_.size(); ++i) d_[i] = body_.m[i] / (h_ * h_) + body_.c[i] / h_ + body_.K[i];
}

void ImplicitSolver::factorize(const Loads& loads) {
    pinned_now_.clear();
    for (const Pin& pin : loads.pins)
        pinned_now_.insert(pinned_now_.end(), pin.vertices.begin(), pin.vertices.end());
    std::sort(pinned_now_.begin(), pinned_now_.end());
    if (factorized_ && pinned_now_ == pinned_) return;
    pinned_ = pinned_now_;
    is_pinned_.assign(body_.vertices(), false);
    for (Index i : pinned_) is_pinned_[i] = true;
    inverse_.factorize(body_, d_, is_pinned_);
    inverse_.set_normal_stiffness(body_, d_, body_.rest.positions, normal_share);
    factorized_ = true;
    response_known_ = false;
}

void ImplicitSolver::adapt(const SurfaceChange& surface, const BodyChange& change) {
    resize();
    set_stiffness();
    net_.adapt();
    volume_.term.adapt(change);
    response_known_ = false;
    // Pins may have come and gone with the vertices: then all is factorised anew in the next step.
    if (!factorized_ || !pinned_.empty()) {
        inverse_.adapt_order(body_, surface, change);
        factorized_ = false;
        return;
    }
    is_pinned_.assign(body_.vertices(), false);
    inverse_.adapt(body_, d_, is_pinned_, surface, change);
    inverse_.set_normal_stiffness(body_, d_, body_.rest.positions, normal_share);
}

double ImplicitSolver::evaluate(const Field& x, Field& g) {
    Team& team = *team_;
    const std::size_t n = body_.vertices();
    double constant = 0;
    const HomeFrame frame = home_frame(body_, x, team);
    if (body_.free) {
        // Three springs to one: m/h^2 to y, c/h to where v_home would take x^n, K to home.
        RigidMotion home;
        if (body_.material.damping > 0) {
            for (std::size_t i = 0; i < n; ++i) velocity_[i] = (x[i] - start_[i]) / h_;
            home = rigid_fit(body_, 0, start_.data(), velocity_.data(), team);
        }
        for (std::size_t i = 0; i < n; ++i) {
            const Vector carried =
                             start_[i] + h_ * (home.linear + home.angular.cross(start_[i] - home.centre)),
                         h = frame.R * body_.rest.positions[i] + frame.t;
            const double m = body_.m[i] / (h_ * h_), c = body_.c[i] / h_, K = body_.K[i];
            z_[i] = (m * target_[i] + c * carried + K * h) / d_[i];
            constant += is_pinned_[i]
                            ? c * (x[i] - carried).squaredNorm() + K * (x[i] - h).squaredNorm()
                            : m * (target_[i] - z_[i]).squaredNorm() + c * (carried - z_[i]).squaredNorm() +
                                  K * (h - z_[i]).squaredNorm();
        }
    }
    const Net::Value value = net_.evaluate(x, d_, z_, is_pinned_, g, team);
    gradient2_ = value.gradient2;
    double total = value.total() + constant / 2 + add_deviation(body_, frame, x, is_pinned_, g, team);
    if (volume_.term.active()) total += volume_.add_gradient(x, is_pinned_, g, team);
    if (!hold_.empty()) {
        total += hold_.add_gradient(x, g);
        hold_.project(g);
    }
    if (volume_.term.active() || !hold_.empty() || !body_.N.empty()) gradient2_ = dot(g, g);
    return total;
}

void ImplicitSolver::evaluate(Point& at) {
    at.value = evaluate(at.x, at.g);
    at.residual = std::sqrt(gradient2_);
}

double ImplicitSolver::residual(const Field& g) const {
    double sum = 0;
    for (const Vector& v : g) sum += v.squaredNorm();
    return std::sqrt(sum);
}

void ImplicitSolver::linearise(const Field& x) {
    net_.linearise(x, *team_);
    hold_.linearise(x);
    frame_ = home_frame(body_, x, *team_);
    if (body_.free) motion_.emplace(body_, frame_, x);
    inverse_.set_normal_stiffness(body_, d_, x, 1);
    if (volume_.term.active()) respond(x);
}

double ImplicitSolver::multiply(const Field& p, Field& q) {
    double pq = net_.multiply(d_, p, is_pinned_, q, *team_);
    pq += multiply_deviation(body_, frame_, p, is_pinned_, q, *team_);
    if (motion_) pq += motion_->add_to(p, is_pinned_, q);
    if (volume_.term.active()) pq += volume_.add_product(p, is_pinned_, q, *team_);
    pq += hold_.multiply(p, q);
    hold_.project(q);
    return pq;
}

double ImplicitSolver::precondition(const Field& r, Field& z) {
    const double rz = inverse_.apply(r, z, *team_);
    const double all = volume_.term.active() ? rz + volume_.correct(r, z) : rz;
    hold_.project(z);
    return all;
}

void ImplicitSolver::settle(Field& x) {
    // The places of a free body move with it, and settling knows nothing of volume and directions.
    if (!body_.free && !volume_.term.active() && body_.N.empty())
        net_.settle(x, d_, z_, hold_.empty() ? is_pinned_ : still_);
}

void ImplicitSolver::respond(const Field& x) {
    volume_.linearise(x, is_pinned_, *team_,
                      [this](const Field& r, Field& z) { return inverse_.apply(r, z, *team_); });
    response_known_ = false;
}

/// The rank-one part of the first matrix, about the shape at rest, which is known from step to step, or that
/// of a free body as it lies; and the multiplier that keeps V to first order from at_ on.
void ImplicitSolver::begin_pressure() {
    volume_.lambda = volume_.stiffness = 0;
    if (body_.free || !response_known_) {
        respond(body_.free ? at_.x : body_.rest.positions);
        response_known_ = true;
    }
    if (volume_.term.hard()) {
        evaluate(at_);
        if (volume_.give > 0) volume_.lambda = (dot(volume_.response, at_.g) - volume_.excess) / volume_.give;
    }
    volume_.stiffen(100);
    evaluate(at_);
}

/// A hard constraint: brings V to V_0 by those that neither pin nor tool holds. Returns P [Pa].
double ImplicitSolver::restore_volume(const std::vector<bool>& fixed) {
    double P = volume_.lambda;
    direction_ = volume_.response;
    for (std::size_t i = 0; i < direction_.size(); ++i)
        if (fixed[i]) direction_[i].setZero();
    for (int round = 0; round < 8; ++round) {
        const double excess = volume_.term.find(at_.x, q_, *team_);
        if (round == 0) P -= volume_.stiffness * excess;
        const double give = dot(q_, direction_);
        if (!(std::abs(excess) > 1e-13 * body_.volume) || !(give > 0)) break;
        P -= excess / give;
        add(-excess / give, direction_, at_.x);
    }
    return P;
}

/// direction_ = -(L-BFGS matrix)^-1 gradient (two-loop recursion, Nocedal 1980); returns its slope.
double ImplicitSolver::direction(const Field& gradient) {
    double alpha[remembered_pairs];
    const Field* q = &gradient;
    auto pair = [&](std::size_t age) -> const Pair& {  // 0: the newest
        return pairs_[(next_ + remembered_pairs - 1 - age) % remembered_pairs];
    };
    if (kept_ > 0) q_ = gradient, q = &q_;
    for (std::size_t age = 0; age < kept_; ++age) {
        alpha[age] = pair(age).inverse * dot(pair(age).s, q_);
        add(-alpha[age], pair(age).y, q_);
    }
    precondition(*q, direction_);
    for (std::size_t age = kept_; age-- > 0;)
        add(alpha[age] - pair(age).inverse * dot(pair(age).y, direction_), pair(age).s, direction_);
    for (Vector& v : direction_) v = -v;
    return dot(direction_, gradient);
}

/// L-BFGS from at_ until the residual is at the goal; false if it does not get on.
bool ImplicitSolver::descend(double goal, double rounding, int most, StepReport& report) {
    kept_ = next_ = 0;
    const std::size_t n = body_.vertices();
    while (at_.residual > goal) {
        if (report.iterations >= most) return false;
        double slope = direction(at_.g);
        if (!(slope < 0)) return false;
        double length = 1;
        bool found = false;
        for (int cut = 0; cut < 6 && !found; ++cut) {
            for (std::size_t i = 0; i < n; ++i) trial_.x[i] = at_.x[i] + length * direction_[i];
            evaluate(trial_);
            ++report.iterations;
            // Near the minimum the value no longer resolves a gain that the gradient still shows.
            const double change = trial_.value - at_.value,
                         noise =
                             1e-13 * std::abs(at_.value) + volume_.noise() - rounding * length * slope / goal;
            found = change <= 1e-4 * length * slope ||
                    (std::abs(change) <= noise && trial_.residual < at_.residual);
            if (!found) length *= 0.4;
        }
        if (!found) return false;
        Pair& pair = pairs_[next_];
        double sy = 0, ss = 0, yy = 0;
        for (std::size_t i = 0; i < n; ++i) {
            pair.s[i] = trial_.x[i] - at_.x[i], pair.y[i] = trial_.g[i] - at_.g[i];
            sy += pair.s[i].dot(pair.y[i]), ss += pair.s[i].squaredNorm(), yy += pair.y[i].squaredNorm();
        }
        if (sy > 1e-12 * std::sqrt(ss * yy)) {
            pair.inverse = 1 / sy;
            next_ = (next_ + 1) % remembered_pairs;
            kept_ = std::min(kept_ + 1, remembered_pairs);
        }
        std::swap(at_, trial_);
    }
    return true;
}

/// Moves a held body as a whole to where its forces balance, which the preconditioner is not exact for:
/// the net's forces stay, and the gradient is known without another look at them.
void ImplicitSolver::settle_translation() {
    Vector g = Vector::Zero();
    double d = 0;
    for (std::size_t i = 0; i < d_.size(); ++i) g += at_.g[i], d += d_[i];
    Vector by = -g / d;
    if (!body_.N.empty()) by = -(d * Eigen::Matrix3d::Identity() + deviation_sum(body_)).llt().solve(g);
    double gradient2 = 0;
    for (std::size_t i = 0; i < d_.size(); ++i) {
        at_.x[i] += by;
        at_.g[i] += d_[i] * by;
        if (!body_.N.empty()) at_.g[i] += body_.N[i] * by;
        gradient2 += at_.g[i].squaredNorm();
    }
    at_.value += g.dot(by) / 2;
    at_.residual = std::sqrt(gradient2);
}

/// The springs and the damping of a free body exert neither force nor torque. What is left of the residual
/// does: a rigid motion takes out its force and its torque (to second order), which changes no spring.
void ImplicitSolver::correct_rigidly() {
    double mass = 0;
    Vector centre = Vector::Zero(), force = Vector::Zero();
    for (std::size_t i = 0; i < d_.size(); ++i) {
        mass += body_.m[i];
        centre += body_.m[i] * at_.x[i];
        force += body_.m[i] * (target_[i] - at_.x[i]);
    }
    centre /= mass;
    const Vector by = force / mass;
    Vector torque = Vector::Zero();
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < d_.size(); ++i) {
        const Vector r = at_.x[i] - centre;
        torque += body_.m[i] * r.cross(target_[i] - at_.x[i] - by);
        inertia += body_.m[i] * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
    }
    const Vector turn = inertia.ldlt().solve(torque);
    const double angle = turn.norm();
    if (!(angle < 0.1)) return;
    const Eigen::Matrix3d R =
        angle > 0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
    for (Vector& x : at_.x) x = centre + by + R * (x - centre);
}

/// From at_ with the gradient there, without tools, to the minimum with them: at_ and the points' impulses.
template <class Minimise>
bool ImplicitSolver::touch(Contact& contact, const Loads& loads, double goal, double rounding,
                           double tolerance, StepReport& report, Minimise&& minimise) {
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

StepReport ImplicitSolver::step(const Loads& loads, const StepOptions& options, State& state, Team& team,
                                Contact* contact) {
    team_ = &team;
    const bool near = contact && !contact->candidates().empty();
    if (near) contact->open(loads, state.time, h_);
    factorize(loads);
    const std::size_t n = body_.vertices();
    const double time = state.time + h_;
    add_loads(loads, time, external_);

    hold_.clear();
    start_ = state.x;
    double load2 = 0, momentum2 = 0, resting = 0, rounding2 = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const double m = body_.m[i] / (h_ * h_);
        const Vector push = h_ * h_ * (loads.gravity + external_[i] / body_.m[i]);
        const Vector flown = state.x[i] + h_ * state.v[i];
        target_[i] = flown + push;
        z_[i] =
            (m * target_[i] + body_.c[i] / h_ * state.x[i] + body_.K[i] * body_.rest.positions[i]) / d_[i];
        // A free body falls; a held one is near its balance, its springs take up the loads as they come.
        at_.x[i] = body_.free && !near ? Vector(flown + h_ * h_ * loads.gravity) : flown;
        if (is_pinned_[i]) continue;
        load2 += (m * push).squaredNorm();
        momentum2 += (body_.m[i] / h_ * state.v[i]).squaredNorm();
        rounding2 += d_[i] * d_[i] * at_.x[i].squaredNorm();
        resting += body_.free ? m * (state.x[i] - target_[i]).squaredNorm()
                              : d_[i] * (state.x[i] - z_[i]).squaredNorm();
        if (!body_.free && !body_.N.empty()) {
            const Vector u = state.x[i] - body_.rest.positions[i];
            resting += u.dot(body_.N[i] * u);
        }
    }
    // Zero again, so that nothing is left of these loads when others come.
    for (const Force& f : loads.forces)
        for (Index i : f.vertices) external_[i].setZero();
    auto move_pins = [&](Field& x) {
        for (const Pin& pin : loads.pins) {
            const Vector offset = offset_at(pin, time);
            for (Index i : pin.vertices) x[i] = body_.rest.positions[i] + offset;
        }
    };
    move_pins(at_.x);
    if (body_.free) inverse_.turn(body_, home_frame(body_, at_.x, team).R);

    StepReport report;
    if (volume_.term.active())
        begin_pressure();
    else
        evaluate(at_);
    report.iterations = 1;
    // The forces of the step: the loads, and what is out of balance if each vertex keeps its velocity, or
    // would stop it in one step if that is less.
    const double unbalanced = momentum2 > 0 ? std::min(at_.residual, std::sqrt(momentum2)) : at_.residual,
                 scale = std::max(std::sqrt(load2), unbalanced);
    if (!std::isfinite(at_.value) || !std::isfinite(scale)) {  // loads beyond the numbers
        report.converged = false;
        for (report.not_finite = 0; report.not_finite + 1 < n; ++report.not_finite)
            if (!(target_[report.not_finite].squaredNorm() < 1e200)) break;
        return report;
    }
    if (!body_.free && pinned_.empty() && !near) settle_translation();
    // Below the rounding of the terms that are summed there is nothing left to gain.
    const double rounding = 4e-15 * std::sqrt(rounding2),
                 goal = std::max(options.tolerance * scale, rounding);
    const auto newton = [&](double residual) {
        Newton::Goal to{residual, scale, options.max_iterations,
                        std::max(1, options.max_iterations - report.iterations)};
        if (options.linearised) to.most_iterations = 1, to.model = std::min(options.tolerance, to.model);
        const Newton::Report done = newton_.run(*this, at_.x, at_.g, at_.value, to);
        const bool converged = done.reached || (options.linearised && done.stepped);
        report.iterations += done.products + done.evaluations;
        at_.value = done.value, at_.residual = done.residual;
        inverse_.set_normal_stiffness(body_, d_, body_.rest.positions, normal_share);
        response_known_ = false;
        return converged;
    };
    const auto quick = [&](double residual) {
        if (options.linearised) return newton(residual);
        const int most = near ? report.iterations + most_quick : most_quick;
        return descend(residual, rounding, std::min(options.max_iterations, most), report);
    };
    const auto meet = [&] {
        return touch(*contact, loads, goal, rounding, options.tolerance, report, quick) ||
               touch(*contact, loads, goal, rounding, options.tolerance, report, newton);
    };
    if (near) {
        report.converged = meet();
        // The first multiplier did not know of the tools; each new one takes over what the penalty carried.
        for (int round = 0; round < 3 && volume_.term.hard(); ++round) {
            const double P = volume_.pressure();
            if (!(std::abs(P - volume_.lambda) > options.tolerance * std::abs(P))) break;
            volume_.lambda = P;
            evaluate(at_), ++report.iterations;
            report.converged = meet();
        }
    } else {
        report.converged = quick(goal);
    }
    // Phi at x^n is at least resting / 2. Never end above it, so that the energy never exceeds what the loads
    // and inertia bring.
    if (near && !contact->points().empty()) {
        at_.residual = report.residual;
    } else if (!report.converged || at_.value > resting / 2) {
        trial_.x = start_;
        move_pins(trial_.x);
        evaluate(trial_);
        ++report.iterations;
        if (trial_.value < at_.value - 1e-12 * std::abs(at_.value)) {
            std::swap(at_, trial_);
            report.converged = at_.residual <= goal;
        }
        if (!report.converged) report.converged = newton(goal);
    }
    report.residual = at_.residual;
    report.pressure = volume_.term.hard() ? restore_volume(near ? still_ : is_pinned_) : volume_.pressure();
    if (near)
        for (const Contact::Point& p : contact->points())
            for (int k = 0; k < p.count; ++k) {
                const Index i = contact->candidates()[p.corners[k]].vertex;
                target_[i] += h_ / body_.m[i] * p.weights[k] * (p.jn * p.normal + p.jt);
            }
    if (body_.free && pinned_.empty()) correct_rigidly();

    for (std::size_t i = 0; i < n; ++i) {
        if (!(at_.x[i].squaredNorm() < 1e200)) {
            report.not_finite = Index(i);
            return report;
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        state.v[i] = (at_.x[i] - start_[i]) / h_;
        state.x[i] = at_.x[i];
    }
    if (near) {
        for (Candidate& c : contact->candidates()) c.x = state.x[c.vertex], c.v = state.v[c.vertex];
        contact->close();
        for (const Candidate& c : contact->candidates()) state.x[c.vertex] = c.x;
    }
    return report;
}

}  // namespace innerspring
