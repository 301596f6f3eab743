#pragma once
#include "innerspring/sim/contact.h"
#include "innerspring/sim/loads.h"
#include "innerspring/sim/state.h"

namespace innerspring {

struct EquilibriumOptions {
    double tolerance_n = 0;  ///< largest residual force on a vertex [N]; 0: 1e-9 of the sum of the loads, but
                             ///< not below rounding
    int max_iterations = 500;
    int threads = 1;  ///< any number gives the same bits; 0: all cores
};

struct EquilibriumReport {
    bool reached = false;
    double residual_n = 0;   ///< largest residual force on a vertex [N]
    double tolerance_n = 0;  ///< the tolerance used [N]
    int iterations = 0;      ///< of Newton's method
    int products = 0;        ///< with the Hessian and the preconditioner, over all iterations
    double pressure = 0;     ///< of the volume term [Pa]; see VolumeTerm
};

/// Moves `state` to where all forces balance under the loads as they are at state.time; velocities become
/// zero. Newton's method, matrix-free, in a trust region (see Newton): the energy never rises. A free body
/// needs a pin, otherwise nothing holds it: throws InputError.
EquilibriumReport solve_equilibrium(const Body& body, const Loads& loads, State& state,
                                    const EquilibriumOptions& options = {});

/// Throws InputError if nothing holds the body (free, and no pin), or there are tools, which only steps know.
void require_held(const Body& body, const Loads& loads);

/// Largest force left on a vertex that is not pinned [N]: zero in equilibrium. `touched`: what tools press
/// with.
double largest_imbalance(const Body& body, const Loads& loads, const State& state,
                         std::span<const VertexContact> touched = {});

/// Sum of the loads at `time` [N]: weight and the magnitudes of the forces. The scale of a residual.
double load_sum(const Body& body, const Loads& loads, double time);

}  // namespace innerspring
