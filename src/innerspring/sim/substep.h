#pragma once
#include <optional>

#include "innerspring/sim/implicit.h"
#include "innerspring/sim/packed.h"
#include "innerspring/sim/stability.h"
#include "innerspring/sim/step.h"

namespace innerspring {

/// Sums of the volume term over a block of vertices.
struct PressSums {
    double volume = 0, flow = 0, give = 0;  ///< their share of 18 V [m^3], and of Pressing's flow and give
};

/// What steps of one body with one set of options keep between them.
struct Workspace::Data {
    Data(const Body& body, const StepOptions& asked)
        : options(asked), integrator(asked.integrator), team(asked.threads), volume(body) {}

    StepOptions options;
    Integrator integrator;
    int substeps = 1;
    Team team;
    std::vector<Vector> x, v, external;  ///< the arrays a step writes before they are swapped in
    std::vector<Index> not_finite;       ///< per block
    StabilityBound bound;
    std::optional<Packed> packed;  ///< in single precision
    std::optional<ImplicitSolver> implicit;
    Contact contact;
    LargestMotion largest;
    bool tools = false;  ///< were there
    VolumeTerm volume;
    std::vector<Vector> area, response;  ///< a_i, and dv_i / d(h P), of the sub-step
    std::vector<PressSums> sums;         ///< per block
    double pressure = 0;                 ///< sum over the sub-steps of a step [Pa]
};

/// One symplectic Euler step of length h [s], the last of a step of dt or not, in double precision. The state
/// changes only if all stays finite; else the first vertex that did not is returned.
Index substep(const Body& body, const Loads& loads, double h, bool last, State& state, Workspace::Data& w);

/// The same in single precision, on w.packed; `time` [s] is that before it. `volume`, if not null: Eq. 4
/// before it [m^3]. False if something left the numbers.
bool packed_substep(const Body& body, const Loads& loads, double time, double h, bool last,
                    Workspace::Data& w, double* volume);

}  // namespace innerspring
