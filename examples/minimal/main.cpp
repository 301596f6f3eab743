#include <innerspring/mesh/shapes.h>
#include <innerspring/sim/measure.h>
#include <innerspring/sim/step.h>

#include <cstdio>

int main() {
    using namespace innerspring;
    // A built-in shape; read("breast.stl") and weld() give one from a file. The paper's material.
    Body body = build_body(make_shape("breast:vertices=2000"));
    // Gravity along -y, and 0.02 N over a radius of influence of 0.4 m around vertex 0.
    Loads loads;
    loads.forces.push_back(patch_force(body, 0, 0.4, {0, 0, -0.02}));
    // Steps of 10 ms, sub-stepped as stability needs.
    State state = rest_state(body);
    Workspace workspace(body, {.dt = 0.01});
    for (int n = 0; n < 100; ++n) step(body, loads, state, workspace);
    const Measures now = measure(body, loads, state);
    std::printf("after %g s: volume %+.4f %%, largest displacement %.2g m\n", now.time,
                now.volume_variation_percent, now.max_displacement);
}
