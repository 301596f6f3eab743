#include "innerspring/body/tune.h"

#include <gtest/gtest.h>

#include "innerspring/body/refine.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"

using namespace innerspring;

namespace {

Material material(double mass, double young, double surface = 1, double damping = 1) {
    Material m;
    m.mass = mass, m.young = young, m.surface = surface, m.damping = damping;
    return m;
}

BodyOptions scheme_only(Scheme scheme) {
    BodyOptions options;
    options.scheme = scheme;
    return options;
}

void expect_same(const Body& a, const Body& b, double relative) {
    ASSERT_EQ(a.vertices(), b.vertices());
    for (std::size_t i = 0; i < a.vertices(); ++i) {
        EXPECT_NEAR(a.m[i], b.m[i], relative * b.m[i]);
        EXPECT_NEAR(a.K[i], b.K[i], relative * b.K[i]);
        EXPECT_NEAR(a.c[i], b.c[i], relative * b.c[i]);
        for (std::size_t n = 0; n < a.spokes_of(i).size(); ++n)
            EXPECT_NEAR(a.spokes_of(i)[n].k, b.spokes_of(i)[n].k, relative * b.spokes_of(i)[n].k);
    }
    for (std::size_t e = 0; e < a.k.size(); ++e) EXPECT_NEAR(a.k[e], b.k[e], relative * b.k[e]);
    EXPECT_NEAR(a.stiffness_sum, b.stiffness_sum, relative * b.stiffness_sum);
}

}  // namespace

TEST(Tune, GivesTheBodyThatWouldHaveBeenBuilt) {
    const Material other = material(0.3, 77, 0.2, 0.4);
    for (const char* shape : {"sphere:vertices=300", "breast:vertices=300", "organ:vertices=400"})
        for (Scheme from : {Scheme::A, Scheme::B, Scheme::C})
            for (Scheme to : {Scheme::A, Scheme::B, Scheme::C}) {
                const SurfaceMesh mesh = make_shape(shape);
                Body body = build_body(mesh, {}, scheme_only(from));
                tune(body, other, to);
                expect_same(body, build_body(mesh, other, scheme_only(to)), 1e-12);
            }
}

TEST(Tune, ThereAndBackIsTheSameBodyAlsoRefined) {
    for (const char* shape : {"breast:vertices=300", "organ:vertices=400"}) {
        const Body coarse = build_body(make_shape(shape));
        const Body body = refined(coarse, triangles_near(coarse.rest, coarse.rest.positions[0], 0.5), 2);
        Body there = body;
        tune(there, material(2, 1e4, 3, 0), Scheme::A);
        EXPECT_EQ(there.m[0], there.m[1]);
        tune(there, body.material, body.scheme);
        expect_same(there, body, 1e-12);
    }
}

TEST(Tune, RefusesAndLeavesAlone) {
    Body body = build_body(make_shape("sphere:vertices=100"));
    const double K = body.K[0];
    EXPECT_THROW(tune(body, material(0.05, -1), Scheme::C), InputError);
    EXPECT_THROW(tune(body, material(NAN, 10), Scheme::A), InputError);
    EXPECT_EQ(body.K[0], K);
    EXPECT_EQ(body.scheme, Scheme::C);
}
