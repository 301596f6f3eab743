#include "innerspring/sim/equilibrium.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <limits>

#include "innerspring/mesh/error.h"
#include "innerspring/sim/forces.h"

namespace innerspring {

namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// The total potential energy, its gradient and its Hessian, over the vertices that are not pinned.
struct Problem {
    const Body& body;
    const Loads& loads;
    double time;
    std::vector<bool> pinned;
    std::vector<int> place;  ///< of each vertex in the fill-reducing order
    mutable Team alone{1};

    double energy(const std::vector<Vector>& x) const {
        return inner_energy(body, home_frame(body, x, alone), x) + surface_energy(body, x) +
               gravity_energy(body, loads.gravity, x) + load_energy(body, loads, time, x);
    }

    /// Forces left on each vertex, zero where pinned; returns the largest.
    double residual(const std::vector<Vector>& x, std::vector<Vector>& f) const {
        f.assign(x.size(), Vector::Zero());
        add_inner_forces(body, home_frame(body, x, alone), x, f);
        add_surface_forces(body, x, f);
        add_gravity(body, loads.gravity, f);
        add_loads(loads, time, f);
        double largest = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            if (pinned[i]) f[i].setZero();
            largest = std::max(largest, f[i].norm());
        }
        return largest;
    }

    /// Lower triangle in the permuted order. A spring adds k (d d^T/|d|^2 + (1 - l/|d|) (I - d d^T/|d|^2));
    /// with `convex` the second term, negative in a compressed spring, is left out where it is so. A free
    /// body's K_i I leaves out the motion of its frame, which only ever softens: without add_frame_motion()
    /// the step is shorter, never wrong in direction.
    Sparse hessian(const std::vector<Vector>& x, bool convex) const {
        std::vector<Eigen::Triplet<double>> entries;
        entries.reserve(9 * (body.k.size() * 2 + body.vertices()));
        auto add = [&](Index i, Index j, const Eigen::Matrix3d& block) {
            const int row = 3 * place[i], column = 3 * place[j];
            for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c)
                    if (row + r >= column + c) entries.emplace_back(row + r, column + c, block(r, c));
        };
        for (Index i = 0; i < body.vertices(); ++i) {
            Eigen::Matrix3d block = Eigen::Matrix3d::Identity();
            if (!pinned[i]) {
                block *= body.K[i];
                for (const Spoke& spoke : body.spokes_of(i)) {
                    const Vector d = x[spoke.neighbour] - x[i];
                    const double length = d.norm();
                    Eigen::Matrix3d spring = spoke.k * Eigen::Matrix3d::Identity();
                    if (length > 0) {
                        const Eigen::Matrix3d along = d * d.transpose() / (length * length);
                        const double across =
                            convex ? std::max(0.0, 1 - spoke.rest / length) : 1 - spoke.rest / length;
                        spring = spoke.k * (along + across * (Eigen::Matrix3d::Identity() - along));
                    }
                    block += spring;
                    if (!pinned[spoke.neighbour] && place[i] > place[spoke.neighbour])
                        add(i, spoke.neighbour, -spring);
                }
            }
            add(i, i, block);
        }
        Sparse H(3 * int(body.vertices()), 3 * int(body.vertices()));
        H.setFromTriplets(entries.begin(), entries.end());
        return H;
    }

    /// The frame of a free body follows x: its Hessian is H - B S^-1 B^T, S the 6 x 6 second derivative of
    /// the inner energy by a small translation and rotation of the homes, B_i = K_i [I, -[r_i]x] the mixed
    /// one, r_i = h_i - mean of x. Turns p = H^-1 f into the solution with that Hessian (Woodbury). False if
    /// it is not positive definite.
    template <class Factor>
    bool add_frame_motion(const std::vector<Vector>& x, const Factor& factor, Eigen::VectorXd& p) const {
        using Matrix6 = Eigen::Matrix<double, 6, 6>;
        const HomeFrame frame = home_frame(body, x, alone);
        Vector mean = Vector::Zero();
        double K = 0;
        for (std::size_t i = 0; i < x.size(); ++i) mean += body.K[i] * x[i], K += body.K[i];
        mean /= K;
        Eigen::Matrix<double, Eigen::Dynamic, 6> B =
            Eigen::Matrix<double, Eigen::Dynamic, 6>::Zero(3 * Eigen::Index(x.size()), 6);
        Matrix6 S = Matrix6::Zero();
        S.topLeftCorner<3, 3>().diagonal().setConstant(K);
        for (std::size_t i = 0; i < x.size(); ++i) {
            const Vector r = frame.R * body.rest.positions[i] + frame.t - mean, y = x[i] - mean;
            const Eigen::Matrix3d yr = y * r.transpose();
            S.bottomRightCorner<3, 3>() +=
                body.K[i] * (y.dot(r) * Eigen::Matrix3d::Identity() - (yr + yr.transpose()) / 2);
            if (pinned[i]) continue;
            Eigen::Matrix3d turn;  // [r]x
            turn << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
            B.block<3, 6>(3 * place[i], 0) << body.K[i] * Eigen::Matrix3d::Identity(), -body.K[i] * turn;
        }
        const Eigen::MatrixXd HB = factor.solve(Eigen::MatrixXd(B));
        const Eigen::LLT<Matrix6> small(S - B.transpose() * HB);
        if (Eigen::LLT<Matrix6>(S).info() != Eigen::Success || small.info() != Eigen::Success) return false;
        p += HB * small.solve(B.transpose() * p);
        return true;
    }

    /// What rounding leaves of a sum of spring forces that cancel [N].
    double rounding(const std::vector<Vector>& x) const {
        double stiffest = 0, farthest = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            double k = body.K[i];
            for (const Spoke& spoke : body.spokes_of(i)) k += spoke.k;
            stiffest = std::max(stiffest, k);
            farthest = std::max(farthest, x[i].norm());
        }
        return std::numeric_limits<double>::epsilon() * stiffest * farthest;
    }
};

/// Approximate minimum degree on the vertex graph; each vertex's three unknowns stay together.
std::vector<int> fill_reducing_order(const Body& body) {
    std::vector<Eigen::Triplet<double>> entries;
    for (Index i = 0; i < body.vertices(); ++i) {
        entries.emplace_back(int(i), int(i), 1.0);
        for (const Spoke& spoke : body.spokes_of(i)) entries.emplace_back(int(i), int(spoke.neighbour), 1.0);
    }
    Sparse graph(int(body.vertices()), int(body.vertices()));
    graph.setFromTriplets(entries.begin(), entries.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
    Eigen::AMDOrdering<int>()(graph, order);
    std::vector<int> place(body.vertices());
    for (int n = 0; n < order.size(); ++n) place[std::size_t(order.indices()[n])] = n;
    return place;
}

std::vector<bool> pinned_flags(const Body& body, const Loads& loads) {
    std::vector<bool> pinned(body.vertices(), false);
    for (const Pin& pin : loads.pins)
        for (Index i : pin.vertices) pinned[i] = true;
    return pinned;
}

}  // namespace

void require_held(const Body& body, const Loads& loads) {
    if (body.free && loads.pins.empty())
        throw InputError(
            "a free body has no equilibrium under its loads; hold it (no --free) or pin some vertices");
}

double load_sum(const Body& body, const Loads& loads, double time) {
    double sum = body.material.mass * loads.gravity.norm();
    for (const Force& f : loads.forces) sum += std::abs(at(f.profile, time)) * f.newton.stableNorm();
    return sum;
}

double largest_imbalance(const Body& body, const Loads& loads, const State& state) {
    std::vector<Vector> f;
    return Problem{body, loads, state.time, pinned_flags(body, loads), {}}.residual(state.x, f);
}

EquilibriumReport solve_equilibrium(const Body& body, const Loads& loads, State& state,
                                    const EquilibriumOptions& options) {
    require_held(body, loads);
    const std::size_t n = body.vertices();
    Problem problem{body, loads, state.time, pinned_flags(body, loads), fill_reducing_order(body)};
    for (const Pin& pin : loads.pins)
        for (Index i : pin.vertices) state.x[i] = body.rest.positions[i] + offset_at(pin, state.time);

    EquilibriumReport report;
    const double load = load_sum(body, loads, state.time);
    std::vector<Vector> f, trial(n), f_trial;
    report.residual_n = problem.residual(state.x, f);
    // With pins alone, or no loads at all, the springs' own forces set the scale; and no residual falls below
    // its rounding.
    const double scale = std::max(load, loads.pins.empty() && load > 0 ? 0.0 : report.residual_n);
    report.tolerance_n =
        options.tolerance_n > 0 ? options.tolerance_n : std::max(1e-9 * scale, problem.rounding(state.x));

    Eigen::SimplicialLLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<int>> factor;
    bool analysed = false;
    double energy = problem.energy(state.x);
    Eigen::VectorXd rhs(3 * int(n));
    while (!(report.reached = report.residual_n <= report.tolerance_n) &&
           report.iterations < options.max_iterations) {
        ++report.iterations;
        for (std::size_t i = 0; i < n; ++i) rhs.segment<3>(3 * problem.place[i]) = f[i];
        bool moved = false;
        // The true Hessian first; where it is not positive definite or its step gains nothing, the convex
        // one, which always descends.
        for (bool convex : {false, true}) {
            const Sparse H = problem.hessian(state.x, convex);
            if (!analysed) factor.analyzePattern(H), analysed = true;
            factor.factorize(H);
            if (factor.info() != Eigen::Success) continue;
            Eigen::VectorXd p = factor.solve(rhs);
            if (body.free && !convex && !problem.add_frame_motion(state.x, factor, p)) continue;
            const double slope = -rhs.dot(p);
            if (!(slope < 0)) continue;
            double length = 1;
            for (int cut = 0; cut < 40 && !moved; ++cut, length /= 2) {
                for (std::size_t i = 0; i < n; ++i)
                    trial[i] = state.x[i] + length * p.segment<3>(3 * problem.place[i]);
                const double e = problem.energy(trial), r = problem.residual(trial, f_trial);
                // Near the minimum the energy no longer resolves a gain that the residual still shows.
                const bool flat = std::abs(e - energy) <= 1e-12 * std::abs(energy) && r < report.residual_n;
                if (std::isfinite(e) && (e <= energy + 1e-4 * length * slope || flat)) {
                    moved = true;
                    energy = e;
                    report.residual_n = r;
                    state.x.swap(trial);
                    f.swap(f_trial);
                }
            }
            if (moved) break;
        }
        if (!moved) break;
    }
    for (Vector& v : state.v) v.setZero();
    return report;
}

}  // namespace innerspring
