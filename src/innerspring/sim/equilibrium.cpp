#include "innerspring/sim/equilibrium.h"

#include <cmath>
#include <limits>
#include <optional>

#include "innerspring/mesh/error.h"
#include "innerspring/sim/forces.h"
#include "innerspring/sim/frame_motion.h"
#include "innerspring/sim/net.h"
#include "innerspring/sim/newton.h"
#include "innerspring/sim/preconditioner.h"
#include "innerspring/sim/volume.h"

namespace innerspring {

namespace {

using Field = std::vector<Vector>;

/// Infinite where anything is no number, or beyond them.
double largest_norm(const Field& a) {
    double largest = 0;
    for (const Vector& v : a) {
        const double square = v.squaredNorm();
        if (!std::isfinite(square)) return std::numeric_limits<double>::infinity();
        largest = std::max(largest, square);
    }
    return std::sqrt(largest);
}

/// New multipliers of a hard volume: each gains some three digits.
constexpr int most_rounds = 12;

std::vector<bool> pinned_flags(const Body& body, const Loads& loads) {
    std::vector<bool> pinned(body.vertices(), false);
    for (const Pin& pin : loads.pins)
        for (Index i : pin.vertices) pinned[i] = true;
    return pinned;
}

/// The total potential energy over the vertices that are not pinned, up to a constant, its gradient and its
/// Hessian.
struct Problem : Minimand {
    const Body& body;
    std::vector<bool> pinned;
    Field load;  ///< gravity and forces [N]
    Net net;
    VolumePart volume;
    Field place;  ///< where each vertex would rest without the net
    Team team;
    std::optional<FrameMotion> motion;
    HomeFrame frame_there;  ///< of linearise()
    std::optional<Preconditioner> inverse;

    Problem(const Body& b, const Loads& loads, double time, int threads)
        : body(b),
          pinned(pinned_flags(b, loads)),
          load(b.vertices(), Vector::Zero()),
          net(b),
          volume(b),
          team(threads) {
        add_gravity(body, loads.gravity, load);
        add_loads(loads, time, load);
        place.resize(b.vertices());
        for (std::size_t i = 0; i < place.size(); ++i)
            place[i] = body.rest.positions[i] + load[i] / body.K[i];
        if (volume.term.active() && !volume.term.hard()) volume.stiffen(0);
    }

    double evaluate(const Field& x, Field& g) override {
        double homes = 0;
        const HomeFrame frame = home_frame(body, x, team);
        if (body.free) {
            // K/2 |x - h|^2 - f x = K/2 |x - z|^2 - f h - f^2/(2 K); h moves with the frame.
            for (std::size_t i = 0; i < place.size(); ++i) {
                const Vector h = frame.R * body.rest.positions[i] + frame.t;
                place[i] = h + load[i] / body.K[i];
                // A pinned vertex keeps its inner spring to the moving frame.
                homes += pinned[i] ? body.K[i] * (x[i] - h).squaredNorm() / 2
                                   : -load[i].dot(h - body.rest.positions[i]);
            }
        }
        const double springs = homes + net.evaluate(x, body.K, place, pinned, g, team).total() +
                               add_deviation(body, frame, x, pinned, g, team);
        return volume.term.active() ? springs + volume.add_gradient(x, pinned, g, team) : springs;
    }

    double noise() const override { return volume.noise(); }
    double residual(const Field& g) const override { return largest_norm(g); }

    void linearise(const Field& x) override {
        net.linearise(x, team);
        if (!inverse) {
            inverse.emplace(body);
            inverse->factorize(body, body.K, pinned);
        }
        frame_there = home_frame(body, x, team);
        if (body.free) motion.emplace(body, frame_there, x);
        inverse->follow(body, x);
        inverse->set_normal_stiffness(body, body.K, x, 1);
        if (volume.term.active())
            volume.linearise(x, pinned, team,
                             [&](const Field& r, Field& z) { return inverse->apply(r, z, team); });
    }

    double multiply(const Field& p, Field& q) override {
        double pq = net.multiply(body.K, p, pinned, q, team);
        pq += multiply_deviation(body, frame_there, p, pinned, q, team);
        if (motion) pq += motion->add_to(p, pinned, q);
        if (volume.term.active()) pq += volume.add_product(p, pinned, q, team);
        return pq;
    }

    double precondition(const Field& r, Field& z) override {
        const double rz = inverse->apply(r, z, team);
        return volume.term.active() ? rz + volume.correct(r, z) : rz;
    }

    void settle(Field& x) override {
        // The places of a free body move with it, and settling knows nothing of volume and directions.
        if (!body.free && !volume.term.active() && body.N.empty()) net.settle(x, body.K, place, pinned);
    }

    /// What rounding leaves of a sum of spring forces that cancel [N].
    double rounding(const Field& x) const {
        double stiffest = 0, farthest = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            double k = stiffest_share(body.material) * body.K[i];
            for (const Spoke& spoke : body.spokes_of(i)) k += spoke.k;
            stiffest = std::max(stiffest, k);
            farthest = std::max(farthest, x[i].norm());
        }
        return std::numeric_limits<double>::epsilon() * stiffest * farthest;
    }
};

}  // namespace

void require_held(const Body& body, const Loads& loads) {
    if (!loads.tools.empty()) throw InputError("an equilibrium knows no tools; step until the body rests");
    if (body.free && loads.pins.empty())
        throw InputError(
            "a free body has no equilibrium under its loads; hold it (no --free) or pin some vertices");
}

double load_sum(const Body& body, const Loads& loads, double time) {
    double sum = body.material.mass * loads.gravity.norm();
    for (const Force& f : loads.forces) sum += std::abs(at(f.profile, time)) * f.newton.stableNorm();
    return sum;
}

double largest_imbalance(const Body& body, const Loads& loads, const State& state,
                         std::span<const VertexContact> touched) {
    Problem problem(body, loads, state.time, 1);
    Field g(body.vertices());
    if (problem.volume.term.hard()) problem.volume.lambda = pressure(body, loads, state, touched);
    problem.evaluate(state.x, g);
    for (const VertexContact& c : touched) g[c.vertex] -= c.force;
    return largest_norm(g);
}

EquilibriumReport solve_equilibrium(const Body& body, const Loads& loads, State& state,
                                    const EquilibriumOptions& options) {
    require_held(body, loads);
    const std::size_t n = body.vertices();
    Problem problem(body, loads, state.time, options.threads);
    for (const Pin& pin : loads.pins)
        for (Index i : pin.vertices) state.x[i] = body.rest.positions[i] + offset_at(pin, state.time);
    const Field start = state.x;

    EquilibriumReport report;
    const double load = load_sum(body, loads, state.time);
    Field g(n);
    double energy = problem.evaluate(state.x, g);
    if (!body.free && loads.pins.empty()) {
        // As a whole to where the forces' sum vanishes: what gravity does to a sphere, to the last digit.
        Vector sum = Vector::Zero();
        double K = 0;
        for (std::size_t i = 0; i < n; ++i) sum += g[i], K += body.K[i];
        const Vector by =
            body.N.empty() ? Vector(sum / K)
                           : Vector((K * Eigen::Matrix3d::Identity() + deviation_sum(body)).llt().solve(sum));
        if (by.allFinite())
            for (Vector& x : state.x) x -= by;
        energy = problem.evaluate(state.x, g);
    }
    report.residual_n = largest_norm(g);
    // With pins alone, or no loads at all, the springs' own forces set the scale; and no residual falls below
    // its rounding.
    const double scale = std::max(load, loads.pins.empty() && load > 0 ? 0.0 : report.residual_n);
    report.tolerance_n =
        options.tolerance_n > 0 ? options.tolerance_n : std::max(1e-9 * scale, problem.rounding(state.x));
    for (Vector& v : state.v) v.setZero();
    // Loads beyond the numbers are balanced by nothing.
    const auto finite = [&] {
        return std::isfinite(energy) && std::isfinite(report.residual_n) &&
               std::isfinite(report.tolerance_n) && std::isfinite(largest_norm(state.x));
    };
    if (!finite()) {
        state.x = start;
        return report;
    }
    Newton newton;
    VolumePart& volume = problem.volume;
    if (volume.term.hard()) {
        problem.linearise(state.x);
        volume.stiffen(1000);
    }
    for (int round = 0; round < most_rounds; ++round) {
        if (volume.term.hard()) {  // the new multiplier takes over what the penalty carried
            volume.lambda = round == 0 ? pressure(body, loads, state) : volume.pressure();
            energy = problem.evaluate(state.x, g);
        }
        const Newton::Report done =
            newton.run(problem, state.x, g, energy,
                       {.residual = report.tolerance_n,
                        .scale = scale,
                        .most_iterations = std::max(1, options.max_iterations - report.iterations),
                        .enough = 0.8});
        report.reached =
            done.reached && (!volume.term.hard() || std::abs(volume.excess) <= 1e-10 * body.volume);
        report.residual_n = done.residual;
        report.iterations += done.iterations;
        report.products += done.products;
        if (!volume.term.hard() || report.reached || !done.reached) break;
    }
    report.pressure = volume.pressure();
    if (!finite()) {
        report.reached = false;
        state.x = start;
    }
    return report;
}

}  // namespace innerspring
