#include "innerspring/mesh/refine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "innerspring/mesh/check.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/random.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/subdivision.h"
#include "mesh/manifold.h"

namespace innerspring {
namespace {

constexpr double pi = std::numbers::pi;

/// [rad]
double least_angle(const SurfaceMesh& mesh) {
    double least = pi;
    for (const Triangle& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) {
            const Vector a = mesh.positions[t[(k + 1) % 3]] - mesh.positions[t[k]],
                         b = mesh.positions[t[(k + 2) % 3]] - mesh.positions[t[k]];
            least = std::min(least, std::atan2(a.cross(b).norm(), a.dot(b)));
        }
    return least;
}

double area(const SurfaceMesh& mesh) {
    double sum = 0;
    for (double A : triangle_areas(mesh.positions, mesh.triangles)) sum += A;
    return sum;
}

std::vector<Index> random_triangles(const SurfaceMesh& mesh, Random& random, double share) {
    std::vector<Index> chosen;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (random.uniform(0, 1) < share) chosen.push_back(Index(t));
    return chosen;
}

// Law 8, conformity and the angle bound, over five levels, on scattered and on compact regions.
TEST(Refine, KeepsVolumeAreaAndAnglesOverFiveLevels) {
    Random random(3);
    for (const char* shape :
         {"sphere:vertices=120,irregularity=4", "torus:vertices=150", "organ:vertices=120"}) {
        const SurfaceMesh mesh = make_shape(shape);
        const double bound = std::atan(std::tan(least_angle(mesh)) / 3) - 1e-9;
        for (int levels = 1; levels <= 5; ++levels) {
            const std::vector<Index> chosen = levels % 2 == 1 ? random_triangles(mesh, random, 0.02)
                                                              : triangles_near(mesh, mesh.positions[7], 0.3);
            const RefinedMesh fine = refine(mesh, chosen, {levels});
            check_manifold(fine.mesh);
            EXPECT_NEAR(volume(fine.mesh), volume(mesh), 1e-12 * volume(mesh)) << shape << levels;
            EXPECT_NEAR(area(fine.mesh), area(mesh), 1e-12 * area(mesh)) << shape << levels;
            EXPECT_GE(least_angle(fine.mesh), bound) << shape << levels;
            EXPECT_GE(fine.mesh.triangles.size(),
                      mesh.triangles.size() + chosen.size() * (std::size_t(std::pow(4, levels)) - 1));
            for (std::size_t i = 0; i < mesh.positions.size(); ++i)
                ASSERT_EQ(fine.mesh.positions[i], mesh.positions[i]);
            ASSERT_EQ(fine.halves.size(), fine.mesh.positions.size() - fine.old_vertices);
            for (std::size_t n = 0; n < fine.halves.size(); ++n) {
                const auto [a, b] = fine.halves[n];
                ASSERT_LT(a, b);
                ASSERT_LT(b, fine.old_vertices + n);
                ASSERT_EQ(fine.mesh.positions[fine.old_vertices + n],
                          Vector(0.5 * (fine.mesh.positions[a] + fine.mesh.positions[b])));
            }
            EXPECT_EQ(fine.volume_change_m3, 0);
        }
    }
}

TEST(Refine, OneTriangleMakesFourAndThreeGreenPairs) {
    const SurfaceMesh mesh = make_shape("icosphere:vertices=42");
    const Index chosen[] = {5};
    const RefinedMesh fine = refine(mesh, chosen);
    EXPECT_EQ(fine.mesh.positions.size(), mesh.positions.size() + 3);
    EXPECT_EQ(fine.mesh.triangles.size(), mesh.triangles.size() + 3 + 3);
    std::set<std::pair<Index, Index>> sides, halves;
    for (int k = 0; k < 3; ++k) {
        const Index u = mesh.triangles[5][k], v = mesh.triangles[5][(k + 1) % 3];
        sides.insert({std::min(u, v), std::max(u, v)});
    }
    for (const Edge& e : fine.halves) halves.insert({e.a, e.b});
    EXPECT_EQ(sides, halves);
}

TEST(Refine, AllOfItIsFourTimesAsFineAndHasNoGreenTriangle) {
    const SurfaceMesh mesh = make_shape("icosphere:vertices=42");
    std::vector<Index> all(mesh.triangles.size());
    for (std::size_t t = 0; t < all.size(); ++t) all[t] = Index(t);
    const RefinedMesh fine = refine(mesh, all, {2});
    EXPECT_EQ(fine.mesh.triangles.size(), 16 * mesh.triangles.size());
    EXPECT_NEAR(least_angle(fine.mesh), least_angle(mesh), 1e-9);
}

// A triangle that became green is not cut again: its parent becomes red. So a second call over the border of
// the first leaves the same shapes as one call would.
TEST(Refine, GreenTrianglesAreUndoneNotCut) {
    SurfaceMesh mesh = make_shape("sphere:vertices=300,irregularity=2");
    const double bound = std::atan(std::tan(least_angle(mesh)) / 3) - 1e-9;
    const double V = volume(mesh);
    Subdivision history(mesh);
    Random random(11);
    for (int n = 0; n < 12; ++n) {
        const Vector place = mesh.positions[random.below(mesh.positions.size())];
        history.split(mesh, triangles_near(mesh, place, 0.05), 1);
        check_manifold(mesh);
        ASSERT_GE(least_angle(mesh), bound) << n;
    }
    EXPECT_NEAR(volume(mesh), V, 1e-12 * V);
}

TEST(Refine, SmoothPlacementStaysNearTheSphere) {
    const SurfaceMesh mesh = make_shape("icosphere:vertices=162");
    std::vector<Index> all(mesh.triangles.size());
    for (std::size_t t = 0; t < all.size(); ++t) all[t] = Index(t);
    const RefinedMesh flat = refine(mesh, all, {2}), smooth = refine(mesh, all, {2, Placement::pn});
    double flat_error = 0, smooth_error = 0;
    for (const Vector& p : flat.mesh.positions) flat_error = std::max(flat_error, std::abs(p.norm() - 1));
    for (const Vector& p : smooth.mesh.positions)
        smooth_error = std::max(smooth_error, std::abs(p.norm() - 1));
    // Were the normals exact the error would be of fourth order; those of the coarse mesh are off by a
    // little.
    EXPECT_LT(smooth_error, 0.15 * flat_error);
    const double ball = 4 * pi / 3;
    EXPECT_NEAR(smooth.volume_change_m3, volume(smooth.mesh) - volume(mesh), 1e-15);
    EXPECT_GT(smooth.volume_change_m3, 0);
    EXPECT_LT(std::abs(volume(smooth.mesh) - ball), 0.1 * std::abs(volume(mesh) - ball));
    check_manifold(smooth.mesh);
}

TEST(Refine, RegionsAreWhatTheySay) {
    const SurfaceMesh mesh = make_shape("icosphere:vertices=2562");
    const Topology topology = build_topology(mesh.positions.size(), mesh.triangles);
    EXPECT_EQ(triangles_in_ring(mesh, topology, 40, 0).size(), topology.vertex_triangles[40].size());
    std::set<Index> ring;
    for (Index i : innerspring::ring(topology, 40, 2))
        for (Index t : topology.vertex_triangles[i]) ring.insert(t);
    const auto in_ring = triangles_in_ring(mesh, topology, 40, 2);
    EXPECT_EQ(std::set<Index>(in_ring.begin(), in_ring.end()), ring);

    // Along a sphere an arc of r is a chord of 2 sin(r/2); fast marching finds it within a few percent.
    for (double r : {0.3, 0.8, 2.0}) {
        const auto along = triangles_along(mesh, topology, 40, r);
        std::set<Index> chosen(along.begin(), along.end());
        std::size_t wrong = 0;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            double nearest = pi;
            for (Index i : mesh.triangles[t])
                nearest =
                    std::min(nearest, 2 * std::asin((mesh.positions[i] - mesh.positions[40]).norm() / 2));
            if (nearest < 0.97 * r) wrong += !chosen.contains(Index(t));
            if (nearest > 1.01 * r) wrong += chosen.contains(Index(t));
        }
        EXPECT_EQ(wrong, 0u) << r;
    }
    // The straight distance to triangles, not to their corners: a tiny ball meets those around it only.
    const Vector inside = (mesh.positions[mesh.triangles[9][0]] + mesh.positions[mesh.triangles[9][1]] +
                           mesh.positions[mesh.triangles[9][2]]) /
                          3;
    EXPECT_EQ(triangles_near(mesh, inside, 1e-6), std::vector<Index>{9});
    EXPECT_TRUE(triangles_near(mesh, 3 * inside, 1.9).empty());
    EXPECT_FALSE(triangles_near(mesh, 3 * inside, 2.1).empty());
    const auto upper = triangles_where(mesh, [](const Vector& a, const Vector& b, const Vector& c) {
        return a.z() > 0 && b.z() > 0 && c.z() > 0;
    });
    for (Index t : upper)
        for (Index i : mesh.triangles[t]) ASSERT_GT(mesh.positions[i].z(), 0);
    EXPECT_GT(upper.size(), mesh.triangles.size() / 3);
}

TEST(Refine, RefusesWhatCannotBe) {
    SurfaceMesh mesh = make_shape("icosphere:vertices=42");
    const Index one[] = {0}, none[] = {Index(mesh.triangles.size())};
    EXPECT_THROW(refine(mesh, one, {0}), InputError);
    EXPECT_THROW(refine(mesh, one, {most_levels + 1}), InputError);
    EXPECT_THROW(refine(mesh, none), InputError);
    std::vector<Index> all(mesh.triangles.size(), 0);
    all.resize(1000, 0);
    EXPECT_THROW(refine(mesh, all, {10}), InputError);  // more triangles than there may be
    EXPECT_THROW(triangles_near(mesh, Vector::Zero(), -1), InputError);
    EXPECT_THROW(triangles_in_ring(mesh, build_topology(42, mesh.triangles), 42, 1), InputError);
    mesh.triangles.pop_back();
    EXPECT_THROW(refine(mesh, one), InputError);  // open
}

// Undoing everything gives the surface back; undoing at random leaves it closed and of the same volume.
TEST(Subdivision, WhatIsSplitCanBeTakenBack) {
    const SurfaceMesh coarse = make_shape("sphere:vertices=200,irregularity=3");
    SurfaceMesh mesh = coarse;
    Subdivision history(mesh);
    Random random(5);
    auto take_out = [&](const SurfaceChange& change) {
        std::vector<Index> retired;
        for (const auto& r : change.retired) retired.push_back(r.vertex);
        std::sort(retired.begin(), retired.end(), std::greater<>());
        for (Index to : retired) {
            const Index from = Index(mesh.positions.size() - 1);
            history.take_out(to, from);
            mesh.positions[to] = mesh.positions[from];
            mesh.positions.pop_back();
            for (Triangle& t : mesh.triangles) std::ranges::replace(t, from, to);
        }
    };
    for (int n = 0; n < 40; ++n) {
        if (n % 3 < 2) {
            const Vector place = mesh.positions[random.below(mesh.positions.size())];
            history.split(mesh, triangles_near(mesh, place, 0.02), 1 + n % 2);
        } else {
            const double level = random.uniform(-1, 1);
            take_out(history.unsplit(
                mesh, [&](const Vector& a, const Vector&, const Vector&) { return a.x() < level; }));
        }
        check_manifold(mesh);
        ASSERT_NEAR(volume(mesh), volume(coarse), 1e-12 * volume(coarse));
        ASSERT_NEAR(area(mesh), area(coarse), 1e-12 * area(coarse));
    }
    take_out(history.unsplit(mesh, [](const Vector&, const Vector&, const Vector&) { return false; }));
    EXPECT_EQ(history.families(), 0u);
    EXPECT_EQ(mesh.positions, coarse.positions);
    std::set<std::set<Index>> then, now;
    for (const Triangle& t : coarse.triangles) then.insert({t[0], t[1], t[2]});
    for (const Triangle& t : mesh.triangles) now.insert({t[0], t[1], t[2]});
    EXPECT_EQ(then, now);
    check_manifold(mesh);
}

}  // namespace
}  // namespace innerspring
