#include <memory>

#include "innerspring/sim/stability.h"
#include "innerspring/sim/step.h"
#include "peers.h"

namespace innerspring {

Peer ours(const Body& body, const Loads& loads, double dt, int threads) {
    StepOptions options;
    options.integrator = Integrator::symplectic;
    options.threads = threads;
    options.dt = dt;
    auto workspace = std::make_shared<Workspace>(body, options);
    auto state = std::make_shared<State>(rest_state(body));
    return {"innerspring", threads,
            [=, &body, &loads](int steps) { step(body, loads, *state, *workspace, steps); },
            [=] { return state->x; }, true};
}

}  // namespace innerspring
