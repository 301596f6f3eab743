#include "innerspring/body/anisotropy.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "innerspring/body/distribution.h"
#include "innerspring/body/refine.h"
#include "innerspring/body/tune.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/refine.h"
#include "support/anisotropies.h"

// Inner stiffness that depends on direction: K_i = sum_t V_t / L_i^2 D_i.
namespace innerspring {
namespace {

using namespace support;

Eigen::Matrix3d matrix(const Body& body, Index i) {
    Eigen::Matrix3d m;
    for (int k = 0; k < 3; ++k) {
        const Vector e = Vector::Unit(k);
        m.col(k) = body.K[i] * e;
        if (!body.N.empty()) m.col(k) += body.N[i] * e;
    }
    return m;
}

Body anisotropic_body(const Anisotropy& a, std::string_view shape = "breast:vertices=400",
                      Scheme scheme = Scheme::C, double poisson = 0.3) {
    BodyRecipe recipe;
    recipe.anisotropy = a, recipe.scheme = scheme, recipe.poisson = poisson;
    return make_body(shape, recipe);
}

TEST(Anisotropy, EqualModuliGiveEquationThreeToTheBit) {
    const Body plain = make_body("organ:vertices=600");
    Anisotropy equal = straight_fibres(10, 10, Vector(1, 2, 3));
    for (int n = 0; n < 2; ++n) {
        BodyRecipe recipe;
        recipe.anisotropy = equal;
        const Body body = make_body("organ:vertices=600", recipe);
        EXPECT_TRUE(body.N.empty());
        EXPECT_EQ(body.K, plain.K);
        EXPECT_EQ(body.c, plain.c);
        EXPECT_EQ(mean_modulus(body.material), 10);
        equal = orthotropic({10, 10, 10}, tilted_axes());
    }
}

// The formula itself, from the virtual tetrahedra, for each kind and scheme.
TEST(Anisotropy, TheMatrixIsTheSumOverVirtualTetrahedraTimesD) {
    for (const auto& [name, a] : anisotropies())
        for (Scheme scheme : {Scheme::A, Scheme::B, Scheme::C}) {
            const Body body = anisotropic_body(a, "breast:vertices=400", scheme);
            const Distribution d = distribute_about(body.rest, body.centre.position);
            const double mean = sum(d.K) / double(body.vertices());
            ASSERT_EQ(body.N.size(), body.vertices());
            for (Index i = 0; i < body.vertices(); ++i) {
                const Eigen::Matrix3d D = modulus_at(body, a, i);
                const Eigen::Matrix3d expected = (scheme == Scheme::C ? d.K[i] : mean) * D;
                ASSERT_LT((matrix(body, i) - expected).norm(), 1e-12 * expected.norm()) << name << ' ' << i;
                // Positive, with the same eigenvalues everywhere, and K_i their mean.
                const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(matrix(body, i));
                Vector share = eigen.eigenvalues() / body.K[i], D_share = moduli(body.material);
                D_share /= mean_modulus(body.material);
                std::sort(D_share.begin(), D_share.end());
                ASSERT_LT((share - D_share).norm(), 1e-12) << name;
                ASSERT_GT(share[0], 0);
                ASSERT_NEAR(share[2], stiffest_share(body.material), 1e-12);
                ASSERT_NEAR(matrix(body, i).trace(), 3 * body.K[i], 1e-12 * body.K[i]);
            }
        }
}

TEST(Anisotropy, FibresRunAsTheyAreTold) {
    Anisotropy around = straight_fibres(40, 10, Vector(0, 0, 2));
    around.course = Anisotropy::Course::around;
    around.through = Vector(0.1, -0.2, 5);
    for (double degrees : {0.0, 30.0, 90.0}) {
        around.pitch_deg = degrees;
        const Body body = anisotropic_body(around, "ellipsoid:vertices=300");
        for (Index i = 0; i < body.vertices(); ++i) {
            const Vector a = fibre_direction(body, i);
            Vector r = body.rest.positions[i] - around.through;
            r.z() = 0;
            ASSERT_NEAR(a.norm(), 1, 1e-14);
            ASSERT_NEAR(a.z(), std::sin(degrees * pi / 180), 1e-12);
            ASSERT_NEAR(a.dot(r), 0, 1e-12);
            ASSERT_GE(a.dot(Vector::UnitZ().cross(r)), -1e-12);
        }
    }
    Anisotropy outward = straight_fibres(40, 10, Vector(0, 0, 2));
    outward.course = Anisotropy::Course::outward, outward.through = Vector(0.2, 0, 0);
    const Body body = anisotropic_body(outward, "sphere:vertices=300");
    for (Index i = 0; i < body.vertices(); ++i)
        ASSERT_LT(fibre_direction(body, i).cross(body.rest.positions[i] - outward.through).norm(), 1e-12);
}

// About its exact centre a sphere's radial stiffness lies along the normal, about medial balls too.
TEST(Anisotropy, TheRadialDirectionIsTowardsTheCentre) {
    for (CentreKind kind : {CentreKind::given, CentreKind::local}) {
        BodyRecipe recipe;
        recipe.anisotropy.kind = Anisotropy::Kind::radial;
        recipe.centre = {kind, Vector::Zero()};
        const Body body = make_body("icosphere:vertices=642", recipe);
        for (Index i = 0; i < body.vertices(); ++i)
            ASSERT_LT((fibre_direction(body, i) + body.rest.positions[i]).norm(), 1e-6) << int(kind);
        const Vector D = moduli(body.material);
        EXPECT_EQ(D[0], 10);
        EXPECT_EQ(D[1], 5);  // E / 2 at nu = 0
    }
}

// A refined body is the body of the refined mesh, and taken back it is the one before.
TEST(Anisotropy, FollowsARefinement) {
    for (const auto& [name, a] : anisotropies())
        for (Scheme scheme : {Scheme::A, Scheme::B, Scheme::C}) {
            const Body body = anisotropic_body(a, "sphere:vertices=500", scheme);
            std::vector<Index> patch = triangles_near(body.rest, body.rest.positions[7], 0.4);
            Body fine = body;
            Subdivision history(fine.rest);
            restructure(fine, history, history.split(fine.rest, patch, 2));
            ASSERT_GT(fine.vertices(), body.vertices());
            ASSERT_EQ(fine.N.size(), fine.vertices());
            BodyOptions options;
            options.scheme = scheme;
            options.centre = {CentreKind::given, body.centre.position};
            const Body anew = build_body(fine.rest, body.material, options);
            for (Index i = 0; i < fine.vertices(); ++i)
                ASSERT_LT((matrix(fine, i) - matrix(anew, i)).norm(), 1e-12 * fine.K[i]) << name << ' ' << i;
            restructure(fine, history,
                        history.unsplit(fine.rest,
                                        [](const Vector&, const Vector&, const Vector&) { return false; }));
            ASSERT_EQ(fine.vertices(), body.vertices());
            for (Index i = 0; i < body.vertices(); ++i)
                ASSERT_LT((matrix(fine, i) - matrix(body, i)).norm(), 1e-12 * body.K[i]) << name << ' ' << i;
        }
}

TEST(Anisotropy, ABodyCanBeTunedToItAndBack) {
    const Body plain = make_body("breast:vertices=300");
    for (const auto& [name, a] : anisotropies()) {
        Body body = plain;
        Material material = plain.material;
        material.anisotropy = a;
        tune(body, material, Scheme::C);
        const Body anew = anisotropic_body(a, "breast:vertices=300", Scheme::C, 0);
        for (Index i = 0; i < body.vertices(); ++i)
            ASSERT_LT((matrix(body, i) - matrix(anew, i)).norm(), 1e-12 * anew.K[i]) << name;
        tune(body, plain.material, Scheme::C);
        EXPECT_TRUE(body.N.empty());
        EXPECT_EQ(body.K, plain.K);
    }
}

// E of a material and its moduli grow together, as a slider for E asks for.
TEST(Anisotropy, ModuliScaleWithE) {
    for (const auto& [name, a] : anisotropies()) {
        const Body body = anisotropic_body(a);
        Material twice = body.material;
        twice.young *= 2;
        scale_moduli(twice.anisotropy, 2);
        EXPECT_LT((moduli(twice) - 2 * moduli(body.material)).norm(), 1e-12) << name;
    }
}

TEST(Anisotropy, WhatIsNoMaterialIsRefused) {
    const auto refused = [](const Anisotropy& a, std::string_view part) {
        try {
            anisotropic_body(a, "sphere:vertices=200");
            ADD_FAILURE() << part;
        } catch (const InputError& error) {
            EXPECT_NE(std::string_view(error.what()).find(part), std::string_view::npos) << error.what();
        }
    };
    refused(straight_fibres(-1, 10, Vector::UnitX()), "-1 Pa");
    refused(straight_fibres(NAN, 10, Vector::UnitX()), "positive");
    refused(straight_fibres(10, 0, Vector::UnitX()), "positive");
    refused(straight_fibres(2e9, 10, Vector::UnitX()), "times apart");
    refused(orthotropic({1, 1e17, 1}, Eigen::Matrix3d::Identity()), "times apart");
    refused(straight_fibres(20, 10, Vector::Zero()), "direction");
    refused(straight_fibres(20, 10, Vector(NAN, 0, 1)), "direction");
    refused(orthotropic({1, 2, INFINITY}, Eigen::Matrix3d::Identity()), "positive");
    Eigen::Matrix3d skew = Eigen::Matrix3d::Identity();
    skew(0, 1) = 0.1;
    refused(orthotropic({1, 2, 3}, skew), "right angles");
    Anisotropy field = straight_fibres(20, 10, Vector::UnitX());
    field.course = Anisotropy::Course::field;
    refused(field, "missing");
    field.field = [](const Vector& q) { return q.x() > 0.5 ? Vector(0, 0, 0) : Vector(1, 0, 0); };
    refused(field, "no direction");
    // And a body that is tuned to it stays as it was.
    Body body = make_body("sphere:vertices=200");
    const std::vector<double> K = body.K;
    Material material = body.material;
    material.anisotropy = field;
    EXPECT_THROW(tune(body, material, Scheme::A), InputError);
    EXPECT_EQ(body.K, K);
    EXPECT_TRUE(body.N.empty());
}

}  // namespace
}  // namespace innerspring
