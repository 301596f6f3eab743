#include "innerspring/body/material.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>

#include "innerspring/mesh/error.h"

using namespace innerspring;

namespace {

template <class Call>
std::string message_of(Call call) {
    try {
        call();
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

constexpr double unit_ball = 4 * std::numbers::pi / 3;

}  // namespace

TEST(Tissues, ArePlausibleAndSourced) {
    EXPECT_GE(tissues().size(), 10u);
    std::set<std::string_view> names;
    for (const Tissue& t : tissues()) {
        EXPECT_TRUE(names.insert(t.name).second) << t.name << " twice";
        EXPECT_FALSE(t.name.empty() || t.name == "paper");
        EXPECT_GT(t.young, 10) << t.name;
        EXPECT_LT(t.young, 1e6) << t.name;
        EXPECT_GT(t.density, 850) << t.name;
        EXPECT_LT(t.density, 1200) << t.name;
        EXPECT_NE(t.source.find(" et al. "), std::string_view::npos) << t.name;
        EXPECT_NE(t.source.find("; density: "), std::string_view::npos) << t.name;
        EXPECT_EQ(t.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz_"), std::string_view::npos) << t.name;
    }
}

TEST(Tissues, AreFoundByName) {
    for (const Tissue& t : tissues()) {
        const Material m = tissue_material(t.name);
        EXPECT_EQ(m.young, t.young);
        EXPECT_EQ(m.density, t.density);
        EXPECT_EQ(m.surface_ratio, 0.1);
        EXPECT_EQ(m.damping, Material{}.damping);
        const Material r = resolve(m, 1e-3);
        EXPECT_DOUBLE_EQ(r.mass, t.density * 1e-3);
        EXPECT_DOUBLE_EQ(r.surface, 0.1 * t.young * std::cbrt(1e-3 / unit_ball));
    }
}

TEST(Tissues, PaperGivesTheDefaults) {
    const Material m = tissue_material("paper");
    EXPECT_EQ(m.mass, 0.05);
    EXPECT_EQ(m.young, 10);
    EXPECT_EQ(m.surface, 1);
    EXPECT_EQ(m.damping, 1);
    EXPECT_FALSE(m.density || m.surface_ratio);
}

TEST(Tissues, UnknownNameSuggestsTheNearest) {
    EXPECT_EQ(message_of([] { tissue_material("livr"); }), "unknown material 'livr'; did you mean 'liver'?");
    EXPECT_EQ(message_of([] { tissue_material("brain_gray"); }),
              "unknown material 'brain_gray'; did you mean 'brain_grey'?");
    EXPECT_EQ(message_of([] { tissue_material("papr"); }), "unknown material 'papr'; did you mean 'paper'?");
    const std::string message = message_of([] { tissue_material("unobtainium"); });
    for (const Tissue& t : tissues()) EXPECT_NE(message.find(t.name), std::string::npos) << message;
    EXPECT_NE(message_of([] { tissue_material(""); }), "accepted");
}

TEST(Resolve, MakesMassAndSurfaceConcrete) {
    Material m;
    m.density = 1000;
    m.young = 50;
    m.surface_ratio = 0.2;
    const Material r = resolve(m, unit_ball);
    EXPECT_DOUBLE_EQ(r.mass, 1000 * unit_ball);
    EXPECT_DOUBLE_EQ(r.surface, 0.2 * 50 * 1);
    EXPECT_FALSE(r.density || r.surface_ratio);
    const Material same = resolve(Material{}, 5);
    EXPECT_EQ(same.mass, 0.05);
    EXPECT_EQ(same.surface, 1);
}

TEST(Resolve, AlmostAHalfIsAHalf) {
    Material m;
    for (const double nu : {0.499996, 0.4999999, 0.5 - 1e-15}) {
        m.poisson = nu;
        EXPECT_EQ(resolve(m, 1).poisson, 0.5) << nu;
    }
    m.poisson = 0.49999;
    EXPECT_EQ(resolve(m, 1).poisson, 0.49999);
}

TEST(Resolve, RefusesWhatIsNotPhysical) {
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    const auto refused = [](auto change) {
        Material m;
        change(m);
        return message_of([&] { resolve(m, 1.0); });
    };
    for (double bad : {-1.0, nan, inf}) {
        EXPECT_EQ(refused([&](Material& m) { m.mass = bad; }).find("mass is "), 0u) << bad;
        EXPECT_EQ(refused([&](Material& m) { m.density = bad; }).find("density is "), 0u) << bad;
        EXPECT_EQ(refused([&](Material& m) { m.young = bad; }).find("young"), 0u) << bad;
        EXPECT_EQ(refused([&](Material& m) { m.surface = bad; }).find("surface"), 0u) << bad;
        EXPECT_EQ(refused([&](Material& m) { m.surface_ratio = bad; }).find("surface ratio"), 0u) << bad;
        EXPECT_EQ(refused([&](Material& m) { m.damping = bad; }).find("damping"), 0u) << bad;
    }
    EXPECT_NE(refused([](Material& m) { m.mass = 0; }), "accepted");
    EXPECT_NE(refused([](Material& m) { m.young = 0; }), "accepted");
    EXPECT_EQ(refused([](Material& m) { m.surface = 0; }), "accepted");
    EXPECT_EQ(refused([](Material& m) { m.damping = 0; }), "accepted");
}
