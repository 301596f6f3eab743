#include <gtest/gtest.h>

#include "innerspring/mesh/error.h"
#include "innerspring/sim/refiner.h"
#include "support/bodies.h"
#include "support/sanitized.h"

// The mesh follows the tools.
namespace innerspring {
namespace {

using namespace support;

/// What the changes of the mesh did in a run with one tool: in the step after each, compared with the same
/// step without it.
struct Pressed {
    double most = 0;   ///< force on the tool [N]
    double jump = 0;   ///< the largest change of it [N]
    double share = 0;  ///< the same as a share of the force, where that is a tenth of the most
    double moved = 0;  ///< the largest of a vertex of the first mesh [m]
    int changes = 0, under_load = 0;
    std::size_t finest = 0, last = 0;  ///< vertices
    double side = 0;                   ///< longest at a vertex that touched [m]
};

Pressed press(Body body, const Tool& tool, const std::vector<RefineRule>& rules, int steps,
              Precision precision) {
    StepOptions options;
    options.dt = 0.005, options.precision = precision;
    Loads loads{Vector::Zero(), {}, {}, {tool}};
    Workspace workspace(body, options);
    State state = rest_state(body);
    Refiner refiner(body, rules);
    const std::size_t first = body.vertices();
    std::vector<std::array<double, 2>> forces;
    Pressed result;
    for (int n = 0; n < steps; ++n) {
        const Body body_before = body;
        State unchanged = state;
        const int before = refiner.changes();
        refiner.before_step(state.time, options.dt, body, loads, state,
                            [&](const Transfer& transfer) { workspace.adapt(body, transfer); });
        EXPECT_EQ(step(body, loads, state, workspace).not_finite, no_index);
        const double force = workspace.contact().tools[0].force.norm();
        for (const VertexContact& c : workspace.contact().vertices)
            for (const Spoke& s : body.spokes_of(c.vertex)) result.side = std::max(result.side, s.rest);
        result.most = std::max(result.most, force);
        result.finest = std::max(result.finest, body.vertices());
        if (refiner.changes() == before) continue;
        Workspace other(body_before, options);
        step(body_before, loads, unchanged, other);
        forces.push_back({force, other.contact().tools[0].force.norm()});
        for (std::size_t i = 0; i < first; ++i)
            result.moved = std::max(result.moved, (state.x[i] - unchanged.x[i]).norm());
    }
    for (const auto& [with, without] : forces) {
        result.jump = std::max(result.jump, std::abs(with - without));
        result.under_load += without > 0;
        if (without > result.most / 10) result.share = std::max(result.share, std::abs(with / without - 1));
    }
    result.changes = int(forces.size());
    result.last = body.vertices();
    return result;
}

RefineRule under_tools(double share, int levels) {
    RefineRule rule;
    rule.tool_share = share, rule.levels = levels;
    return rule;
}

/// Onto the top of the unit sphere, held, drawn over it by 0.2 m, held, and away.
Tool scripted(Tool tool, double depth) {
    const double up = 1 + tool.radius;
    tool.path.clear();
    for (auto [time, x, z] :
         {std::array{0.0, 0.0, 0.3}, std::array{0.5, 0.0, -depth}, std::array{0.8, 0.0, -depth},
          std::array{1.3, 0.2, -depth}, std::array{1.5, 0.2, -depth}, std::array{2.0, 0.2, 0.8}})
        tool.path.push_back({time, {{x, 0, up + z}}});
    return tool;
}

// The mesh is fine enough where the tool touches, as it was once it has gone, and the hand feels no change of
// it: less than 5 % of the force, and no vertex jumps by more than 2 mm, a pixel of the body's picture.
TEST(ToolRefine, AScriptedPressFeelsNoJump) {
    const Body coarse = make_sphere("icosphere:vertices=642");
    for (Precision precision : {Precision::full, Precision::single})
        for (auto [radius, depth] : {std::array{0.3, 0.1}, std::array{0.3, 0.2}, std::array{0.1, 0.15}}) {
            if (INNERSPRING_SANITIZED && (precision == Precision::full || depth != 0.1)) continue;
            const Tool tool = scripted(sphere_tool(radius, {0, 0, 0}, 0.3), depth);
            const Pressed p = press(coarse, tool, {under_tools(0.3, 3)}, 420, precision);
            EXPECT_GT(p.under_load, 3);
            EXPECT_LT(p.jump, 0.05 * p.most);
            EXPECT_LT(p.share, 0.05);
            EXPECT_LT(p.moved, 2e-3);
            EXPECT_LE(p.side, 0.3 * radius);
            EXPECT_GT(p.finest, coarse.vertices() + 50);
            EXPECT_EQ(p.last, coarse.vertices());
        }
}

// A needle pushed deep carries the surface with it: homes far from the tool are what it touches.
TEST(ToolRefine, TheRuleFollowsTheSurfaceNotItsHome) {
    const Body coarse = make_sphere("icosphere:vertices=642");
    Tool needle = sphere_tool(0.03, {0, 0, 0}, 0.3);
    needle.path = {{0, {{0, 0, 1.2}}}, {1, {{0.02, 0, 0.7}}}};
    const Pressed p = press(coarse, needle, {under_tools(0.5, 5)}, INNERSPRING_SANITIZED ? 130 : 220,
                            INNERSPRING_SANITIZED ? Precision::single : Precision::full);
    EXPECT_LE(p.side, 0.5 * 0.03);
    EXPECT_LT(p.share, 0.05);
    EXPECT_GT(p.last, coarse.vertices() + 20);
}

// Whatever the mesh went through, contact finds what it finds with a workspace made anew, to the last bit:
// with trees that followed refinement and its undoing at many places, vertices that took other numbers, and
// tools that meet vertices and faces.
TEST(ToolRefine, AfterAnyChangesTheStepIsThatOfANewWorkspace) {
    SurfaceMesh small = make_shape("icosphere:vertices=162");
    for (Vector& x : small.positions) x *= 0.2;
    for (Precision precision : {Precision::full, Precision::single}) {
        Body body = make_sphere(INNERSPRING_SANITIZED ? "icosphere:vertices=642" : "icosphere:vertices=2562");
        Subdivision history(body.rest);
        StepOptions options;
        options.dt = 0.002, options.precision = precision;
        const Loads loads{
            Vector::Zero(),
            {},
            {},
            {sphere_tool(0.3, {0, 0, 1.25}, 0.3), sphere_tool(0.02, {1, 0, 0}, 0.3),
             plane_tool({0, 0, -0.97}, {0, 0.1, 1}, 0.3), mesh_tool(small, {{0, 1.17, 0}}, 0.3)}};
        Workspace workspace(body, options);
        State state = rest_state(body);
        for (int n = 0; n < 20; ++n) step(body, loads, state, workspace);
        Random random(5);
        int touched = 0;
        for (int change = 0; change < 24; ++change) {
            // At the tools and elsewhere; every third time all but one half goes back.
            const Vector places[] = {{0, 0, 1}, {1, 0, 0}, {0, 0, -1}, {0, 1, 0}, random_vector(random)};
            const Vector place = places[change % 5].normalized(), side = random_vector(random);
            workspace.adapt(body, change % 3 == 2
                                      ? coarsen(body, history, state,
                                                [&](const Vector& a, auto&&...) { return a.dot(side) > 0.2; })
                                      : refine(body, history, state, triangles_near(body.rest, place, 0.15)));
            State other = state;
            Workspace anew(body, options);
            for (int n = 0; n < 2; ++n) {
                step(body, loads, state, workspace);
                step(body, loads, other, anew);
            }
            ASSERT_EQ(state_hash(state), state_hash(other)) << change;
            for (std::size_t k = 0; k < loads.tools.size(); ++k) {
                ASSERT_EQ(workspace.contact().tools[k].force, anew.contact().tools[k].force) << change;
                touched += workspace.contact().tools[k].points > 0;
            }
            ASSERT_EQ(workspace.contact().looked_at, anew.contact().looked_at);
        }
        EXPECT_EQ(touched, 4 * 24);
    }
}

TEST(ToolRefine, EveryShapeIsFollowedAndBadRulesAreRefused) {
    const Body coarse = make_sphere("icosphere:vertices=642");
    SurfaceMesh small = make_shape("icosphere:vertices=162");
    for (Vector& x : small.positions) x *= 0.2;
    const Eigen::Quaterniond lying(Eigen::AngleAxisd(pi / 2, Vector::UnitX()));
    for (Tool tool : {capsule_tool(0.15, 0.4, {{}, lying}), mesh_tool(small, {})}) {
        tool.path = {{0, {{0, 0, 1.6}, tool.path[0].pose.rotation}},
                     {0.3, {{0, 0, 1.1}, tool.path[0].pose.rotation}},
                     {0.5, {{0, 0, 2}, tool.path[0].pose.rotation}}};
        const Pressed p = press(coarse, tool, {under_tools(0.4, 3)}, 110, Precision::full);
        EXPECT_GT(p.finest, coarse.vertices() + 50) << tool.name;
        EXPECT_LE(p.side, 0.4 * 0.2) << tool.name;
        EXPECT_EQ(p.last, coarse.vertices()) << tool.name;
    }
    const Pressed p =
        press(coarse, plane_tool({0, 0, 0.95}, {0, 0, -1}), {under_tools(0.3, 3)}, 5, Precision::full);
    EXPECT_EQ(p.changes, 0);
    EXPECT_THROW(Refiner(coarse, {under_tools(0, 1)}), InputError);
    EXPECT_THROW(Refiner(coarse, {under_tools(0.3, 0)}), InputError);
}

}  // namespace
}  // namespace innerspring
