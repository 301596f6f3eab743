#pragma once
#include <span>
#include <vector>

#include "innerspring/sim/step.h"

namespace innerspring {

/// When a simulation is looked at: at rest and then `samples` times, dt apart.
struct Sampling {
    double dt_s = 0.01;
    int samples = 50;
    double duration_s() const { return dt_s * samples; }
};

/// Long enough for every one of `bodies` to come to rest: 15 times the slowest sqrt(m_i / K_i), in the
/// paper's steps of 0.01 s, or in 25 to 100 steps where the body is much faster or slower than the paper's.
Sampling sampling_until_rest(std::span<const Body* const> bodies);

/// What one simulation showed, from rest to equilibrium: a value per sample, the first at rest. Of press(): a
/// value per force, the first without one.
struct Response {
    std::vector<double> vertex_m;        ///< |x - q| of the watched vertex [m]; empty where none is watched
    std::vector<double> load_m;          ///< displacement of the load, see load_displacement [m]
    std::vector<double> volume_percent;  ///< 100 (V/V_0 - 1)
    double std_m = 0;                    ///< at the end: sqrt of the mean over vertices of |u - mean u|^2 [m]
    double imbalance = 0;  ///< at the end: largest force left on a vertex, of the whole load [1]
    std::vector<double> force_n = {}, pressure_pa = {};  ///< press() only; P of the volume term
};

/// sum w_i u_i along the load [m]: w_i the weights of the one force there is, or the shares of mass under
/// gravity. It is what the load works against: the work of a constant force F is F times this.
double load_displacement(const Body& body, const Loads& loads, const State& state);

/// Simulates from rest, explicitly, and leaves the last state in `state`. `loads` is one force or gravity.
/// Throws RunError if the simulation leaves the numbers.
Response respond(const Body& body, const Loads& loads, Index watched, const Sampling& sampling,
                 Workspace& workspace, State& state);

/// Equilibria, each found from rest, under `unit` (a force of 1 N) times each of `forces_n` [N], which
/// increase; last under the force that moves `watched` by `depth_m`, to at most 1 % more. `imbalance` is the
/// largest of them.
Response press(const Body& body, const Force& unit, Index watched, std::span<const double> forces_n,
               double depth_m);

}  // namespace innerspring
