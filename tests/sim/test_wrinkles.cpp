// Why a refined patch gives way a little more (docs/experiments.md): a surface without bending stiffness
// wrinkles where a push compresses it, at the length of its edges, and the finer the net the sooner.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <iostream>

#include "innerspring/body/refine.h"
#include "support/bodies.h"

namespace innerspring {
namespace {

using namespace support;

/// How far the depth under a patch load differs from the mean of its neighbours', relative to the mean depth
/// (root mean square over the middle of the patch). Of a smooth dent it falls fourfold with each level.
double roughness(double surface, int levels, double group) {
    Body body = make_body("sphere:vertices=1000", {.surface = surface});
    const Index vertex = 300;
    const Vector inward = -body.rest.positions[vertex].normalized();
    if (levels > 0) body = refined(body, triangles_near(body.rest, body.rest.positions[vertex], 0.5), levels);
    const double force_n = group * body.material.young * body.radius * body.radius;
    const Loads loads = one_force(patch_force(body, vertex, 0.4, force_n * inward));
    State state = rest_state(body);
    Workspace workspace(body, {.dt = 0.01, .integrator = Integrator::symplectic});
    for (int n = 0; n < 50; ++n) step(body, loads, state, workspace);
    const auto depth = [&](Index i) { return (state.x[i] - body.rest.positions[i]).dot(inward); };
    double squares = 0, mean = 0, count = 0;
    for (Index i = 0; i < body.vertices(); ++i) {
        if ((body.rest.positions[i] - body.rest.positions[vertex]).norm() > 0.3) continue;
        double around = 0;
        for (const Spoke& s : body.spokes_of(i))
            around += depth(s.neighbour) / double(body.spokes_of(i).size());
        squares += (depth(i) - around) * (depth(i) - around);
        mean += depth(i);
        ++count;
    }
    const double rough = std::sqrt(squares / count) / (mean / count);
    std::cout << fmt::format("[          ] E_s {:g}, levels {}, F/(E R^2) {:g}: roughness {:.3f}\n", surface,
                             levels, group, rough);
    return rough;
}

TEST(Wrinkles, FinerNetsWrinkleSoonerUnlessTheSurfaceIsSoft) {
    // Soft surface: smooth, and the finer the smoother, whatever the force.
    const double coarse = roughness(0.1, 0, 3e-3), soft = roughness(0.1, 1, 3e-3);
    EXPECT_LT(soft, 0.5 * coarse);
    EXPECT_NEAR(soft, roughness(0.1, 1, 1e-4), 0.1 * soft);
    // The paper's: one level wrinkles between 1e-3 and 3e-3, two levels already at 1e-3.
    const double at_1e3 = roughness(1, 1, 1e-3);
    EXPECT_LT(at_1e3, 1.5 * roughness(1, 1, 1e-4));
    EXPECT_GT(roughness(1, 1, 3e-3), 1.5 * at_1e3);
    EXPECT_GT(roughness(1, 2, 1e-3), 1.5 * at_1e3);
}

}  // namespace
}  // namespace innerspring
