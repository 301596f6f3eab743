// The parts of a study, each by itself.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numeric>
#include <set>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/study/judge.h"
#include "study/small_study.h"
#include "support/bodies.h"

namespace innerspring {
namespace {

using namespace support;

TEST(StudyParts, ForcesAreLogSpacedWithTheDecadesAmongThem) {
    for (const int count : {4, 7, 8, 10, 13}) {
        const std::vector<double> groups = log_spaced_groups(count);
        ASSERT_EQ(groups.size(), std::size_t(count));
        for (std::size_t n = 1; n < groups.size(); ++n) EXPECT_LT(groups[n - 1], groups[n]);
        for (const double decade : {1e-4, 1e-3, 1e-2, 1e-1})
            EXPECT_EQ(std::count(groups.begin(), groups.end(), decade), 1) << count << ", " << decade;
    }
}

TEST(StudyParts, VerticesAreSpreadAndDoNotDependOnTheirOrder) {
    const SurfaceMesh mesh = make_shape("ellipsoid:vertices=300");
    std::vector<Index> all(mesh.positions.size());
    std::iota(all.begin(), all.end(), Index(0));
    const std::vector<Index> spread = spread_vertices(mesh, all, 8);
    EXPECT_EQ(std::set<Index>(spread.begin(), spread.end()).size(), 8u);
    const auto nearest = [&](const std::vector<Index>& some) {
        double least = INFINITY;
        for (const Index a : some)
            for (const Index b : some)
                if (a != b) least = std::min(least, (mesh.positions[a] - mesh.positions[b]).norm());
        return least;
    };
    EXPECT_GT(nearest(spread), 0.5);
    std::reverse(all.begin(), all.end());
    EXPECT_EQ(spread_vertices(mesh, all, 8), spread);
    EXPECT_EQ(spread_vertices(mesh, std::span(all).first(3), 8).size(), 3u);
}

TEST(StudyParts, DeviationsAreThePapers) {
    const std::vector<double> coarse = {0, 1, 2, 2}, refined = {0, 2, 1, 1};
    const Deviation d = deviation(coarse, refined);  // differences 0, -1, 1, 1
    EXPECT_DOUBLE_EQ(d.mean_m, 0.75);
    EXPECT_DOUBLE_EQ(d.std_m, std::sqrt(0.75 - 0.0625));
    EXPECT_DOUBLE_EQ(d.ratio, 0.5);
    EXPECT_DOUBLE_EQ(d.mean_relative, 0.375);
    const Deviation none = deviation(coarse, coarse);
    EXPECT_EQ(none.mean_m, 0);
    EXPECT_EQ(none.std_m, 0);
}

TEST(StudyParts, TheLoadsDisplacementIsWhatItWorksAgainst) {
    const Body body = make_sphere("icosphere:vertices=162");
    const Loads loads = one_force(patch_force(body, 5, 0.5, 0.02 * -body.rest.positions[5]));
    State state = random_state(body, 3, 0.05);
    double work = 0;
    const Force& force = loads.forces.front();
    for (std::size_t n = 0; n < force.vertices.size(); ++n)
        work += force.weights[n] *
                force.newton.dot(state.x[force.vertices[n]] - body.rest.positions[force.vertices[n]]);
    EXPECT_NEAR(load_displacement(body, loads, state) * force.newton.norm(), work, 1e-15);
}

TEST(StudyParts, JudgementsSayWhere) {
    const auto judged = [](std::vector<double> numbers) {
        Claim c;
        c.threshold = 1;
        std::vector<Judged> all;
        for (std::size_t n = 0; n < numbers.size(); ++n) all.push_back({std::pow(10.0, n), "", numbers[n]});
        judge(c, all);
        return c;
    };
    EXPECT_EQ(judged({0.5, 1, 0.1}).outcome, Outcome::holds);
    EXPECT_EQ(judged({2, 3, 4}).outcome, Outcome::fails);
    EXPECT_EQ(judged({2, std::nan("")}).outcome, Outcome::fails);
    EXPECT_EQ(judged({}).outcome, Outcome::not_judged);
    EXPECT_EQ(judged({0, 2, 2}).condition, "F/(ER²) up to 1");
    EXPECT_EQ(judged({2, 0, 0}).condition, "F/(ER²) from 10");
    EXPECT_EQ(judged({0, 2, 0, 2, 0, 0}).condition, "F/(ER²) up to 1, at 100, from 10000");
    EXPECT_EQ(judged({2, 0, 0, 3}).condition, "F/(ER²) from 10 to 100");
    EXPECT_EQ(judged({2, 0, 0, 3}).number, 3);
}

TEST(StudyParts, CasesSurviveToTheLastBit) {
    const TemporaryFolder folder("study-cases");
    Responses cases;
    cases["patch C 0 12 0.001"] = {
        {0, 1.0 / 3, 1e-300}, {0, -0.1}, {0, 2.0 / 7}, 0.1 + 0.2, 1e-9, {0, 0.7}, {1e-3}};
    cases["gravity B centroid"] = {{}, {0, M_PI}, {}, 0, 0};
    write_cases(cases, 42, folder.path / "cases.txt");
    const Responses read = read_cases(folder.path / "cases.txt", 42);
    ASSERT_EQ(read.size(), cases.size());
    for (const auto& [key, c] : cases) {
        const Response& r = read.at(key);
        EXPECT_EQ(r.vertex_m, c.vertex_m);
        EXPECT_EQ(r.load_m, c.load_m);
        EXPECT_EQ(r.volume_percent, c.volume_percent);
        EXPECT_EQ(r.std_m, c.std_m);
        EXPECT_EQ(r.imbalance, c.imbalance);
        EXPECT_EQ(r.force_n, c.force_n);
        EXPECT_EQ(r.pressure_pa, c.pressure_pa);
    }
}

TEST(StudyParts, OtherOrDamagedCasesAreRefused) {
    const TemporaryFolder folder("study-damaged");
    const auto file = folder.path / "cases.txt";
    EXPECT_THROW(read_cases(file, 1), InputError);
    write_cases({{"a", {{1}, {2}, {3}, 4, 5}}}, 1, file);
    EXPECT_NO_THROW(read_cases(file, 1));
    EXPECT_THROW(read_cases(file, 2), InputError);
    std::string bytes = content(file);
    bytes[bytes.find("a\t") + 4] ^= 1;
    std::ofstream(file, std::ios::binary) << bytes;
    EXPECT_THROW(read_cases(file, 1), InputError);
    std::ofstream(file, std::ios::binary) << "solid teapot\n";
    EXPECT_THROW(read_cases(file, 1), InputError);
}

}  // namespace
}  // namespace innerspring
