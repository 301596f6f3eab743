// The comparison itself: identities of its measures, the sphere's laws, and the chain with its files.
#include <gtest/gtest.h>

#include <cmath>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/study/truth_loads.h"
#include "study/small_study.h"
#include "study/tetgen_here.h"

#include "innerspring/study/truth.h"

namespace innerspring {
namespace {

using namespace support;
namespace fs = std::filesystem;

TruthSubject sphere(int vertices, double nu) {
    TruthSubject s = make_subject(make_shape("icosphere:vertices=" + std::to_string(vertices)), {},
                                  {CentreKind::given, Vector::Zero()}, nu);
    s.radius = s.mesh.positions[0].norm();
    s.axis = s.mesh.positions[0].normalized();
    return s;
}

const TruthModel& model(const std::vector<TruthModel>& models, std::string_view name) {
    for (const TruthModel& m : models)
        if (m.name == name) return m;
    throw std::runtime_error("no such model");
}

TEST(Truth, TheRightAnswerHasNoErrorAndTwiceItIsTwiceAsSoft) {
    const TruthSubject s = sphere(642, 0.5);
    const TruthLoad load = squeeze_load(s, 0.5);
    const std::vector<Vector> u = squeeze_answer(s, 0.5), f = nodal_forces(s, load);
    const TruthRow same = compare(s, load, f, u, u);
    EXPECT_EQ(same.l2_error, 0);
    EXPECT_EQ(same.peak_error, 0);
    EXPECT_EQ(same.swept_share, 0);
    EXPECT_NEAR(same.work_ratio, 1, 1e-15);
    EXPECT_EQ(*same.pole, *same.reference_pole);
    std::vector<Vector> twice = u;
    for (Vector& v : twice) v *= 2;
    const TruthRow soft = compare(s, load, f, u, twice);
    EXPECT_NEAR(soft.l2_error, 1, 1e-12);
    EXPECT_NEAR(soft.peak_error, 1, 1e-12);
    EXPECT_NEAR(soft.peak_ratio, 2, 1e-12);
    EXPECT_NEAR(soft.work_ratio, 2, 1e-12);
    // The series at nu = 1/2 keeps the volume: what is left is the polyhedron's and falls as h^2.
    const TruthSubject fine = sphere(2562, 0.5);
    const TruthLoad finer = squeeze_load(fine, 0.5);
    const std::vector<Vector> v = squeeze_answer(fine, 0.5);
    const TruthRow closer = compare(fine, finer, nodal_forces(fine, finer), v, v);
    EXPECT_LT(std::abs(closer.reference_volume_percent), std::abs(same.reference_volume_percent) / 3);
    EXPECT_LT(std::abs(closer.reference_volume_percent), 0.1);
    EXPECT_NEAR(*same.reference_pole, 0.796, 0.002);
    EXPECT_NEAR(*same.reference_equator, 0.2015, 0.002);
}

TEST(Truth, NodalForcesHaveTheLoadsForceAndTorque) {
    TruthSubject s = make_subject(make_shape("capsule:vertices=300"), {}, {}, 0.3);
    hold_base(s, Vector(0, -9.81, 0), 0.15);
    EXPECT_GE(s.held.size(), 3u);
    add_loads_of(s, Vector(0, -9.81, 0), 2, 0.5);
    ASSERT_EQ(s.loads.size(), 5u);
    for (const TruthLoad& load : s.loads) {
        const std::vector<Vector> f = nodal_forces(s, load);
        Vector force = Vector::Zero(), torque = Vector::Zero();
        for (const SurfaceForce& p : load.surface) {
            const Triangle& t = s.mesh.triangles[p.triangle];
            const Vector x = p.at[0] * s.mesh.positions[t[0]] + p.at[1] * s.mesh.positions[t[1]] +
                             p.at[2] * s.mesh.positions[t[2]];
            force += p.force, torque += x.cross(p.force);
        }
        double sum = 0;
        for (const SurfaceForce& p : load.surface) sum += p.force.norm();
        if (load.kind == TruthLoad::Kind::patch) {
            EXPECT_NEAR(sum, 1, 1e-12);
        } else {
            EXPECT_EQ(sum, 0);
        }
        for (std::size_t i = 0; i < f.size(); ++i) force -= f[i], torque -= s.mesh.positions[i].cross(f[i]);
        EXPECT_LT(force.norm(), 1e-12);
        EXPECT_LT(torque.norm(), 1e-12);
    }
}

TEST(Truth, SphereLoadsBalance) {
    const TruthSubject s = sphere(642, 0.5);
    for (const TruthLoad& load : {mode_load(s, 2), mode_load(s, 3), squeeze_load(s, 0.3)}) {
        Vector force = Vector::Zero();
        double along = 0;
        for (const SurfaceForce& p : load.surface) force += p.force, along += std::abs(p.force.dot(s.axis));
        EXPECT_LT(force.norm(), 2e-3 * along) << load.name;
        if (load.kind == TruthLoad::Kind::squeeze) {
            EXPECT_NEAR(along, 2 * load.force_n, 1e-9 * along);
        }
    }
}

TEST(Truth, BareSchemeCAnswersEveryModeAlike) {
    // Law 4: u = p R/E for every n, so work over the series' is 1/C_n at nu = 1/2. The polyhedron's
    // Eq. 3 and the linear interpolation of P_n leave an error of order h^2.
    const TruthSubject s = sphere(INNERSPRING_SANITIZED ? 642 : 2562, 0.5);
    const double tolerance = INNERSPRING_SANITIZED ? 0.06 : 0.015;
    const std::vector<TruthModel> models = truth_models();
    for (const int n : {2, 3, 4}) {
        TruthLoad load = mode_load(s, n);
        scale(load, 1e-3);
        std::vector<Vector> u = mode_answer(s, n);
        for (Vector& v : u) v *= 1e-3;
        const TruthRow row =
            compare(s, load, nodal_forces(s, load), u, model(models, "C bare").answer(s, load).u);
        EXPECT_NEAR(row.work_ratio * incompressible_mode(n), 1, tolerance) << n;
        EXPECT_NEAR(row.peak_ratio * incompressible_mode(n), 1, tolerance) << n;
    }
}

TEST(Truth, ElementsMeetTheSeries) {
    if (!tetgen_here()) GTEST_SKIP() << "tetgen is not installed";
    const TruthSubject s = sphere(INNERSPRING_SANITIZED ? 92 : 252, 0.3);
    const ElementReference elements(s);
    for (const int n : {2, 3}) {
        const TruthLoad load = mode_load(s, n);
        const TruthRow row =
            compare(s, load, nodal_forces(s, load), mode_answer(s, n), elements.answer(s, load));
        EXPECT_LT(row.l2_error, INNERSPRING_SANITIZED ? 0.12 : 0.05) << n;
        EXPECT_NEAR(row.work_ratio, 1, INNERSPRING_SANITIZED ? 0.06 : 0.03) << n;
    }
}

TruthRun small_truth(const fs::path& directory) {
    TruthRun run;
    run.options.patches = 1;
    run.options.series = false;
    run.options.patch_share = 0.6;
    run.options.element_poisson = 0.3;
    run.default_mesh = false;
    run.directory = directory;
    run.pictures = false;
    return run;
}

Scene small_ellipsoid() {
    Scene scene;
    scene.mesh = INNERSPRING_SANITIZED ? "ellipsoid:vertices=60" : "ellipsoid:vertices=150";
    return scene;
}

TEST(Truth, TheSameBytesOnOneAndTwoThreadsStoppedAndResumed) {
    if (!tetgen_here()) GTEST_SKIP() << "tetgen is not installed";
    const TemporaryFolder one("truth-one"), parts("truth-parts");
    TruthRun run = small_truth(one.path);
    run.threads = 1;
    run_truth(small_ellipsoid(), run);

    std::atomic<bool> stop{false};
    run.directory = parts.path;
    run.threads = 2;
    run.stop = &stop;
    run.progress = [&](const StudyProgress&) { stop = true; };
    EXPECT_TRUE(run_truth(small_ellipsoid(), run).stopped);
    EXPECT_FALSE(fs::exists(parts.path / "summary.json"));
    run.stop = nullptr, run.resume = true;
    std::size_t least = SIZE_MAX;
    run.progress = [&](const StudyProgress& p) { least = std::min(least, p.done); };
    run_truth(small_ellipsoid(), run);
    EXPECT_GT(least, 1u) << "the first load was solved again";
    for (const char* file : {"summary.json", "truth.csv"}) {
        EXPECT_FALSE(content(one.path / file).empty());
        EXPECT_EQ(content(one.path / file), content(parts.path / file)) << file;
    }
    run.options.element_poisson = 0.2;
    EXPECT_THROW(run_truth(small_ellipsoid(), run), InputError) << "another solid's answers";
}

TEST(Truth, SummaryHasARowForEveryLoadAndModel) {
    if (!tetgen_here()) GTEST_SKIP() << "tetgen is not installed";
    const TemporaryFolder folder("truth-rows");
    TruthRun run = small_truth(folder.path);
    run.pictures = true;
    const TruthResults results = run_truth(small_ellipsoid(), run);
    const nlohmann::json s = summary(folder.path);
    EXPECT_EQ(s["rows"].size(), 3 * truth_models().size());
    for (const auto& row : s["rows"])
        for (const char* key :
             {"force_group", "l2_error", "peak_error", "peak_ratio", "work_ratio", "volume_error_swept"})
            EXPECT_TRUE(row[key].is_number()) << key;
    EXPECT_EQ(s["subjects"][0]["poisson"], 0.3);
    EXPECT_GT(s["subjects"][0]["tetrahedra"], 100);
    const std::string html = content(folder.path / "report.html");
    EXPECT_NE(html.find("</html>"), std::string::npos);
    EXPECT_NE(html.find("data:image/png;base64,"), std::string::npos);
    EXPECT_EQ(results.pictures.size(), 2u);
}

TEST(Truth, FinerElementsAreAsManyAsAskedFor) {
    if (!tetgen_here()) GTEST_SKIP() << "tetgen is not installed";
    const TemporaryFolder folder("truth-finer");
    TruthRun run = small_truth(folder.path);
    run.options.tetrahedra = INNERSPRING_SANITIZED ? 600 : 1500;
    const TruthResults results = run_truth(small_ellipsoid(), run);
    EXPECT_GE(10 * results.subjects[0].tetrahedra, 8 * std::size_t(run.options.tetrahedra));
    EXPECT_LT(results.subjects[0].tetrahedra, 4 * std::size_t(run.options.tetrahedra));
}

TEST(Truth, WhatCannotBeComparedIsRefused) {
    const TemporaryFolder folder("truth-refused");
    TruthRun run = small_truth(folder.path / "out");
    run.options.element_poisson = 0.5;
    EXPECT_THROW(run_truth(small_ellipsoid(), run), InputError);
    run = small_truth(folder.path / "out");
    Scene weightless = small_ellipsoid();
    weightless.gravity = Vector::Zero();
    EXPECT_THROW(run_truth(weightless, run), InputError);
    Scene nothing;
    nothing.mesh = "no-such-file.obj";
    EXPECT_THROW(run_truth(nothing, run), InputError);
    EXPECT_FALSE(fs::exists(folder.path / "out"));
}

}  // namespace
}  // namespace innerspring
