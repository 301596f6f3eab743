#include "innerspring/sim/implicit.h"

#include <algorithm>
#include <cmath>

namespace innerspring {

namespace {

constexpr std::size_t remembered_pairs = 8;

std::vector<Index> pinned_vertices(const Loads& loads) {
    std::vector<Index> pinned;
    for (const Pin& pin : loads.pins) pinned.insert(pinned.end(), pin.vertices.begin(), pin.vertices.end());
    std::sort(pinned.begin(), pinned.end());
    return pinned;
}

double dot(const auto& a, const auto& b) {
    return a.cwiseProduct(b).sum();
}

}  // namespace

ImplicitSolver::ImplicitSolver(const Body& body, double h) : body_(body), h_(h) {
    const std::size_t n = body.vertices();
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t i = 0; i < n; ++i) {
        entries.emplace_back(int(i), int(i), body.m[i] / (h * h) + body.c[i] / h + body.K[i]);
        for (const Spoke& spoke : body.spokes_of(i)) {
            entries.emplace_back(int(i), int(i), spoke.k);
            if (spoke.neighbour < i)
                entries.emplace_back(int(i), int(spoke.neighbour), -spoke.k);  // lower triangle
        }
    }
    A_.resize(int(n), int(n));
    A_.setFromTriplets(entries.begin(), entries.end());
    factor_.analyzePattern(A_);
}

void ImplicitSolver::factorize(const Loads& loads) {
    std::vector<Index> pinned = pinned_vertices(loads);
    if (factorized_ && pinned == pinned_) return;
    pinned_ = std::move(pinned);
    is_pinned_.assign(body_.vertices(), false);
    for (Index i : pinned_) is_pinned_[i] = true;
    // A pinned vertex keeps its place in the pattern but is cut off: its row and column are the identity's.
    Eigen::SparseMatrix<double> A = A_;
    for (int column = 0; column < A.outerSize(); ++column)
        for (Eigen::SparseMatrix<double>::InnerIterator it(A, column); it; ++it)
            if (is_pinned_[std::size_t(it.row())] || is_pinned_[std::size_t(it.col())])
                it.valueRef() = it.row() == it.col() ? 1.0 : 0.0;
    factor_.factorize(A);
    factorized_ = true;
}

double ImplicitSolver::evaluate(const Field& x, Field& gradient, Team& team) const {
    const std::size_t n = body_.vertices();
    const auto* positions = reinterpret_cast<const Vector*>(x.data());  // rows of three doubles are Vectors
    const HomeFrame frame = home_frame(body_, {positions, n}, team);
    const Field velocity = (x - start_) / h_;
    const auto* velocities = reinterpret_cast<const Vector*>(velocity.data());
    const auto* start = reinterpret_cast<const Vector*>(start_.data());
    const RigidMotion home = body_.free && body_.material.damping > 0
                                 ? rigid_fit(body_, 0, start, velocities, team)
                                 : RigidMotion{};
    std::vector<double> energy(block_count(n), 0.0);
    team.run(energy.size(), [&](std::size_t block) {
        for (std::size_t i = block * block_size; i < std::min(n, (block + 1) * block_size); ++i) {
            const Vector x_i = positions[i];
            const Vector to_target = x_i - target_.row(int(i)).transpose();
            const Vector slip = velocities[i] - home.linear - home.angular.cross(start[i] - home.centre);
            const Vector to_home = x_i - (frame.R * body_.rest.positions[i] + frame.t);
            const double mass = body_.m[i] / (h_ * h_);
            double springs = 0;
            for (const Spoke& spoke : body_.spokes_of(i)) {
                const double stretch = (positions[spoke.neighbour] - x_i).norm() - spoke.rest;
                springs += spoke.k * stretch * stretch;
            }
            // An edge is seen from both ends: half of its energy at each.
            energy[block] += (mass * to_target.squaredNorm() + h_ * body_.c[i] * slip.squaredNorm() +
                              body_.K[i] * to_home.squaredNorm() + springs / 2) /
                             2;
            const Vector g = is_pinned_[i]
                                 ? Vector(Vector::Zero())
                                 : Vector(mass * to_target + body_.c[i] * slip + body_.K[i] * to_home -
                                          surface_force(body_, positions, i));
            gradient.row(int(i)) = g.transpose();
        }
    });
    double sum = 0;
    for (double e : energy) sum += e;
    return sum;
}

ImplicitSolver::Field ImplicitSolver::descend(const Field& gradient) const {
    // Two-loop recursion (Nocedal 1980) around A^-1.
    Field q = gradient;
    std::vector<double> alpha(pairs_.size());
    for (std::size_t n = pairs_.size(); n-- > 0;) {
        alpha[n] = pairs_[n].inverse * dot(pairs_[n].s, q);
        q -= alpha[n] * pairs_[n].y;
    }
    Field r(q.rows(), 3);
    for (int axis = 0; axis < 3; ++axis) r.col(axis) = factor_.solve(Eigen::VectorXd(q.col(axis)));
    for (std::size_t n = 0; n < pairs_.size(); ++n)
        r += (alpha[n] - pairs_[n].inverse * dot(pairs_[n].y, r)) * pairs_[n].s;
    return -r;
}

StepReport ImplicitSolver::step(const Loads& loads, const StepOptions& options, State& state, Team& team) {
    factorize(loads);
    const std::size_t n = body_.vertices();
    const int rows = int(n);
    const double time = state.time + h_;
    std::vector<Vector> external(n, Vector::Zero());
    add_loads(loads, time, external);

    start_ = Eigen::Map<const Field>(state.x[0].data(), rows, 3);
    target_.resize(rows, 3);
    for (std::size_t i = 0; i < n; ++i)
        target_.row(int(i)) =
            (state.x[i] + h_ * state.v[i] + h_ * h_ * (loads.gravity + external[i] / body_.m[i])).transpose();

    // From the better of "stay" and "fly on": Phi then only falls, so the energy never exceeds what the loads
    // and inertia bring.
    Field x = start_, gradient(rows, 3), other = target_, other_gradient(rows, 3);
    for (const Pin& pin : loads.pins) {
        const Vector offset = offset_at(pin, time);
        for (Index i : pin.vertices)
            x.row(int(i)) = other.row(int(i)) = (body_.rest.positions[i] + offset).transpose();
    }
    double value = evaluate(x, gradient, team);
    // The forces of the step: what inertia and loads bring, and what is out of balance if nothing moves but
    // the pins.
    double scale2 = 0;
    for (std::size_t i = 0; i < n; ++i)
        scale2 += ((target_.row(int(i)) - start_.row(int(i))) * (body_.m[i] / (h_ * h_))).squaredNorm();
    scale2 = std::max(scale2, gradient.squaredNorm());
    const double other_value = evaluate(other, other_gradient, team);
    if (!std::isfinite(value) || !std::isfinite(scale2)) {  // loads beyond the numbers
        StepReport refused;
        refused.converged = false;
        for (refused.not_finite = 0; refused.not_finite + 1 < n; ++refused.not_finite)
            if (!(target_.row(int(refused.not_finite)).squaredNorm() < 1e200)) break;
        return refused;
    }
    if (other_value < value) x = other, gradient = other_gradient, value = other_value;

    StepReport report;
    pairs_.clear();
    // What rounding of the positions does to the value.
    const double noise = 1e-15 * std::sqrt(scale2) * x.norm();
    const double goal = options.tolerance * std::sqrt(scale2);
    report.residual = gradient.norm();
    while (report.residual > goal && report.iterations < options.max_iterations) {
        Field direction = descend(gradient);
        double slope = dot(direction, gradient);
        if (!(slope < 0)) {  // rounding spoiled the pairs: the plain matrix always descends
            pairs_.clear();
            direction = descend(gradient);
            slope = dot(direction, gradient);
        }
        if (!(slope < 0)) break;
        double length = 1;
        bool found = false;
        for (int trial = 0; trial < 30 && !found; ++trial, length /= 2) {
            other = x + length * direction;
            const double v = evaluate(other, other_gradient, team);
            ++report.iterations;
            // Near the minimum the value no longer resolves a gain that the gradient still shows.
            const bool gain = v <= value + 1e-4 * length * slope;
            const bool flat = std::abs(v - value) <= noise && other_gradient.norm() < report.residual;
            if (gain || flat) {
                found = true;
                value = v;
            }
        }
        if (!found) break;
        Pair pair{other - x, other_gradient - gradient, 0};
        const double sy = dot(pair.s, pair.y);
        if (sy > 1e-12 * pair.s.norm() * pair.y.norm()) {
            pair.inverse = 1 / sy;
            if (pairs_.size() == remembered_pairs) pairs_.erase(pairs_.begin());
            pairs_.push_back(std::move(pair));
        }
        x.swap(other);
        gradient.swap(other_gradient);
        report.residual = gradient.norm();
    }
    // Below the rounding of the terms that were summed there is nothing left to gain.
    const double rounding = 4e-15 * (A_.diagonal().asDiagonal() * x).norm();
    report.converged = report.residual <= std::max(goal, rounding);

    for (std::size_t i = 0; i < n; ++i) {
        const Vector moved = x.row(int(i)).transpose();
        if (!(moved.squaredNorm() < 1e200)) {
            report.not_finite = Index(i);
            return report;
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        const Vector moved = x.row(int(i)).transpose();
        state.v[i] = (moved - state.x[i]) / h_;
        state.x[i] = moved;
    }
    return report;
}

}  // namespace innerspring
