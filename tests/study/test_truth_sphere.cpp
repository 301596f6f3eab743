// The series of the solid sphere, by what defines it: equilibrium inside, the traction outside.
#include <gtest/gtest.h>

#include <cmath>

#include "innerspring/study/truth_sphere.h"

namespace innerspring {
namespace {

using Matrix = Eigen::Matrix3d;

/// du_i/dx_j by central differences.
Matrix gradient(const SphereSolution& s, const Vector& x, double h) {
    Matrix G;
    for (int j = 0; j < 3; ++j)
        G.col(j) = (s.at(x + h * Vector::Unit(j)) - s.at(x - h * Vector::Unit(j))) / (2 * h);
    return G;
}

/// Stress over E.
Matrix stress(const SphereSolution& s, const Vector& x, double h) {
    const double nu = s.poisson, mu = 1 / (2 * (1 + nu)), lambda = nu / ((1 + nu) * (1 - 2 * nu));
    const Matrix G = gradient(s, x, h);
    return lambda * G.trace() * Matrix::Identity() + mu * (G + G.transpose());
}

const Vector axis = Vector(1, -2, 2) / 3;

SphereSolution mode(int n, double nu, double R = 1) {
    return {R, nu, axis, {sphere_mode(n, 1, 1, nu)}};
}

TEST(TruthSphere, ModesAreInEquilibrium) {
    for (const double nu : {-0.3, 0.0, 0.3, 0.45})
        for (const int n : {0, 2, 3, 4, 10}) {
            const SphereSolution s = mode(n, nu);
            for (const Vector& x : {Vector(0.3, 0.2, -0.4), Vector(-0.5, 0.1, 0.6), Vector(0.05, 0.7, 0.2)}) {
                const double h = 1e-3;
                Vector divergence = Vector::Zero();
                for (int j = 0; j < 3; ++j)
                    divergence +=
                        (stress(s, x + h * Vector::Unit(j), h) - stress(s, x - h * Vector::Unit(j), h))
                            .col(j) /
                        (2 * h);
                EXPECT_LT(divergence.norm(), 2e-4 * (1 + n * n)) << "n " << n << " nu " << nu;
            }
        }
}

TEST(TruthSphere, TheirTractionIsTheLoad) {
    const double h = 1e-4, R = 2;
    for (const double nu : {-0.3, 0.0, 0.3, 0.45})
        for (const int n : {0, 2, 3, 4, 10}) {
            const SphereSolution s = mode(n, nu, R);
            for (const Vector& x : {Vector(0.3, 0.2, -0.4), Vector(-0.5, 0.1, 0.6), Vector(0.05, 0.7, 0.2)}) {
                const Vector outward = x.normalized();
                // Differences must stay inside: extrapolated from two depths.
                const Vector t1 = stress(s, (R - 2 * h) * outward, h) * outward,
                             t2 = stress(s, (R - 4 * h) * outward, h) * outward;
                const Vector expected = std::legendre(unsigned(n), outward.dot(axis)) * outward;
                EXPECT_LT((2 * t1 - t2 - expected).norm(), 1e-4) << "n " << n << " nu " << nu;
            }
        }
}

TEST(TruthSphere, IncompressibleModesMeetTheClosedForm) {
    for (const int n : {2, 3, 4, 7, 10, 40}) {
        EXPECT_NEAR(mode(n, 0.5).at(axis).dot(axis), incompressible_mode(n), 1e-12);
        EXPECT_NEAR(gradient(mode(n, 0.5), Vector(0.3, 0.2, -0.4), 1e-4).trace(), 0, 1e-6);
    }
    EXPECT_EQ(mode(0, 0.5).at(axis).norm(), 0);
    // Even pressure p: u = p R (1 - 2 nu)/E.
    EXPECT_NEAR(mode(0, 0.2).at(axis).dot(axis), 0.6, 1e-12);
}

TEST(TruthSphere, SqueezeMeetsTheTable) {
    // Issue of the project: u_pole E R/F and u_equator E R/F at nu = 1/2, to the digits given.
    struct Line {
        double alpha, pole, equator;
    };
    for (const Line& line :
         {Line{0.1, 4.64, 0.207}, {0.2, 2.245, 0.2064}, {0.3, 1.445, 0.2053}, {0.5, 0.796, 0.2015}}) {
        const double R = 3, E = 20, F = 7;
        const SphereSolution s = squeezed_sphere(line.alpha, F, R, E, 0.5, axis);
        EXPECT_NEAR(-s.at(R * axis).dot(axis) * E * R / F, line.pole, 2e-3 * line.pole);
        const Vector side = R * axis.unitOrthogonal();
        EXPECT_NEAR(s.at(side).dot(side) / R * E * R / F, line.equator, 6e-4);
        EXPECT_NEAR((s.at(R * axis) + s.at(-R * axis)).norm(), 0, 1e-12);
    }
}

TEST(TruthSphere, SmallCapsAreBoussinesqsProblem) {
    // Even pressure on a small circle of a half space: u = 2 (1 - nu^2) p a/E at its middle (Timoshenko &
    // Goodier, article 139); the sphere's roundness changes it by the order of alpha.
    const double alpha = 0.05, nu = 0.25;
    const SphereSolution s = squeezed_sphere(alpha, 1, 1, 1, nu, axis);
    const double half_space = 2 * (1 - nu * nu) / (std::acos(-1.0) * std::sin(alpha));
    EXPECT_NEAR(-s.at(axis).dot(axis) / half_space, 1, 0.06);
}

}  // namespace
}  // namespace innerspring
