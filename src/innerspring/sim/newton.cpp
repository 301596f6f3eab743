#include "innerspring/sim/newton.h"

#include <algorithm>
#include <cmath>

namespace innerspring {

void add(double factor, const Minimand::Field& from, Minimand::Field& to) {
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += factor * from[i];
}

double dot(const Minimand::Field& a, const Minimand::Field& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
    return sum;
}

void Newton::model(Minimand& f, const Field& g, double relative, double enough, int most) {
    const std::size_t n = g.size();
    p_.assign(n, Vector::Zero());
    r_ = g;
    z_.resize(n), d_.resize(n), q_.resize(n);
    // |p|_M, p . M d and |d|_M follow from recurrences.
    double rz = f.precondition(r_, z_), pp = 0, pd = 0, dd = rz;
    const double goal = relative * relative * rz;
    for (std::size_t i = 0; i < n; ++i) d_[i] = -z_[i];
    cut_short_ = false;
    gain_ = 0;
    auto advance = [&](double step, double slope, double curvature) {
        add(step, d_, p_);
        gain_ -= step * slope + step * step * curvature / 2;
    };
    for (products_ = 0; products_ < most && rz > goal && f.residual(r_) > enough;) {
        const double curvature = f.multiply(d_, q_), slope = -rz;
        ++products_;
        const bool downhill = !(curvature > 0);
        if (downhill && !std::isfinite(radius_)) {  // the first time: no farther than so far, or a plain step
            radius_ = std::sqrt(products_ > 1 ? pp : dd);
            cut_short_ = true;
            if (products_ > 1) break;
        }
        const double step = rz / curvature, after = pp + 2 * step * pd + step * step * dd;
        if (downhill || !(after < radius_ * radius_)) {
            const double left = std::max(0.0, radius_ * radius_ - pp);
            advance((-pd + std::sqrt(pd * pd + dd * left)) / dd, slope, curvature);
            pp = radius_ * radius_;
            cut_short_ = true;
            break;
        }
        advance(step, slope, curvature);
        add(step, q_, r_);
        pp = after;
        const double before = rz;
        rz = f.precondition(r_, z_);
        const double beta = rz / before;
        pd = beta * (pd + step * dd);
        dd = rz + beta * beta * dd;
        for (std::size_t i = 0; i < n; ++i) d_[i] = beta * d_[i] - z_[i];
    }
    length_ = std::sqrt(std::max(0.0, pp));
}

Newton::Report Newton::run(Minimand& f, Field& x, Field& g, double value, const Goal& goal) {
    const std::size_t n = x.size();
    trial_.resize(n), g_trial_.resize(n);
    radius_ = std::numeric_limits<double>::infinity();
    Report report;
    report.value = value;
    report.residual = f.residual(g);
    while (!(report.reached = report.residual <= goal.residual) && report.iterations < goal.most_iterations &&
           report.products < goal.most_products) {
        ++report.iterations;
        f.linearise(x);
        // More exact as the residual gets small, which makes the end superlinear; no more exact than needed.
        const double relative = std::min(goal.model, std::sqrt(1e4 * report.residual / goal.scale));
        model(f, g, relative, goal.enough * goal.residual,
              std::min(1000, goal.most_products - report.products));
        report.products += products_;
        double slope = 0;
        for (std::size_t i = 0; i < n; ++i) slope += g[i].dot(p_[i]);
        // The step, or as much of it as lowers the value.
        double share = 1, quality = -1;
        for (int cut = 0; cut < 12 && quality < 0; ++cut) {
            for (std::size_t i = 0; i < n; ++i) trial_[i] = x[i] + share * p_[i];
            if (cut_short_) f.settle(trial_);
            const double e = f.evaluate(trial_, g_trial_), r = f.residual(g_trial_);
            ++report.evaluations;
            const double change = std::isfinite(e) ? e - report.value : std::numeric_limits<double>::max();
            // Near the minimum the value no longer resolves a gain that the residual still shows.
            const double noise =
                std::max(1e-12 * std::max(std::abs(report.value), std::abs(value)), f.noise());
            const bool flat = std::abs(change) <= noise && r < report.residual;
            if (change <= 1e-4 * share * slope || flat) {
                quality = flat ? 1 : -change / gain_;
                report.value = e;
                report.residual = r;
                x.swap(trial_);
                g.swap(g_trial_);
            } else {  // to the minimum of the parabola through value, slope and trial
                share *= std::clamp(-share * slope / (2 * (change - share * slope)), 0.1, 0.5);
            }
        }
        report.stepped = quality >= 0;
        if (quality < 0) {
            if (!(radius_ > 1e-12 * length_)) break;
            radius_ = 1e-3 * length_;
        } else if (share < 1) {
            radius_ = std::min(radius_, 2 * share * length_);
        } else if (quality < 0.25) {
            radius_ = std::min(radius_, 0.5 * length_);
        } else if (quality > 0.75 && cut_short_) {
            radius_ *= 3;
        }
    }
    return report;
}

}  // namespace innerspring
