#pragma once
#include <functional>
#include <string>
#include <vector>

#include "innerspring/body/body.h"
#include "innerspring/sim/loads.h"

namespace innerspring {

/// One simulator of one body, ready to step from the rest position.
struct Peer {
    std::string what;
    int threads = 1;
    std::function<void(int)> advance;                ///< so many steps
    std::function<std::vector<Vector>()> positions;  ///< as they are now [m]
    bool same_physics = false;  ///< steps as step() does: positions must agree to rounding
};

/// This library: explicit steps of a held body.
Peer ours(const Body& body, const Loads& loads, double dt, int threads);

/// The loop anybody would write first, for this machine's instruction set.
Peer plain_loop(const Body& body, const Loads& loads, double dt);

/// Bullet's soft body; empty where the program was built without Bullet.
std::vector<Peer> bullet(const Body& body, const Loads& loads, double dt);

}  // namespace innerspring
