// What the studies find on a small sphere: signs, orders and laws, no stored numbers.
#include <gtest/gtest.h>

#include <cmath>

#include "innerspring/mesh/geometry.h"
#include "innerspring/sim/equilibrium.h"
#include "study/small_study.h"

namespace innerspring {
namespace {

using namespace support;

/// One study of everything, shared by the tests.
const StudyResults& results() {
    static const TemporaryFolder folder("study-laws");
    static const StudyResults found = run_study(small_sphere(), small_study(StudyKind::all, folder.path, 3));
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

void every_case_comes_to_rest() {
    EXPECT_LT(results().largest_imbalance, 0.01);
    EXPECT_GT(results().cases, 100u);
}

void spread_over_the_patch_scheme_c_deviates_least_and_the_others_stiffen() {
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

void on_one_vertex_a_small_force_moves_scheme_c_most() {
    const double least = results().setting.force_groups.front();
    const RefinementMean& C = mean(LoadKind::point, "C", least);
    EXPECT_GT(C.measured.ratio, 2);
    EXPECT_LT(C.measured.ratio, 4.5);  // K_i falls fourfold; the surface carries the rest
    for (const char* other : {"A_total", "A_node", "B"})
        EXPECT_GT(C.measured.mean_m, mean(LoadKind::point, other, least).measured.mean_m) << other;
}

void under_gravity_scheme_c_sinks_as_a_whole() {
    const GravityRow &B = row(Scheme::B, "centroid"), &C = row(Scheme::C, "centroid");
    EXPECT_LT(C.volume_variation_percent.max, 0.1 * B.volume_variation_percent.max);
    EXPECT_LT(C.displacement_std_m, 0.1 * B.displacement_std_m);
}

void an_off_centre_costs_volume_by_law_3() {
    double before = 0;
    for (const char* centre : {"off_1_percent", "off_2_percent", "off_4_percent", "off_8_percent"}) {
        const GravityRow& C = row(Scheme::C, centre);
        EXPECT_NEAR(C.volume_variation_percent.final, C.law_percent, 0.1 * std::abs(C.law_percent)) << centre;
        EXPECT_LT(C.volume_variation_percent.final, before) << centre;
        before = C.volume_variation_percent.final;
    }
}

void a_force_costs_volume_by_law_2_wherever_it_acts() {
    for (const double group : results().setting.force_groups) {
        if (group > 1e-3) continue;
        const ForceMean &A = mean(LoadKind::patch, Scheme::A, DensityClass::sampled, group),
                        &C = mean(LoadKind::patch, Scheme::C, DensityClass::sampled, group);
        EXPECT_NEAR(C.volume_variation_percent.final / C.law_percent, 1, 0.05) << group;
        EXPECT_LT(C.final_std_percent, 0.2 * A.final_std_percent) << group;
    }
}

void regular_springs_lose_more_where_the_mesh_is_coarse() {
    const double group = results().setting.force_groups.front();
    for (const Scheme scheme : {Scheme::A, Scheme::B})
        EXPECT_GT(mean(LoadKind::patch, scheme, DensityClass::coarsest, group).volume_variation_percent.mean,
                  mean(LoadKind::patch, scheme, DensityClass::densest, group).volume_variation_percent.mean);
}

/// A pressure against the change of volume stands beside the springs in law 2; at 1/2 what remains of it is
/// the force over the surface, F/(4 pi R^2).
void with_poisson_a_push_costs_volume_by_law_2_down_to_nothing() {
    const VolumeStudy& study = *results().volume;
    const Body& body = results().setting.body();
    for (const VolumeMean& m : study.means) {
        if (m.deepest) {
            EXPECT_GE(m.indentation_share, deepest_share) << m.poisson;
            EXPECT_LE(m.indentation_share, 1.01 * deepest_share) << m.poisson;
        }
        if (m.poisson == 0.5) {
            EXPECT_LT(m.largest_percent, 1e-3) << m.force_group;
        }
        if (m.deepest || m.force_group > 1e-3) continue;
        if (m.poisson < 0.5) {
            EXPECT_NEAR(m.final_percent / m.law_percent, 1, 0.05) << m.poisson << ", " << m.force_group;
        }
        if (m.poisson > 0) {
            EXPECT_NEAR(m.pressure_pa / m.law_pa, 1, 0.05) << m.poisson << ", " << m.force_group;
        }
    }
    for (const VolumeRow& r : study.rows) {
        Material material = body.material;
        material.poisson = r.poisson;
        if (r.poisson < 0.5) {
            const double kappa = bulk_modulus(material);
            EXPECT_NEAR(r.pressure_pa, -kappa * r.final_percent / 100, 1e-9 * body.material.young);
        }
    }
    const std::size_t each = study.rows.size() / results().setting.options.poisson.size();
    for (std::size_t n = each; n < study.rows.size(); ++n)
        EXPECT_LT(std::abs(study.rows[n].final_percent), std::abs(study.rows[n - each].final_percent)) << n;
}

void a_squeezed_sphere_bulges_the_more_the_larger_nu_but_less_than_a_solid() {
    double before = -1;
    for (const BulgeRow& b : results().volume->bulge) {
        EXPECT_GT(b.equator, before) << b.poisson;
        EXPECT_LT(b.equator, b.reference_equator) << b.poisson;
        before = b.equator;
    }
    EXPECT_EQ(results().volume->bulge.size(), results().setting.options.poisson.size());
}

void verdicts_follow_from_the_numbers() {
    EXPECT_GE(results().claims.size(), 15u);
    for (const Claim& c : results().claims) {
        EXPECT_EQ(c.outcome == Outcome::holds, c.number <= c.threshold) << c.id;
        EXPECT_EQ(c.outcome == Outcome::holds_only_if, !c.condition.empty()) << c.id;
        EXPECT_FALSE(c.measured.empty()) << c.id;
    }
}

/// Without surface springs each vertex answers to the pressure P alone: u = P R/E at the equator. Caps of
/// force F each have 2F/(1 + cos a) along their normals, which lets P = 2 nu times both of that over the
/// surface.
TEST(StudyLaws, TheBulgeOfBareSchemeC) {
    const TemporaryFolder folder("study-bulge");
    Scene bare;
    bare.mesh = "icosphere:vertices=642";
    bare.material.surface = 0;
    const StudyResults found = run_study(bare, small_study(StudyKind::volume, folder.path, 2));
    ASSERT_EQ(found.volume->bulge.size(), 5u);
    for (const BulgeRow& b : found.volume->bulge)
        EXPECT_NEAR(b.equator, 2 * b.poisson / (M_PI * (1 + std::cos(bulge_cap))), 0.004) << b.poisson;
}

/// Off the sphere a push costs dV_0/(1 + kappa/B): B is what the body at nu = 0 resists an even pressure
/// with, p V/dV.
TEST(StudyLaws, OnAnyShapeTheLossFallsByTheBodysStiffness) {
    const TemporaryFolder folder("study-stiffness");
    Scene organ;
    organ.mesh = "organ:vertices=250";
    StudyRun run = small_study(StudyKind::volume, folder.path, 2);
    run.options.poisson = {0, 0.3, 0.49};
    const StudyResults found = run_study(organ, run);
    EXPECT_TRUE(found.volume->bulge.empty());

    const Body& body = found.setting.body();
    const double p = 1e-4;
    std::vector<Vector> a(body.vertices(), Vector::Zero());  // dV/dx: a third of the areas around
    for (const Triangle& t : body.rest.triangles)
        for (const Index i : t) a[i] += double_area_vector(body.rest.positions, t) / 6;
    Loads loads{Vector::Zero(), {}, {}};
    for (Index i = 0; i < a.size(); ++i) loads.forces.push_back(point_force(i, p * a[i]));
    State state = rest_state(body);
    ASSERT_TRUE(solve_equilibrium(body, loads, state).reached);
    const double B = p / (volume(state.x, body.rest.triangles) / body.volume - 1);

    const std::size_t each = found.volume->means.size() / 3;
    for (std::size_t n = each; n < 3 * each; ++n) {
        const VolumeMean &m = found.volume->means[n], &base = found.volume->means[n % each];
        if (m.deepest || m.force_group > 1e-3) continue;
        Material material = body.material;
        material.poisson = m.poisson;
        EXPECT_NEAR(base.final_percent / m.final_percent / (1 + bulk_modulus(material) / B), 1, 0.01)
            << m.poisson << ", " << m.force_group;
    }
}

/// One test, as each is a process of its own and the study is run once for all.
TEST(StudyLaws, HoldOnASmallSphere) {
    every_case_comes_to_rest();
    spread_over_the_patch_scheme_c_deviates_least_and_the_others_stiffen();
    on_one_vertex_a_small_force_moves_scheme_c_most();
    under_gravity_scheme_c_sinks_as_a_whole();
    an_off_centre_costs_volume_by_law_3();
    a_force_costs_volume_by_law_2_wherever_it_acts();
    regular_springs_lose_more_where_the_mesh_is_coarse();
    with_poisson_a_push_costs_volume_by_law_2_down_to_nothing();
    a_squeezed_sphere_bulges_the_more_the_larger_nu_but_less_than_a_solid();
    verdicts_follow_from_the_numbers();
}

}  // namespace
}  // namespace innerspring
