#include "innerspring/sim/implicit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace innerspring {

namespace {

/// How much of the springs' own stiffness along the normal counts (see Preconditioner).
constexpr double normal_share = 4;

/// Evaluations after which Newton's method takes over.
constexpr int most_quick = 40;

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

/// Moves a held body as a whole to where its forces balance, which the preconditioner is not exact for:
/// the net's forces stay, and the gradient is known without another look at them.
void ImplicitSolver::settle_translation() {
    Vector g = Vector::Zero();
    double d = 0;
    for (std::size_t i = 0; i < d_.size(); ++i) g += at_.g[i], d += d_[i];
    Vector by = -g / d;
    if (!body_.N.empty()) by = -(d * Eigen::Matrix3d::Identity() + deviation_sum(body_)).llt().solve(g);
    if (!by.allFinite()) return;
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
        // By reference, so that nothing is allocated.
        return touch(*contact, loads, goal, rounding, options.tolerance, report, std::ref(quick)) ||
               touch(*contact, loads, goal, rounding, options.tolerance, report, std::ref(newton));
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
