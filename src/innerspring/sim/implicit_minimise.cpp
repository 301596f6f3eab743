#include <algorithm>
#include <cmath>

#include "innerspring/sim/implicit.h"

// Phi, its gradient and its Hessian; the way down by L-BFGS.
namespace innerspring {

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

}  // namespace innerspring
