#include "innerspring/record/scene.h"
#include "innerspring/record/setup.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "innerspring/mesh/error.h"

using namespace innerspring;

namespace {

constexpr const char* full =
    R"(# Every key of a scene; what excludes each other is in two forces and two pins.
mesh = "meshes/a \"b\".obj"
unit = "mm"
normalize = false
weld = 1e-6

[material]
name = "liver"
mass_kg = 1.5
young_pa = 4000
surface_n_m = 12.25
damping_ratio = 0.7

[anisotropy]
kind = "fibres"
along_pa = 9000
across_pa = 3000.5
around = [0, 1, 2]
through = [0.1, 0.2, 0.3]
pitch_deg = 33

[body]
scheme = "b"
centre = [0.1, -2, 3e-3]
free = true

[simulation]
gravity_m_s2 = [0, 0, -9.81]
duration_s = 0.5
dt_s = 0.001
integrator = "implicit"
precision = "double"
threads = 0
max_substeps = 50
tolerance = 1e-10
max_iterations = 30
linearised = true
equilibrium = true
residual_n = 1e-7
every = 0

[[force]]
name = "thumb"
vertex = 12
inward = 0.01
radius = 0.4
start = 0.1
end = 0.3
ramp = 0.05

[[force]]
near = [1, 0, 0]
newton = [0, -0.5, 0]
profile = [[0, 0], [0.5, 1], [1, 0]]

[[pin]]
vertices = [3, 1, 2]
path = [[0, 0, 0, 0], [1, 0.1, 0, 0]]

[[pin]]
near = [0, -1, 0]
radius = 0.25

[[refine]]
at = 0.5
near = [0, 1, 0]
radius = 0.3
levels = 2

[[refine]]
edge_share = 0.25

[[refine]]
tool_share = 0.2
levels = 4

[[tool]]
name = "finger"
radius = 0.3
length = 0.5
axis = [0, 1, 1]
friction = 0.4
path = [[0, 0, 0, 2], [1, 0, 0, 1.5]]

[[tool]]
mesh = "torus:vertices=300"
scale = 0.25
path = [[0, 0, 0, 2, 1, 0, 0, 0], [1, 0, 0, 1.5, 0.5, 0.5, 0.5, 0.5]]

[[tool]]
normal = [0, 1, 0]
at = [0, -1, 0]
)";

std::string message_of(const std::string& text) {
    try {
        scene_from_text(text, "s.toml");
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

template <class Parse>
std::string message_of(Parse parse, std::string_view text) {
    try {
        parse(text);
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

bool same(double a, double b) {
    return std::memcmp(&a, &b, sizeof a) == 0;
}
bool same(const Vector& a, const Vector& b) {
    return same(a[0], b[0]) && same(a[1], b[1]) && same(a[2], b[2]);
}
template <class T>
bool same(const std::optional<T>& a, const std::optional<T>& b) {
    return a.has_value() == b.has_value() && (!a || same(*a, *b));
}
template <class T>
bool same(const std::vector<std::pair<double, T>>& a, const std::vector<std::pair<double, T>>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& p, const auto& q) {
        return same(p.first, q.first) && same(p.second, q.second);
    });
}

/// Every member, bit for bit.
void expect_same(const Scene& a, const Scene& b) {
    EXPECT_EQ(a.mesh, b.mesh);
    EXPECT_EQ(a.unit, b.unit);
    EXPECT_EQ(a.normalize, b.normalize);
    EXPECT_TRUE(same(a.weld, b.weld));
    EXPECT_EQ(a.material_name, b.material_name);
    EXPECT_TRUE(same(a.material.mass, b.material.mass));
    EXPECT_TRUE(same(a.material.density, b.material.density));
    EXPECT_TRUE(same(a.material.young, b.material.young));
    EXPECT_TRUE(same(a.material.surface, b.material.surface));
    EXPECT_TRUE(same(a.material.surface_ratio, b.material.surface_ratio));
    EXPECT_TRUE(same(a.material.damping, b.material.damping));
    const Anisotropy &d = a.material.anisotropy, &e = b.material.anisotropy;
    EXPECT_EQ(d.kind, e.kind);
    EXPECT_TRUE(same(d.along, e.along));
    EXPECT_TRUE(same(d.across, e.across));
    EXPECT_EQ(d.course, e.course);
    EXPECT_TRUE(same(d.direction, e.direction));
    EXPECT_TRUE(same(d.through, e.through));
    EXPECT_TRUE(same(d.pitch_deg, e.pitch_deg));
    EXPECT_EQ(d.file, e.file);
    EXPECT_TRUE(same(d.moduli, e.moduli));
    for (int k = 0; k < 2; ++k) EXPECT_TRUE(same(Vector(d.axes.col(k)), Vector(e.axes.col(k))));
    EXPECT_EQ(a.scheme, b.scheme);
    EXPECT_EQ(a.centre.kind, b.centre.kind);
    EXPECT_TRUE(same(a.centre.position, b.centre.position));
    EXPECT_EQ(a.free, b.free);
    EXPECT_TRUE(same(a.gravity, b.gravity));
    EXPECT_TRUE(same(a.duration, b.duration));
    EXPECT_TRUE(same(a.step.dt, b.step.dt));
    EXPECT_EQ(a.step.integrator, b.step.integrator);
    EXPECT_EQ(a.step.precision, b.step.precision);
    EXPECT_EQ(a.step.threads, b.step.threads);
    EXPECT_EQ(a.step.max_substeps, b.step.max_substeps);
    EXPECT_TRUE(same(a.step.tolerance, b.step.tolerance));
    EXPECT_EQ(a.step.max_iterations, b.step.max_iterations);
    EXPECT_EQ(a.step.linearised, b.step.linearised);
    EXPECT_EQ(a.equilibrium, b.equilibrium);
    EXPECT_TRUE(same(a.residual_n, b.residual_n));
    EXPECT_EQ(a.every, b.every);
    ASSERT_EQ(a.forces.size(), b.forces.size());
    for (std::size_t n = 0; n < a.forces.size(); ++n) {
        const SceneForce &f = a.forces[n], &g = b.forces[n];
        EXPECT_EQ(f.name, g.name);
        EXPECT_EQ(f.vertex, g.vertex);
        EXPECT_TRUE(same(f.near, g.near));
        EXPECT_TRUE(same(f.newton, g.newton));
        EXPECT_TRUE(same(f.inward, g.inward));
        EXPECT_TRUE(same(f.radius, g.radius));
        EXPECT_TRUE(same(f.start, g.start));
        EXPECT_TRUE(same(f.end, g.end));
        EXPECT_TRUE(same(f.ramp, g.ramp));
        EXPECT_TRUE(same(f.profile, g.profile));
    }
    ASSERT_EQ(a.pins.size(), b.pins.size());
    for (std::size_t n = 0; n < a.pins.size(); ++n) {
        EXPECT_EQ(a.pins[n].vertices, b.pins[n].vertices);
        EXPECT_TRUE(same(a.pins[n].near, b.pins[n].near));
        EXPECT_TRUE(same(a.pins[n].radius, b.pins[n].radius));
        EXPECT_TRUE(same(a.pins[n].path, b.pins[n].path));
    }
    ASSERT_EQ(a.refine.size(), b.refine.size());
    for (std::size_t n = 0; n < a.refine.size(); ++n) {
        EXPECT_TRUE(same(a.refine[n].at, b.refine[n].at));
        EXPECT_EQ(a.refine[n].vertex, b.refine[n].vertex);
        EXPECT_TRUE(same(a.refine[n].near, b.refine[n].near));
        EXPECT_TRUE(same(a.refine[n].radius, b.refine[n].radius));
        EXPECT_TRUE(same(a.refine[n].edge_share, b.refine[n].edge_share));
        EXPECT_TRUE(same(a.refine[n].tool_share, b.refine[n].tool_share));
        EXPECT_EQ(a.refine[n].levels, b.refine[n].levels);
    }
    ASSERT_EQ(a.tools.size(), b.tools.size());
    for (std::size_t n = 0; n < a.tools.size(); ++n) {
        const SceneTool &t = a.tools[n], &u = b.tools[n];
        EXPECT_EQ(t.name, u.name);
        EXPECT_TRUE(same(t.radius, u.radius));
        EXPECT_TRUE(same(t.length, u.length));
        EXPECT_EQ(t.mesh, u.mesh);
        EXPECT_TRUE(same(t.scale, u.scale));
        EXPECT_TRUE(same(t.normal, u.normal));
        EXPECT_TRUE(same(t.axis, u.axis));
        EXPECT_TRUE(same(t.friction, u.friction));
        EXPECT_TRUE(same(t.at, u.at));
        EXPECT_EQ(t.path, u.path);
    }
}

}  // namespace

TEST(Scene, EveryKeyIsRead) {
    const Scene s = scene_from_text(full, "s.toml");
    EXPECT_EQ(s.mesh, "meshes/a \"b\".obj");
    EXPECT_EQ(s.unit, "mm");
    EXPECT_EQ(s.normalize, false);
    EXPECT_EQ(s.weld, 1e-6);
    EXPECT_EQ(s.material_name, "liver");
    EXPECT_EQ(s.material.mass, 1.5);
    EXPECT_FALSE(s.material.density);
    EXPECT_EQ(s.material.young, 4000);
    EXPECT_EQ(s.material.surface, 12.25);
    EXPECT_FALSE(s.material.surface_ratio);
    EXPECT_EQ(s.material.damping, 0.7);
    EXPECT_EQ(s.scheme, Scheme::B);
    EXPECT_EQ(s.centre.kind, CentreKind::given);
    EXPECT_EQ(s.centre.position, Vector(0.1, -2, 3e-3));
    EXPECT_TRUE(s.free);
    EXPECT_EQ(s.gravity, Vector(0, 0, -9.81));
    EXPECT_EQ(s.duration, 0.5);
    EXPECT_EQ(s.step.dt, 0.001);
    EXPECT_EQ(s.step.integrator, Integrator::implicit);
    EXPECT_EQ(s.step.precision, Precision::full);
    EXPECT_EQ(s.step.threads, 0);
    EXPECT_EQ(s.step.max_substeps, 50);
    EXPECT_EQ(s.step.tolerance, 1e-10);
    EXPECT_EQ(s.step.max_iterations, 30);
    EXPECT_TRUE(s.step.linearised);
    EXPECT_TRUE(s.equilibrium);
    EXPECT_EQ(s.residual_n, 1e-7);
    EXPECT_EQ(s.every, 0);
    ASSERT_EQ(s.forces.size(), 2u);
    EXPECT_EQ(s.forces[0].name, "thumb");
    EXPECT_EQ(s.forces[0].vertex, 12);
    EXPECT_EQ(s.forces[0].inward, 0.01);
    EXPECT_EQ(s.forces[0].radius, 0.4);
    EXPECT_EQ(s.forces[0].start, 0.1);
    EXPECT_EQ(s.forces[0].end, 0.3);
    EXPECT_EQ(s.forces[0].ramp, 0.05);
    EXPECT_FALSE(s.forces[0].near || s.forces[0].newton);
    EXPECT_EQ(s.forces[1].near, Vector(1, 0, 0));
    EXPECT_EQ(s.forces[1].newton, Vector(0, -0.5, 0));
    EXPECT_EQ(s.forces[1].profile, (std::vector<std::pair<double, double>>{{0, 0}, {0.5, 1}, {1, 0}}));
    ASSERT_EQ(s.pins.size(), 2u);
    EXPECT_EQ(s.pins[0].vertices, (std::vector<std::int64_t>{3, 1, 2}));
    ASSERT_EQ(s.pins[0].path.size(), 2u);
    EXPECT_EQ(s.pins[0].path[1].first, 1);
    EXPECT_EQ(s.pins[0].path[1].second, Vector(0.1, 0, 0));
    EXPECT_EQ(s.pins[1].near, Vector(0, -1, 0));
    EXPECT_EQ(s.pins[1].radius, 0.25);
}

TEST(Scene, EmptyTextGivesTheDefaults) {
    const Scene defaults;
    expect_same(scene_from_text("", "s.toml"), defaults);
    expect_same(scene_from_text("[material]\n[body]\n[simulation]\n", "s.toml"), defaults);
    expect_same(scene_from_text("\xEF\xBB\xBFmesh = 'sphere'\r\n", "s.toml"), defaults);
}

TEST(Scene, ATissueIsLoadedFirstAndOverridden) {
    const Material liver = tissue_material("liver");
    const Scene plain = scene_from_text("[material]\nname = 'liver'\n", "s.toml");
    EXPECT_EQ(plain.material.young, liver.young);
    EXPECT_EQ(plain.material.density, liver.density);
    EXPECT_EQ(plain.material.surface_ratio, liver.surface_ratio);
    const Scene s =
        scene_from_text("[material]\ndensity_kg_m3 = 1000\nname = 'liver'\nsurface_ratio = 0\n", "s.toml");
    EXPECT_EQ(s.material.young, liver.young);
    EXPECT_EQ(s.material.density, 1000);
    EXPECT_EQ(s.material.surface_ratio, 0);
}

TEST(Scene, CentreByName) {
    EXPECT_EQ(scene_from_text("body.centre = 'local'", "s").centre.kind, CentreKind::local);
    EXPECT_EQ(scene_from_text("body = {centre = 'kernel'}", "s").centre.kind, CentreKind::kernel);
}

TEST(Scene, RoundTripKeepsEveryBit) {
    const Scene once = scene_from_text(full, "s.toml");
    const std::string text = to_toml(once);
    expect_same(scene_from_text(text, "again"), once);
    EXPECT_EQ(to_toml(scene_from_text(text, "again")), text);
    expect_same(scene_from_text(to_toml(Scene{}), "default"), Scene{});
}

TEST(Scene, RoundTripOfHardNumbersAndStrings) {
    using limits = std::numeric_limits<double>;
    std::mt19937_64 random(7);
    const auto bits = [&] {  // any finite double
        for (;;) {
            const std::uint64_t word = random();
            double value;
            std::memcpy(&value, &word, sizeof value);
            if (std::isfinite(value)) return value;
        }
    };
    for (int n = 0; n < 500; ++n) {
        Scene s;
        s.mesh = std::string(
            "quote\" back\\ tab\t newline\n bell\a rubout\x7f \xC3\xA4 \xE2\x82\xAC \xF0\x9F\xA6\x8A '''");
        s.material_name = "spleen";
        s.material = tissue_material("spleen");
        s.gravity = Vector(bits(), -0.0, limits::denorm_min());
        s.weld = std::abs(bits());
        s.residual_n = limits::max();
        s.material.young = limits::min();
        s.duration = 1;
        s.step.dt = 1.0 / 3;
        s.centre = {CentreKind::given, Vector(bits(), 1e15, 1e17)};
        s.forces.emplace_back();
        s.forces[0].vertex = 4294967294;
        s.forces[0].newton = Vector(bits(), bits(), 100);
        s.forces[0].end = 1e300;
        s.forces.emplace_back();
        s.forces[1].near = Vector(bits(), 1e22, -1e-22);
        s.forces[1].inward = bits();
        s.forces[1].profile = {{-1.5, bits()}, {-0.0, bits()}, {5e-324, bits()}};
        s.pins.emplace_back();
        s.pins[0].near = Vector(bits(), 0.1, 0.30000000000000004);
        s.pins[0].radius = 2.2250738585072011e-308;
        s.pins[0].path = {{0, Vector(bits(), bits(), bits())}};
        expect_same(scene_from_text(to_toml(s), "again"), s);
    }
}

TEST(Scene, WhatIsWrittenIsFloatsAndWhatIsUnsetIsLeftOut) {
    Scene scene;
    scene.step.tolerance = 1e-8;
    const std::string text = to_toml(scene);
    EXPECT_NE(text.find("young_pa = 10.0\n"), std::string::npos) << text;
    EXPECT_NE(text.find("tolerance = 1e-08\n"), std::string::npos) << text;
    for (const char* absent : {"unit", "normalize", "density", "ratio = 0.1", "[[force]]", "[[pin]]"})
        EXPECT_EQ(text.find(absent), std::string::npos) << absent;
}

TEST(Scene, BytesThatAreNotUnicodeAreReplacedInWriting) {
    for (const char* bad :
         {"\xFF", "\xC3", "\xC0\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xE0\x80\x80", "\x80"}) {
        Scene s;
        s.mesh = std::string("a") + bad + "b";
        const std::string again = scene_from_text(to_toml(s), "again").mesh;
        EXPECT_EQ(again.find("a\xEF\xBF\xBD"), 0u) << again;
        EXPECT_EQ(again.back(), 'b');
    }
}

TEST(Scene, ErrorsNameLineKeyAndRemedy) {
    const struct {
        const char *text, *message;
    } cases[] = {
        {"\n[material]\nyoung = 3", "s.toml:3: unknown key 'young' in [material]; did you mean 'young_pa'?"},
        {"mesg = 'a'", "s.toml:1: unknown key 'mesg'; did you mean 'mesh'?"},
        {"mesh = 'a'\nzz = 1\n", "s.toml:2: unknown key 'zz'; known are mesh, unit,"},
        {"zz = 1\naa = 1\n", "s.toml:1: unknown key 'zz'"},
        {"young_pa = 1", "s.toml:1: unknown key 'young_pa'; it belongs into [material]"},
        {"[body]\nmesh = 'a'", "s.toml:2: unknown key 'mesh' in [body]; it belongs above the first [table]"},
        {"[simulation.deep]\na = 1", "s.toml:1: unknown key 'deep' in [simulation]"},
        {"\"new\\nline\" = 1", "s.toml:1: unknown key 'new?line'"},
        {"mesh = 3", "s.toml:1: mesh must be a string, not a whole number"},
        {"mesh = ''", "s.toml:1: mesh must name a file"},
        {"mesh = \"a\\u0000b\"", "s.toml:1: mesh must name a file"},
        {"unit = 'inch'", "s.toml:1: unit is 'inch'; it must be \"mm\", \"cm\" or \"m\""},
        {"unit = ''", "s.toml:1: unit is ''"},
        {"normalize = 'yes'", "s.toml:1: normalize must be true or false, not a string"},
        {"normalize = 1", "s.toml:1: normalize must be true or false, not a whole number"},
        {"weld = -1e-3", "s.toml:1: weld is -0.001; it must not be negative"},
        {"weld = 1979-05-27", "s.toml:1: weld must be a number, not a date or time"},
        {"material = 3", "s.toml:1: material must be a table, [material], once"},
        {"[[material]]\nyoung_pa = 1", "s.toml:1: material must be a table, [material], once"},
        {"[material]\nname = 'livr'", "s.toml:2: unknown material 'livr'; did you mean 'liver'?"},
        {"[material]\nname = 'unobtainium'",
         "s.toml:2: unknown material 'unobtainium'; known are paper, liver"},
        {"[material]\nname = 5", "s.toml:2: name in [material] must be a string"},
        {"[material]\nmass_kg = 1\ndensity_kg_m3 = 1",
         "s.toml:2: mass_kg in [material] and density_kg_m3 exclude each other"},
        {"[material]\nsurface_ratio = 1\nsurface_n_m = 1",
         "s.toml:3: surface_n_m in [material] and surface_ratio exclude"},
        {"[material]\nmass_kg = 0", "s.toml:2: mass_kg in [material] is 0; it must be positive"},
        {"[material]\ndensity_kg_m3 = -1",
         "s.toml:2: density_kg_m3 in [material] is -1; it must be positive"},
        {"[material]\nyoung_pa = '3'", "s.toml:2: young_pa in [material] must be a number, not a string"},
        {"[material]\nyoung_pa = nan", "s.toml:2: young_pa in [material] is nan; it must be a finite number"},
        {"[material]\nyoung_pa = inf", "s.toml:2: young_pa in [material] is inf; it must be a finite number"},
        {"[material]\nsurface_n_m = -1",
         "s.toml:2: surface_n_m in [material] is -1; it must not be negative"},
        {"[material]\nsurface_ratio = -1",
         "s.toml:2: surface_ratio in [material] is -1; it must not be negative"},
        {"[material]\ndamping_ratio = -1",
         "s.toml:2: damping_ratio in [material] is -1; it must not be negative"},
        {"[body]\nscheme = 'D'", "s.toml:2: scheme 'D': expected A, B or C"},
        {"[body]\ncentre = 'middle'", "s.toml:2: centre 'middle': expected auto, centroid, kernel, local"},
        {"[body]\ncentre = [1, 2]", "s.toml:2: centre in [body] must be [x, y, z], three finite numbers"},
        {"[body]\ncentre = [1, 2, inf]",
         "s.toml:2: centre in [body] must be [x, y, z], three finite numbers"},
        {"[body]\ncentre = 4", "s.toml:2: centre in [body] must be a string, not a whole number"},
        {"[body]\nfree = 0", "s.toml:2: free in [body] must be true or false"},
        {"[simulation]\ngravity_m_s2 = -9.81", "s.toml:2: gravity_m_s2 in [simulation] must be [x, y, z]"},
        {"[simulation]\ngravity_m_s2 = [0, '-9.81', 0]",
         "s.toml:2: gravity_m_s2 in [simulation] must be [x, y, z]"},
        {"[simulation]\nduration_s = -1",
         "s.toml:2: duration_s in [simulation] is -1; it must not be negative"},
        {"[simulation]\ndt_s = 0", "s.toml:2: dt_s in [simulation] is 0; it must be positive"},
        {"[simulation]\ndt_s = 1e-300",
         "s.toml:2: dt_s in [simulation] asks for 2e+300 steps; at most 1e+09 are allowed"},
        {"[simulation]\nduration_s = 1e10", "s.toml:2: duration_s in [simulation] asks for 1e+12 steps"},
        {"[simulation]\nduration_s = 1e300\ndt_s = 1e-300",
         "s.toml:3: dt_s in [simulation] asks for inf steps"},
        {"[simulation]\nintegrator = 'euler'", "s.toml:2: "},
        {"[simulation]\nthreads = 1025",
         "s.toml:2: threads in [simulation] is 1025; it must be from 0 to 1024"},
        {"[simulation]\nthreads = -1", "s.toml:2: threads in [simulation] is -1; it must be from 0 to 1024"},
        {"[simulation]\nthreads = 2.0",
         "s.toml:2: threads in [simulation] must be a whole number, not a number"},
        {"[simulation]\nmax_substeps = 0",
         "s.toml:2: max_substeps in [simulation] is 0; it must be from 1 to 2147483647"},
        {"[simulation]\nmax_iterations = 9223372036854775807",
         "s.toml:2: max_iterations in [simulation] is 922337"},
        {"[simulation]\ntolerance = 0", "s.toml:2: tolerance in [simulation] is 0; it must be positive"},
        {"[simulation]\nequilibrium = 'no'", "s.toml:2: equilibrium in [simulation] must be true or false"},
        {"[simulation]\nresidual_n = -1",
         "s.toml:2: residual_n in [simulation] is -1; it must not be negative"},
        {"[simulation]\nevery = -1", "s.toml:2: every in [simulation] is -1; it must be from 0 to"},
        {"[force]\nvertex = 1\ninward = 1", "s.toml:1: force must be a list of tables; write [[force]]"},
        {"force = [1]", "s.toml:1: force must be a list of tables; write [[force]]"},
        {"\n[[force]]\ninward = 1", "s.toml:2: [[force]] needs exactly one of vertex and near"},
        {"[[force]]\nvertex = 1\nnear = [0,0,0]\ninward = 1",
         "s.toml:1: [[force]] needs exactly one of vertex and near"},
        {"[[force]]\nvertex = 1", "s.toml:1: [[force]] needs exactly one of newton and inward"},
        {"[[force]]\nvertex = 1\ninward = 1\nnewton = [0,0,0]",
         "s.toml:1: [[force]] needs exactly one of newton and inward"},
        {"[[force]]\nvertx = 1\ninward = 1",
         "s.toml:2: unknown key 'vertx' in [[force]]; did you mean 'vertex'?"},
        {"[[force]]\nvertex = -1\ninward = 1",
         "s.toml:2: vertex in [[force]] is -1; it must be from 0 to 4294967294"},
        {"[[force]]\nvertex = 1.0\ninward = 1", "s.toml:2: vertex in [[force]] must be a whole number"},
        {"[[force]]\nvertex = 1\ninward = inf",
         "s.toml:3: inward in [[force]] is inf; it must be a finite number"},
        {"[[force]]\nvertex = 1\nnewton = 1",
         "s.toml:3: newton in [[force]] must be [x, y, z], three finite numbers"},
        {"[[force]]\nvertex = 1\ninward = 1\nradius = -1",
         "s.toml:4: radius in [[force]] is -1; it must not be negative"},
        {"[[force]]\nvertex = 1\ninward = 1\nramp = -1",
         "s.toml:4: ramp in [[force]] is -1; it must not be negative"},
        {"[[force]]\nvertex = 1\ninward = 1\nstart = nan", "s.toml:4: start in [[force]] is nan"},
        {"[[force]]\nvertex = 1\ninward = 1\nstart = 2\nend = 1",
         "s.toml:5: end in [[force]] is 1; it must come after start, 2"},
        {"[[force]]\nvertex = 1\ninward = 1\nname = 1", "s.toml:4: name in [[force]] must be a string"},
        {"[[force]]\nvertex = 1\ninward = 1\nprofile = [[0,1]]\nramp = 1",
         "s.toml:5: ramp in [[force]] and profile exclude"},
        {"[[force]]\nvertex = 1\ninward = 1\nprofile = []",
         "s.toml:4: profile in [[force]] must be a list of [time_s, factor]"},
        {"[[force]]\nvertex = 1\ninward = 1\nprofile = [[0,1],\n[1]]",
         "s.toml:5: profile in [[force]] must be [time_s, factor]"},
        {"[[force]]\nvertex = 1\ninward = 1\nprofile = [[0,1],\n[0,1]]",
         "s.toml:5: profile in [[force]]: its times must increase"},
        {"[[force]]\nvertex = 1\ninward = 1\nprofile = 1",
         "s.toml:4: profile in [[force]] must be a list of"},
        {"[[pin]]\nradius = 1", "s.toml:1: [[pin]] needs exactly one of vertices and near"},
        {"[[pin]]\nvertices = [1]\nnear = [0,0,0]",
         "s.toml:1: [[pin]] needs exactly one of vertices and near"},
        {"[[pin]]\nvertices = [1]\nradius = 1",
         "s.toml:3: radius in [[pin]] goes with near, not with vertices"},
        {"[[pin]]\nnear = [0,0,0]\nradius = -1",
         "s.toml:3: radius in [[pin]] is -1; it must not be negative"},
        {"[[pin]]\nvertices = []", "s.toml:2: vertices in [[pin]] must be a list of vertex indices"},
        {"[[pin]]\nvertices = 3", "s.toml:2: vertices in [[pin]] must be a list of vertex indices"},
        {"[[pin]]\nvertices = [1,\n-2]", "s.toml:3: vertices in [[pin]] is -2; it must be from 0 to"},
        {"[[pin]]\nvertices = [1.5]", "s.toml:2: vertices in [[pin]] must be a whole number"},
        {"[[pin]]\nvertices = [1]\npath = [[0,0,0]]",
         "s.toml:3: path in [[pin]] must be [time_s, dx, dy, dz]"},
        {"[[refine]]\nradius = 1", "s.toml:1: [[refine]] needs exactly one of at, edge_share and tool_share"},
        {"[[refine]]\nat = 1", "s.toml:1: [[refine]] with at needs exactly one of vertex and near"},
        {"[[refine]]\nedge_share = 0.2\nnear = [0,0,0]",
         "s.toml:3: near in [[refine]] goes with at; edge_share follows the forces, tool_share the tools"},
        {"[[refine]]\nedge_share = 0", "s.toml:2: edge_share in [[refine]] is 0; it must be positive"},
        {"[[refine]]\nedge_share = 0.2\nlevels = 11",
         "s.toml:3: levels in [[refine]] is 11; it must be from 1 to 10"},
        {"[[pin]]\nvertices = [1]\npath = [[1,0,0,0],[0,0,0,0]]",
         "s.toml:3: path in [[pin]]: its times must increase; 0 s does not"},
        {"mesh =", "s.toml:1: "},
        {"mesh = 'a'\n\nmesh = 'b'", "s.toml:3: "},
        {"[body]\n[body]", "s.toml:2: "},
        {"mesh = \"\xFF\"", "s.toml:1: "},
        {"weld = 1e999", "s.toml:1: "},
        {"\n  [%body]\nfree = true", "s.toml:2: a table without a name; write [name] or [[name]]"},
        {"[[[force]]]", "s.toml:1: a table without a name"},
        {"[[ =", "s.toml:1: a table without a name"},
        {"[]\n", "s.toml:1: "},
        {"[[ ]]\n", "s.toml:1: "},
        {"[", "s.toml:1: "},
        {"weld = 1\xC3\xA4", "s.toml:1: "},
        {"# \xC3\xA4\n\xC3\xA4 = 1", "s.toml:2: "},
        {"mesh = \"\"\"a\\\xC3\xA4\"\"\"", "s.toml:1: "},
        {"weld = 01\"\xC3\xA4\"", "s.toml:1: "},
        {"a.b.c = 1", "s.toml:1: two dots in one key"},
        {"pin = [{near.x = 1}]", "s.toml:1: a dot in a key between braces"},
        {"x = [[[[[[[[[[[[[[[[[[", "s.toml:1: brackets nest deeper"},
    };
    for (const auto& c : cases) {
        const std::string message = message_of(c.text);
        EXPECT_EQ(message.find(c.message), 0u) << c.text << "\n  gave: " << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_GT(message.size(), std::strlen("s.toml:1: ")) << message;
    }
}

TEST(Scene, NulByteIsRefused) {
    EXPECT_EQ(message_of(std::string("mesh = 'a\0b'", 12)).find("s.toml:1: "), 0u);
    EXPECT_EQ(message_of(std::string("\0", 1)).find("s.toml:1: "), 0u);
}

TEST(Scene, DotsAndBracketsInStringsAndCommentsAreFree) {
    const std::string text =
        "# a.b.c [[[[[[[[[[[[[[[[[[[[\n"
        "mesh = '../../../[[[[[[[[[[[[[[[[[[\"a.b.c' # a.b.c\n"
        "material.name = \"\"\"paper\\\n   \"\"\"\n"
        "[[force]]\nname = '''a.b.c''\n[[[[[[[[[[[[[[[[[['''\nvertex = 1\ninward = 1.5\n"
        "[[force]]\nname = \"\\\".a.b.c\"\nvertex = 1\ninward = 1.5\n";
    EXPECT_EQ(message_of(text), "accepted");
    EXPECT_EQ(scene_from_text("mesh = \"\"\"\xC3\xA4\\\n  a\xC3\xA4\"\"\" # \xC3\xA4", "s").mesh,
              "\xC3\xA4"
              "a\xC3\xA4");
    EXPECT_EQ(scene_from_text("mesh = \"\"\"a\\\n  \xC3\xA4 \\  \n\xC3\xA4\"\"\"", "s").mesh,
              "a\xC3\xA4 \xC3\xA4");
    EXPECT_EQ(message_of("mesh = '''a\n\n.'''\nb.c.d = 1").find("s.toml:4: two dots"), 0u);
}

TEST(Scene, HugeAndDeepInputsAreRefused) {
    const std::size_t million = 1 << 20;
    EXPECT_NE(message_of(std::string(million + 1, ' ')).find("larger than 1 MiB"), std::string::npos);
    EXPECT_EQ(message_of(std::string(million, ' ')), "accepted");
    std::string dotted = "a";
    while (dotted.size() + 4 < million) dotted += ".a";
    for (const std::string& text : {"x = " + std::string(million - 4, '['), std::string(million, '{'),
                                    dotted + "=1", "[" + dotted + "]"})
        EXPECT_EQ(message_of(text).find("s.toml:1: "), 0u);
    std::string tables = "x = ";
    while (tables.size() + 5 < million) tables += "{a = ";
    EXPECT_EQ(message_of(tables).find("s.toml:1: "), 0u);
}

TEST(Scene, RandomDamageIsReadOrRefused) {
    std::mt19937 random(20240601);
    const std::string original = full;
    const std::string pieces = "[]{}=.,\"'#\n\\ 019-+eE_tfnia\x00\x7f\xc3\xff";
    int accepted = 0;
    for (int n = 0; n < 5000; ++n) {
        std::string text = original;
        for (int damage = 1 + int(random() % 4); damage > 0 && !text.empty(); --damage) {
            const std::size_t at = random() % text.size();
            switch (random() % 5) {
                case 0:
                    text[at] = pieces[random() % pieces.size()];
                    break;
                case 1:
                    text[at] = char(random() % 256);
                    break;
                case 2:
                    text.erase(at, 1 + random() % 20);
                    break;
                case 3:
                    text.insert(at, text.substr(random() % text.size(), random() % 40));
                    break;
                case 4:
                    text.insert(at, 1, pieces[random() % pieces.size()]);
                    break;
            }
        }
        try {
            const Scene scene = scene_from_text(text, "s.toml");
            ++accepted;
            expect_same(scene_from_text(to_toml(scene), "again"), scene);
        } catch (const InputError& error) {
            EXPECT_EQ(std::string(error.what()).find("s.toml:"), 0u) << error.what();
        }
        if (HasFailure()) FAIL() << text;
    }
    EXPECT_GT(accepted, 50);
    EXPECT_LT(accepted, 4000);
}

TEST(SceneFile, MeshIsFoundBesideTheScene) {
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "innerspring_scene";
    std::filesystem::create_directories(folder);
    const auto write = [&](std::string_view text) {
        std::ofstream(folder / "s.toml", std::ios::binary) << text;
        return folder / "s.toml";
    };
    EXPECT_EQ(read_scene(write("mesh = 'a/b.obj'")).mesh, (folder / "a/b.obj").string());
    EXPECT_EQ(read_scene(write("mesh = '/a/b.obj'")).mesh, "/a/b.obj");
    EXPECT_EQ(read_scene(write("mesh = 'torus:ratio=3'")).mesh, "torus:ratio=3");
    EXPECT_EQ(read_scene(write("")).mesh, "sphere");
    try {
        read_scene(write("\nmesg = 'a'"));
        FAIL();
    } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()),
                  (folder / "s.toml").string() + ":2: unknown key 'mesg'; did you mean 'mesh'?");
    }
    EXPECT_THROW(read_scene(write(std::string((1 << 20) + 1, ' '))), InputError);
    EXPECT_THROW(read_scene(folder / "absent.toml"), InputError);
    EXPECT_THROW(read_scene(folder), InputError);
    std::filesystem::remove_all(folder);
}

TEST(SceneOption, ForceAndPin) {
    const SceneForce f = parse_force("vertex = 12, inward = 0.01, radius = 0.4");
    EXPECT_EQ(f.vertex, 12);
    EXPECT_EQ(f.inward, 0.01);
    EXPECT_EQ(f.radius, 0.4);
    EXPECT_EQ(parse_force(" { near = [0, 1, 2], newton = [0, 0, 1] }\n").near, Vector(0, 1, 2));
    EXPECT_EQ(parse_force("vertex=0,inward=1,profile=[[0,0],[1,1]]").profile.size(), 2u);
    EXPECT_EQ(parse_pin("vertices = [1, 2]").vertices, (std::vector<std::int64_t>{1, 2}));
    EXPECT_EQ(parse_pin("{near = [0, 0, 0], radius = 2}").radius, 2);
}

TEST(SceneOption, Errors) {
    EXPECT_EQ(message_of(parse_force, "vertx = 1, inward = 1"),
              "--force: unknown key 'vertx'; did you mean 'vertex'?");
    EXPECT_EQ(message_of(parse_force, "mesh = 1").find("--force: unknown key 'mesh'; known are name, vertex"),
              0u);
    EXPECT_EQ(message_of(parse_force, ""), "--force: needs exactly one of vertex and near");
    EXPECT_EQ(message_of(parse_force, "vertex = 1, inward = 1, radius = -1"),
              "--force: radius is -1; it must not be negative");
    EXPECT_EQ(message_of(parse_force, "vertex = 1, inward = 1}\ny = {"), "--force: a '}' too many");
    EXPECT_EQ(message_of(parse_pin, "near = [1, 2]"), "--pin: near must be [x, y, z], three finite numbers");
    for (const char* text :
         {"{", "}", "{}}", "vertex = 1,", "vertex", "1", "# vertex = 1", "a.b.c = 1", "\"", "x = \xFF"}) {
        EXPECT_EQ(message_of(parse_force, text).find("--force: "), 0u) << text;
        EXPECT_EQ(message_of(parse_pin, text).find("--pin: "), 0u) << text;
    }
}

TEST(Scene, HapticsAreReadWrittenAndRefused) {
    const Scene scene = scene_from_text(
        "[haptic]\ndevice = 'replay:a.csv'\nrate_hz = 2000\nbody_rate_hz = 100\nworkspace_scale = 3\n"
        "force_scale = 5.5\ncoupling_n_m = 400\ncontroller = false\n",
        "s.toml");
    for (const Scene& s : {scene, scene_from_text(to_toml(scene), "again")}) {
        EXPECT_EQ(s.haptic.device, "replay:a.csv");
        EXPECT_EQ(s.haptic.rate, 2000);
        EXPECT_EQ(s.haptic.body_rate, 100);
        EXPECT_EQ(s.haptic.metres, 3);
        EXPECT_EQ(s.haptic.newtons, 5.5);
        EXPECT_EQ(s.haptic.stiffness, 400);
        EXPECT_FALSE(s.haptic.controller);
    }
    EXPECT_NE(message_of("[haptic]\ndevice = 'fork'\n").find("s.toml:2: device"), std::string::npos);
    EXPECT_NE(message_of("[haptic]\n\nrate_hz = 9000\n").find("s.toml:3: rate_hz"), std::string::npos);
    EXPECT_NE(message_of("[haptic]\nbody_rate_hz = 1\n").find("10 to 4000"), std::string::npos);
    EXPECT_NE(message_of("[haptic]\nforce_scal = 1\n").find("force_scale"), std::string::npos);
}

TEST(Scene, ToolsAreReadAndMade) {
    const Scene s = scene_from_text(full, "s.toml");
    ASSERT_EQ(s.tools.size(), 3u);
    const Tool capsule = to_tool(s.tools[0]), ring = to_tool(s.tools[1]), floor = to_tool(s.tools[2]);
    EXPECT_EQ(capsule.shape, ToolShape::capsule);
    EXPECT_EQ(capsule.friction, 0.4);
    // Half way in time half way along, and its axis turned from z to (0, 1, 1).
    const Pose half = pose_at(capsule, 0.5);
    EXPECT_EQ(half.position, Vector(0, 0, 1.75));
    EXPECT_LT((half.rotation * Vector(0, 0, 1) - Vector(0, 1, 1).normalized()).norm(), 1e-12);
    // The ring ends turned by 120 degrees about (1, 1, 1).
    ASSERT_EQ(ring.shape, ToolShape::mesh);
    EXPECT_LT((pose_at(ring, 2).rotation * Vector(1, 0, 0) - Vector(0, 1, 0)).norm(), 1e-12);
    // Below the floor is inside it.
    const Pose at = pose_at(floor, 0);
    EXPECT_NEAR(nearest(floor, at.rotation.conjugate() * (Vector(3, -1.25, 2) - at.position)).distance, -0.25,
                1e-12);
}

TEST(Scene, ToolsThatCannotBeAreRefused) {
    for (const char* text :
         {"radius = 1", "at = [0, 0, 0]", "radius = 1, normal = [0, 1, 0], at = [0, 0, 0]",
          "radius = 0, at = [0, 0, 0]", "radius = 1, length = -1, at = [0, 0, 0]",
          "normal = [0, 0, 0], at = [0, 0, 0]", "normal = [0, 1, 0], length = 1, at = [0, 0, 0]",
          "radius = 1, friction = -0.1, at = [0, 0, 0]", "radius = 1, at = [0, 0, 0], path = [[0, 0, 0, 0]]",
          "radius = 1, path = [[0, 0, 0]]", "radius = 1, path = [[1, 0, 0, 0], [1, 0, 0, 0]]",
          "radius = 1, path = [[0, 0, 0, 0, 0, 0, 0, 0]]", "radius = 1, path = []",
          "mesh = '', at = [0, 0, 0]", "radius = 1, scale = 2, at = [0, 0, 0]"})
        EXPECT_THROW(parse_tool(text), InputError) << text;
    EXPECT_EQ(parse_tool("radius = 0.2, at = [0, 0, 1]").radius, 0.2);
}

TEST(Scene, AnisotropyIsReadWrittenAndRefused) {
    const Anisotropy a = scene_from_text(full, "s.toml").material.anisotropy;
    EXPECT_EQ(a.kind, Anisotropy::Kind::fibres);
    EXPECT_EQ(a.course, Anisotropy::Course::around);
    EXPECT_EQ(a.along, 9000);
    EXPECT_EQ(a.pitch_deg, 33);
    for (const char* text :
         {"kind = \"radial\"", "radial", " radial ", "kind = \"isotropic\"",
          "kind = \"fibres\", along_pa = 3, direction = [0, 1, 7e-3]",
          "kind = \"fibres\", along_pa = 3, outward = [0, 1, 0.1]",
          "kind = \"fibres\", along_pa = 3, field = \"a b.csv\"",
          "kind = \"orthotropic\", moduli_pa = [1, 2, 3.3], axes = [[3, 1, 0], [-1, 3, 0]]",
          "kind = \"orthotropic\", moduli_pa = [1, 2, 3], axes = [[1e200, 0, 0], [0, 1e200, 0]]",
          "kind = \"orthotropic\", moduli_pa = [1, 2, 3], axes = [[1e-200, 0, 0], [0, 1e-200, 0]]",
          "kind = \"orthotropic\", moduli_pa = [1, 2, 3]"}) {
        Scene scene;
        scene.material.anisotropy = parse_directions(text);
        expect_same(scene, scene_from_text(to_toml(scene), "again"));
    }
    for (const char* text :
         {"", "wooden", "fibres", "kind = \"wooden\"", "along_pa = 3", "kind = \"fibres\"",
          "kind = \"fibres\", along_pa = 3", "kind = \"fibres\", along_pa = 0, direction = [0, 0, 1]",
          "kind = \"fibres\", along_pa = 3, direction = [0, 0, 0]",
          "kind = \"fibres\", along_pa = 3, direction = [0, 0, 1], outward = [0, 0, 0]",
          "kind = \"fibres\", along_pa = 3, direction = [0, 0, 1], pitch_deg = 3",
          "kind = \"fibres\", along_pa = 3, field = \"\"", "kind = \"radial\", along_pa = 3",
          "kind = \"orthotropic\"", "kind = \"orthotropic\", moduli_pa = [1, -2, 3]",
          "kind = \"orthotropic\", moduli_pa = [1, 2, 3], axes = [[1, 0, 0], [1, 1, 0]]",
          "kind = \"orthotropic\", moduli_pa = [1, 2, 3], axes = [[0, 0, 0], [0, 1, 0]]",
          "kind = \"orthotropic\", moduli_pa = [1, 2, 3], axes = [[1, 0, 0]]",
          "kind = \"orthotropic\", moduli_pa = [1, 2, 3], direction = [1, 0, 0]"})
        EXPECT_THROW(parse_directions(text), InputError) << text;
}
