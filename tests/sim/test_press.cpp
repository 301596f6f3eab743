#include <gtest/gtest.h>

#include "innerspring/sim/equilibrium.h"
#include "support/bodies.h"

// Laws 2, 4 and 5 of docs/physics.md: what forces on the surface do.
namespace innerspring {
namespace {

using namespace support;

State settled(const Body& body, const Loads& loads) {
    State state = rest_state(body);
    const EquilibriumReport report = solve_equilibrium(body, loads, state);
    EXPECT_TRUE(report.reached) << body.rest.name << " residual " << report.residual_n << " of "
                                << report.tolerance_n;
    return state;
}

Vector outward(const Body& body, Index vertex) {
    return body.rest.positions[vertex].normalized();
}

/// Volume lost [1] to the force F [N] on a vertex, spread over `radius` unless that is 0.
double volume_lost(const Body& body, Index vertex, double F, double radius) {
    const Vector f = -F * outward(body, vertex);
    const Force force = radius > 0 ? patch_force(body, vertex, radius, f) : point_force(vertex, f);
    return -relative_volume_change(body, settled(body, one_force(force)));
}

/// Law 2 with what the surface springs carry (law 5): 3 F / (4 pi R^2 (E + 3 E_s / R)). Here E = 10, R = 1
/// and F in units of E R^2.
double law(double F, double surface) {
    return 3 * F / (4 * pi * (1 + 3 * surface / 10));
}

TEST(Press, SchemeCLosesTheSameVolumeUnderAPatchWhateverTheMeshAndPlace) {
    for (const std::string& shape : spheres)
        for (double surface : {1.0, 0.1}) {  // 0.1 and 0.01 E R
            BodyRecipe recipe;
            recipe.surface = surface;
            const Body body = make_sphere(shape, recipe);
            for (Index vertex : {coarsest_vertex(body), densest_vertex(body)})
                for (double F : {1e-5, 1e-4, 1e-3})
                    EXPECT_NEAR(volume_lost(body, vertex, F * 10, 0.3) / law(F, surface), 1, 0.05)
                        << shape << " E_s " << surface << " vertex " << vertex << " F " << F;
        }
}

TEST(Press, SchemeCLosesTheSameVolumeUnderAPointWhereTheSurfaceIsWeak) {
    for (const std::string& shape : spheres) {
        BodyRecipe recipe;
        recipe.surface = 0.01;
        const Body body = make_sphere(shape, recipe);
        for (Index vertex : {coarsest_vertex(body), densest_vertex(body)})
            for (double F : {1e-5, 1e-4}) {
                EXPECT_NEAR(volume_lost(body, vertex, F * 10, 0) / law(F, 0), 1, 0.03)
                    << shape << " vertex " << vertex << " F " << F;
            }
    }
}

TEST(Press, APointIntoAStretchedSurfaceLosesMoreThanTheLinearLaw) {
    // A point force draws the net taut, which then pulls in the surroundings: between the law with surface
    // springs and a tenth more than the law without.
    for (const std::string& shape : spheres) {
        const Body body = make_sphere(shape);
        for (Index vertex : {coarsest_vertex(body), densest_vertex(body)})
            for (double F : {1e-5, 1e-3}) {
                const double lost = volume_lost(body, vertex, F * 10, 0);
                EXPECT_GT(lost, 0.99 * law(F, 1)) << shape << " vertex " << vertex << " F " << F;
                EXPECT_LT(lost, 1.15 * law(F, 0)) << shape << " vertex " << vertex << " F " << F;
            }
    }
}

TEST(Press, SchemesAAndBLoseByTheMeshDensity) {
    for (const std::string& shape : {spheres[1], spheres[2]})
        for (Scheme scheme : {Scheme::A, Scheme::B}) {
            BodyRecipe recipe;
            recipe.scheme = scheme;
            recipe.surface = 1e-3;  // 1e-4 E R: the vertex by itself
            const Body body = make_sphere(shape, recipe);
            const std::vector<double> A = vertex_areas(body.rest.positions, body.rest.triangles);
            const double F = 1e-4;
            double lost[2];
            int n = 0;
            for (Index vertex : {coarsest_vertex(body), densest_vertex(body)}) {
                const double expected = F * A[vertex] / body.K[0] / body.volume;  // u = F / K, dV = A_i u
                lost[n] = volume_lost(body, vertex, F, 0);
                EXPECT_NEAR(lost[n], expected, 0.05 * expected) << shape << to_string(scheme);
                ++n;
            }
            EXPECT_GT(lost[0], 2 * lost[1])
                << shape << to_string(scheme) << ": a coarse place must lose more than a dense one";
        }
}

double legendre(int n, double x) {
    double before = 1, now = x;
    for (int k = 1; k < n; ++k) {
        const double next = ((2 * k + 1) * x * now - k * before) / (k + 1);
        before = now;
        now = next;
    }
    return n == 0 ? 1 : now;
}

/// Normal load p(q) [Pa] on every vertex.
template <class Pressure>
Loads normal_load(const Body& body, Pressure pressure) {
    const std::vector<double> A = vertex_areas(body.rest.positions, body.rest.triangles);
    Loads loads = no_loads();
    for (Index i = 0; i < body.vertices(); ++i)
        loads.forces.push_back(point_force(i, pressure(outward(body, i)) * A[i] * outward(body, i)));
    return loads;
}

TEST(Press, TheInnerSpringsAreAWinklerFoundation) {
    BodyRecipe recipe;
    recipe.surface = 1e-6;
    const Body body = make_sphere("icosphere:vertices=2562", recipe);
    const double p = 1e-2, elastic[] = {0.789, 0.477, 0.353, 0.144};
    int row = 0;
    for (int n : {2, 3, 4, 10}) {
        const State state =
            settled(body, normal_load(body, [&](const Vector& d) { return p * legendre(n, d.z()); }));
        // Amplitude of P_n in the radial displacement, by least squares over the vertices; in units of p R /
        // E.
        double up = 0, down = 0;
        for (Index i = 0; i < body.vertices(); ++i) {
            const double P = legendre(n, outward(body, i).z());
            const Vector u = state.x[i] - body.rest.positions[i];
            up += P * u.dot(outward(body, i)) / (p / 10);
            down += P * P;
            ASSERT_NEAR(u.dot(outward(body, i)) / (p / 10), P, 0.01) << "n " << n << " vertex " << i;
            ASSERT_LT((u - u.dot(outward(body, i)) * outward(body, i)).norm() / (p / 10), 0.01);
        }
        EXPECT_NEAR(up / down, 1, 0.01) << n;
        // An incompressible elastic ball answers less, the more so the finer the load: the model does not
        // reproduce it.
        const double C_n = 3.0 * n * (2 * n + 1) / (2.0 * (n - 1) * (2 * n * n + 4 * n + 3));
        EXPECT_NEAR(C_n, elastic[row++], 5e-4) << n;
        EXPECT_GT(up / down - C_n, 0.2) << n;
    }
}

/// Mean radial displacement under an inner pressure p, in units of what law 5 says of it.
double against_thin_sphere_law(const char* shape) {
    BodyRecipe recipe;
    recipe.young = 0.01;
    recipe.surface = 1;
    const Body body = make_sphere(shape, recipe);
    const double p = 3e-3, nu = 1.0 / 3;
    const State state = settled(body, normal_load(body, [&](const Vector&) { return p; }));
    double u = 0;
    for (Index i = 0; i < body.vertices(); ++i) u += (state.x[i].norm() - 1) / double(body.vertices());
    return u * (recipe.young + 2 * recipe.surface / (1 - nu)) / p;
}

TEST(Press, SurfaceSpringsMakeAThinSphere) {
    EXPECT_NEAR(against_thin_sphere_law("icosphere:vertices=642"), 1, 0.01);
    EXPECT_NEAR(against_thin_sphere_law("icosphere:vertices=2562"), 1, 0.01);
    EXPECT_NEAR(against_thin_sphere_law("sphere:vertices=1000,irregularity=1"), 1, 0.05);
    // The law is the equilateral limit. Uneven triangles leave the net ways to give: it is softer, never
    // stiffer.
    const double uneven = against_thin_sphere_law("sphere:vertices=1000,irregularity=3,seed=1");
    EXPECT_GT(uneven, 1);
    EXPECT_LT(uneven, 1.15);
    const double very_uneven = against_thin_sphere_law("sphere:vertices=600,irregularity=5,seed=2");
    EXPECT_GT(very_uneven, uneven);
    EXPECT_LT(very_uneven, 1.4);
}

}  // namespace
}  // namespace innerspring
