// What the studies find on a small sphere: signs, orders and laws, no stored numbers.
#include <gtest/gtest.h>

#include "study/small_study.h"

namespace innerspring {
namespace {

using namespace support;

/// One study of everything, shared by the tests.
const StudyResults& results() {
    static const TemporaryFolder folder("study-laws");
    static const StudyResults found = run_study(small_sphere(), small_study(StudyKind::all, folder.path));
    return found;
}

const RefinementMean& mean(LoadKind load, std::string_view scheme, double group) {
    for (const RefinementMean& m : results().refinement->means)
        if (m.load == load && m.scheme == scheme && m.force_group == group) return m;
    throw std::runtime_error("no such mean");
}

const GravityRow& row(Scheme scheme, std::string_view centre) {
    for (const GravityRow& r : results().gravity->rows)
        if (r.scheme == scheme && r.centre == centre) return r;
    throw std::runtime_error("no such row");
}

const ForceMean& mean(LoadKind load, Scheme scheme, DensityClass density, double group) {
    for (const ForceMean& m : results().force->means)
        if (m.load == load && m.scheme == scheme && m.density == density && m.force_group == group) return m;
    throw std::runtime_error("no such mean");
}

TEST(StudyLaws, EveryCaseComesToRest) {
    EXPECT_LT(results().largest_imbalance, 0.01);
    EXPECT_GT(results().cases, 100u);
}

TEST(StudyLaws, SpreadOverThePatchSchemeCDeviatesLeastAndTheOthersStiffen) {
    for (const double group : results().setting.force_groups) {
        const RefinementMean& C = mean(LoadKind::patch, "C", group);
        for (const char* other : {"A_total", "A_node", "B"}) {
            const RefinementMean& o = mean(LoadKind::patch, other, group);
            EXPECT_LT(C.measured.mean_m, 0.5 * o.measured.mean_m) << other << " at " << group;
            EXPECT_LT(C.measured.std_m, 0.5 * o.measured.std_m) << other << " at " << group;
            EXPECT_LT(o.measured.ratio, 0.6) << other << " at " << group;
        }
        if (group <= 1e-2) {
            EXPECT_NEAR(C.measured.ratio, 1, 0.05) << group;
        }
    }
}

TEST(StudyLaws, OnOneVertexASmallForceMovesSchemeCMost) {
    const double least = results().setting.force_groups.front();
    const RefinementMean& C = mean(LoadKind::point, "C", least);
    EXPECT_GT(C.measured.ratio, 2);
    EXPECT_LT(C.measured.ratio, 4.5);  // K_i falls fourfold; the surface carries the rest
    for (const char* other : {"A_total", "A_node", "B"})
        EXPECT_GT(C.measured.mean_m, mean(LoadKind::point, other, least).measured.mean_m) << other;
}

TEST(StudyLaws, UnderGravitySchemeCSinksAsAWhole) {
    const GravityRow &B = row(Scheme::B, "centroid"), &C = row(Scheme::C, "centroid");
    EXPECT_LT(C.volume_variation_percent.max, 0.1 * B.volume_variation_percent.max);
    EXPECT_LT(C.displacement_std_m, 0.1 * B.displacement_std_m);
}

TEST(StudyLaws, AnOffCentreCostsVolumeByLaw3) {
    double before = 0;
    for (const char* centre : {"off_1_percent", "off_2_percent", "off_4_percent", "off_8_percent"}) {
        const GravityRow& C = row(Scheme::C, centre);
        EXPECT_NEAR(C.volume_variation_percent.final, C.law_percent, 0.1 * std::abs(C.law_percent)) << centre;
        EXPECT_LT(C.volume_variation_percent.final, before) << centre;
        before = C.volume_variation_percent.final;
    }
}

TEST(StudyLaws, AForceCostsVolumeByLaw2WhereverItActs) {
    for (const double group : results().setting.force_groups) {
        if (group > 1e-3) continue;
        const ForceMean &A = mean(LoadKind::patch, Scheme::A, DensityClass::sampled, group),
                        &C = mean(LoadKind::patch, Scheme::C, DensityClass::sampled, group);
        EXPECT_NEAR(C.volume_variation_percent.final / C.law_percent, 1, 0.05) << group;
        EXPECT_LT(C.final_std_percent, 0.2 * A.final_std_percent) << group;
    }
}

TEST(StudyLaws, RegularSpringsLoseMoreWhereTheMeshIsCoarse) {
    const double group = results().setting.force_groups.front();
    for (const Scheme scheme : {Scheme::A, Scheme::B})
        EXPECT_GT(mean(LoadKind::patch, scheme, DensityClass::coarsest, group).volume_variation_percent.mean,
                  mean(LoadKind::patch, scheme, DensityClass::densest, group).volume_variation_percent.mean);
}

TEST(StudyLaws, VerdictsFollowFromTheNumbers) {
    EXPECT_GE(results().claims.size(), 15u);
    for (const Claim& c : results().claims) {
        EXPECT_EQ(c.outcome == Outcome::holds, c.number <= c.threshold) << c.id;
        EXPECT_EQ(c.outcome == Outcome::holds_only_if, !c.condition.empty()) << c.id;
        EXPECT_FALSE(c.measured.empty()) << c.id;
    }
}

}  // namespace
}  // namespace innerspring
