// The elements, by the fields they must reproduce.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/random.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/study/elasticity.h"
#include "study/tetgen_here.h"

namespace innerspring {
namespace {

using Matrix = Eigen::Matrix3d;

/// A block cut into n.x n.y n.z bricks of six tetrahedra each; inner vertices moved about at random.
TetMesh block(const Vector& size, std::array<Index, 3> n, double shake = 0) {
    TetMesh mesh;
    Random random(7);
    const auto at = [&](Index i, Index j, Index k) { return (k * (n[1] + 1) + j) * (n[0] + 1) + i; };
    for (Index k = 0; k <= n[2]; ++k)
        for (Index j = 0; j <= n[1]; ++j)
            for (Index i = 0; i <= n[0]; ++i) {
                const bool inner = i > 0 && j > 0 && k > 0 && i < n[0] && j < n[1] && k < n[2];
                Vector x(double(i) / n[0], double(j) / n[1], double(k) / n[2]);
                for (int d = 0; d < 3; ++d)
                    if (inner) x[d] += shake * (random.uniform() - 0.5) / n[std::size_t(d)];
                mesh.positions.push_back(x.cwiseProduct(size));
            }
    // Kuhn's cut: every path along the three axes from one corner of a brick to the opposite one.
    constexpr std::array<std::array<int, 3>, 6> paths = {
        {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
    for (Index k = 0; k < n[2]; ++k)
        for (Index j = 0; j < n[1]; ++j)
            for (Index i = 0; i < n[0]; ++i)
                for (std::size_t p = 0; p < 6; ++p) {
                    std::array<Index, 3> c{i, j, k};
                    std::array<Index, 4> t{};
                    t[0] = at(c[0], c[1], c[2]);
                    for (std::size_t s = 0; s < 3; ++s) {
                        ++c[std::size_t(paths[p][s])];
                        t[s + 1] = at(c[0], c[1], c[2]);
                    }
                    if (p >= 3) std::swap(t[2], t[3]);
                    mesh.tetrahedra.push_back(t);
                }
    return mesh;
}

std::vector<bool> held_where(const QuadraticMesh& mesh, auto&& where) {
    std::vector<bool> held;
    for (const Vector& x : mesh.nodes) held.push_back(where(x));
    return held;
}

bool outside(const Vector& x, const Vector& size) {
    return (x.array() < 1e-12).any() || (x.array() > size.array() - 1e-12).any();
}

TEST(Elasticity, PatchTestLinearFieldsAreReproduced) {
    const Vector size(1, 1.5, 0.8);
    const QuadraticMesh mesh = quadratic(block(size, {3, 3, 3}, 0.5));
    Matrix G;
    G << 0.3, -0.1, 0.7, 0.2, 0.5, -0.4, 0.1, 0.6, -0.2;
    for (const double nu : {0.0, 0.3, 0.49}) {
        const ElasticSolid solid(mesh, {7, nu},
                                 held_where(mesh, [&](const Vector& x) { return outside(x, size); }));
        std::vector<Vector> field;
        for (const Vector& x : mesh.nodes) field.push_back(Vector(1, 2, 3) + G * x);
        const std::vector<Vector> u = solid.solve(std::vector<Vector>(field.size(), Vector::Zero()), field);
        for (std::size_t i = 0; i < u.size(); ++i) EXPECT_LT((u[i] - field[i]).norm(), 1e-10) << nu;
    }
}

TEST(Elasticity, EnergyOfALinearFieldIsExact) {
    const Vector size(1, 1.5, 0.8);
    const QuadraticMesh mesh = quadratic(block(size, {2, 2, 2}));
    const double E = 7, nu = 0.3, mu = E / (2 * (1 + nu)), lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
    Matrix G;
    G << 0.3, -0.1, 0.7, 0.2, 0.5, -0.4, 0.1, 0.6, -0.2;
    std::vector<Vector> u;
    for (const Vector& x : mesh.nodes) u.push_back(Vector(1, 2, 3) + G * x);
    const Matrix strain = (G + G.transpose()) / 2;
    const double density = lambda / 2 * strain.trace() * strain.trace() + mu * strain.squaredNorm();
    const ElasticSolid solid(mesh, {E, nu}, std::vector<bool>(u.size(), true));
    EXPECT_NEAR(solid.energy(u), density * size.prod(), 1e-12 * density);
}

TEST(Elasticity, PureBendingIsReproduced) {
    // u = k (x z, -nu y z, (-x^2 + nu (y^2 - z^2))/2): sigma_xx = E k z and nothing else (Timoshenko &
    // Goodier, article 88). Quadratic, so within the elements' space.
    const Vector size(2, 1, 1);
    const QuadraticMesh mesh = quadratic(block(size, {4, 2, 2}, 0.4));
    for (const double nu : {0.0, 0.3, 0.49}) {
        const auto bent = [&](const Vector& x) {
            return Vector(x.x() * x.z(), -nu * x.y() * x.z(),
                          (-x.x() * x.x() + nu * (x.y() * x.y() - x.z() * x.z())) / 2);
        };
        const ElasticSolid solid(mesh, {3, nu},
                                 held_where(mesh, [&](const Vector& x) { return outside(x, size); }));
        std::vector<Vector> field;
        for (const Vector& x : mesh.nodes) field.push_back(bent(x));
        const std::vector<Vector> u = solid.solve(std::vector<Vector>(field.size(), Vector::Zero()), field);
        for (std::size_t i = 0; i < u.size(); ++i) EXPECT_LT((u[i] - field[i]).norm(), 1e-8) << nu;
    }
}

/// A bar whose ends are pulled with traction t along x by forces on surface triangles.
TEST(Elasticity, AFloatingBarPulledAtItsEndsStretchesAndThins) {
    const Vector size(2, 1, 1);
    TetMesh tets = block(size, {4, 2, 2});
    const QuadraticMesh mesh = quadratic(tets);
    std::vector<Triangle> ends;
    std::vector<double> sign;
    for (const auto& t : tets.tetrahedra)
        for (const Triangle& face : {Triangle{t[0], t[1], t[2]}, Triangle{t[0], t[1], t[3]},
                                     Triangle{t[0], t[2], t[3]}, Triangle{t[1], t[2], t[3]}})
            for (const double x : {0.0, 2.0})
                if (std::abs(tets.positions[face[0]].x() - x) + std::abs(tets.positions[face[1]].x() - x) +
                        std::abs(tets.positions[face[2]].x() - x) <
                    1e-12)
                    ends.push_back(face), sign.push_back(x == 0 ? -1 : 1);
    ASSERT_EQ(ends.size(), 16u);
    const double traction = 0.6, E = 3, nu = 0.3;
    std::vector<SurfaceForce> forces;
    for (Index t = 0; t < ends.size(); ++t) {
        const double area = double_area_vector(tets.positions, ends[t]).norm() / 2;
        // Middles of the sides: exact to degree 2.
        for (const Vector& at : {Vector(0.5, 0.5, 0), Vector(0, 0.5, 0.5), Vector(0.5, 0, 0.5)})
            forces.push_back({t, at, sign[t] * traction * area / 3 * Vector::UnitX()});
    }
    std::vector<Vector> f(mesh.nodes.size(), Vector::Zero());
    add_surface_forces(mesh, ends, forces, f);
    const ElasticSolid solid(mesh, {E, nu}, std::vector<bool>(f.size(), false));
    std::vector<Vector> u = solid.solve(f);
    std::vector<Vector> expected;
    for (const Vector& x : mesh.nodes)
        expected.push_back(traction / E * Vector(x.x() - 1, -nu * (x.y() - 0.5), -nu * (x.z() - 0.5)));
    const std::vector<double> one(u.size(), 1.0);
    remove_rigid_motion(mesh.nodes, one, expected);
    for (std::size_t i = 0; i < u.size(); ++i) EXPECT_LT((u[i] - expected[i]).norm(), 1e-8);
    // A net force is taken out, not resisted.
    for (Vector& force : f) force += Vector(1, 2, 3);
    const std::vector<Vector> again = solid.solve(f);
    for (std::size_t i = 0; i < u.size(); ++i) EXPECT_LT((again[i] - u[i]).norm(), 1e-7);
}

TEST(Elasticity, AColumnUnderItsWeightSinksAsItMust) {
    // Nothing moves sideways at nu = 0: u_z = -(w/E)(H z - z^2/2).
    const Vector size(1, 1, 2);
    const QuadraticMesh mesh = quadratic(block(size, {2, 2, 4}, 0.4));
    const double w = 0.5, E = 4;
    const ElasticSolid solid(mesh, {E, 0}, held_where(mesh, [](const Vector& x) { return x.z() < 1e-12; }));
    std::vector<Vector> f(mesh.nodes.size(), Vector::Zero());
    add_body_force(mesh, Vector(0, 0, -w), f);
    Vector sum = Vector::Zero();
    for (const Vector& force : f) sum += force;
    EXPECT_NEAR(sum.z(), -w * size.prod(), 1e-12);
    const std::vector<Vector> u = solid.solve(f);
    for (std::size_t i = 0; i < u.size(); ++i) {
        const double z = mesh.nodes[i].z();
        EXPECT_LT((u[i] - Vector(0, 0, -w / E * (2 * z - z * z / 2))).norm(), 1e-8);
    }
}

TEST(Elasticity, RigidMotionIsTakenOutAndNothingElse) {
    std::vector<Vector> x{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}, {1, 1, 1}}, u(5, Vector::Zero());
    const std::vector<double> weight{1, 2, 3, 4, 5};
    for (std::size_t i = 0; i < 5; ++i) u[i] = Vector(1, 2, 3) + Vector(0.3, -0.2, 0.1).cross(x[i]);
    remove_rigid_motion(x, weight, u);
    for (const Vector& v : u) EXPECT_LT(v.norm(), 1e-13);
    for (std::size_t i = 0; i < 5; ++i) u[i] = Vector(double(i), 1, double(i * i));
    remove_rigid_motion(x, weight, u);
    const std::vector<Vector> once = u;
    remove_rigid_motion(x, weight, u);
    for (std::size_t i = 0; i < 5; ++i) EXPECT_LT((u[i] - once[i]).norm(), 1e-13);
}

TEST(Elasticity, WhatCannotBeSolvedIsRefused) {
    const QuadraticMesh mesh = quadratic(block(Vector::Ones(), {1, 1, 1}));
    const std::vector<bool> held(mesh.nodes.size(), false);
    EXPECT_THROW(ElasticSolid(mesh, {1, 0.5}, held), InputError);
    EXPECT_THROW(ElasticSolid(mesh, {0, 0.3}, held), InputError);
    EXPECT_THROW(ElasticSolid(mesh, {1, std::nan("")}, held), InputError);
    TetMesh flat = block(Vector::Ones(), {1, 1, 1});
    std::swap(flat.tetrahedra[3][0], flat.tetrahedra[3][1]);
    EXPECT_THROW(ElasticSolid(quadratic(flat), {1, 0.3}, held), InputError);
}

TEST(Tetrahedra, FillTheSurfaceAndKeepIt) {
    if (!tetgen_here()) GTEST_SKIP() << "tetgen is not installed";
    for (const char* shape : {"sphere:vertices=150", "torus:vertices=200", "plate:vertices=200"}) {
        const SurfaceMesh surface = make_shape(shape);
        const TetMesh mesh = fill_with_tetrahedra(surface);  // checks the faces itself
        double sum = 0;
        for (const auto& t : mesh.tetrahedra) {
            const auto& x = mesh.positions;
            const double V = (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).dot(x[t[3]] - x[t[0]]) / 6;
            EXPECT_GT(V, 0);
            sum += V;
        }
        EXPECT_NEAR(sum, volume(surface), 1e-12 * sum) << shape;
        for (std::size_t i = 0; i < surface.positions.size(); ++i)
            EXPECT_EQ(surface.positions[i], mesh.positions[i]);
    }
}

TEST(Tetrahedra, ASurfaceThroughItselfIsRefused) {
    if (!tetgen_here()) GTEST_SKIP() << "tetgen is not installed";
    SurfaceMesh two = make_shape("icosphere:vertices=42");
    const Index n = Index(two.positions.size());
    for (Index i = 0; i < n; ++i) two.positions.push_back(two.positions[i] + Vector(0.7, 0.1, 0.05));
    for (std::size_t t = 0, count = two.triangles.size(); t < count; ++t) {
        const Triangle old = two.triangles[t];
        two.triangles.push_back({old[0] + n, old[1] + n, old[2] + n});
    }
    EXPECT_THROW(fill_with_tetrahedra(two), std::runtime_error);
}

TEST(Tetrahedra, WithoutTheProgramOneLineSaysSo) {
    const char* path = std::getenv("PATH");
    const std::string kept = path ? path : "";
    setenv("PATH", "/nowhere", 1);
    std::string message;
    try {
        fill_with_tetrahedra(make_shape("icosphere:vertices=42"));
    } catch (const RunError& error) {
        message = error.what();
    }
    setenv("PATH", kept.c_str(), 1);
    EXPECT_NE(message.find("apt-get install tetgen"), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace innerspring
