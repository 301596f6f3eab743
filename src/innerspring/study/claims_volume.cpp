#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/study/claims.h"
#include "innerspring/study/judge.h"

namespace innerspring {

namespace {

constexpr double hard = 0.5;

std::vector<const VolumeMean*> means_at(const VolumeStudy& study, double poisson) {
    std::vector<const VolumeMean*> means;
    for (const VolumeMean& m : study.means)
        if (m.poisson == poisson) means.push_back(&m);
    return means;
}

/// What is said of the deepest force stands apart: each vertex has its own.
Judged judged(const VolumeMean& m, std::string where, double number) {
    if (!m.deepest) return {m.force_group, std::move(where), number};
    return {0, fmt::format("{}{}at {:g} R", where, where.empty() ? "" : ", ", deepest_share), number};
}

Claim volume_kept(const VolumeStudy& study) {
    Claim c{"volume_kept", "Fig. 9 with ν",
            fmt::format("At ν = ½ the volume changes by less than 0.001 % under every force, to an "
                        "indentation of {:g} R",
                        deepest_share)};
    c.threshold = 1e-3, c.unit = "% of the volume", c.study = "volume";
    std::vector<Judged> numbers;
    for (const VolumeMean* m : means_at(study, hard)) {
        numbers.push_back(judged(*m, "", m->largest_percent));
        if (m->deepest)
            c.measured =
                fmt::format("at {:.3g} R, F/(ER²) = {:.3g} in the mean: {:.2g} % at most, P = {:.3g} Pa",
                            m->indentation_share, m->force_group, m->largest_percent, m->pressure_pa);
    }
    if (numbers.empty()) c.condition = "ν = 0.5 was not asked for";
    judge(c, numbers);
    return c;
}

/// At every vertex and force.
Claim falls_with_poisson(const Setting& s, const VolumeStudy& study) {
    Claim c{"volume_falls", "Fig. 9 with ν",
            "The volume lost falls as ν grows, at every vertex and under every force"};
    c.threshold = 1, c.unit = "loss at the larger ν / at the one before", c.study = "volume";
    std::vector<Judged> numbers;
    const std::vector<double>& nu = s.options.poisson;
    // Every nu has as many rows, in the same order: by force, then vertex.
    const std::size_t vertices = s.sampled.size(), each = study.rows.size() / nu.size();
    for (std::size_t force = 0; force < each / vertices; ++force)
        for (std::size_t n = 1; n < nu.size(); ++n) {
            double ratio = 0;
            for (std::size_t v = force * vertices; v < (force + 1) * vertices; ++v)
                ratio = std::max(ratio, std::abs(study.rows[n * each + v].final_percent /
                                                 study.rows[(n - 1) * each + v].final_percent));
            numbers.push_back(judged(study.means[force], fmt::format("ν = {:g}", nu[n]), ratio));
        }
    for (const VolumeMean& m : study.means)
        if (m.deepest)
            c.measured += fmt::format("{}{:g}: {:.2g} %", c.measured.empty() ? "at 0.3 R, by ν: " : ", ",
                                      m.poisson, m.final_percent);
    if (nu.size() < 2) c.condition = "one ν alone was asked for";
    judge(c, numbers);
    return c;
}

Claim law_with_poisson(const VolumeStudy& study) {
    Claim c{"volume_law", "law 2 with ν",
            "Below ν = ½ the loss is 3F/(4πR²(E + 3κ + 3E_s/R)), within 5 % for F/(ER²) ≤ 0.001 (exact on a "
            "sphere)"};
    c.threshold = 5, c.unit = "% from the law", c.study = "volume";
    std::vector<Judged> numbers;
    for (const VolumeMean& m : study.means)
        if (m.poisson < hard && !m.deepest && m.force_group <= 1e-3) {
            const double off = 100 * std::abs(m.final_percent / m.law_percent - 1);
            numbers.push_back({m.force_group, fmt::format("ν = {:g}", m.poisson), off});
        }
    for (const Judged& j : numbers)
        if (j.group == numbers.front().group)
            c.measured +=
                fmt::format("{}{} {:.2g} %", c.measured.empty() ? "off by: " : ", ", j.where, j.number);
    judge(c, numbers);
    return c;
}

/// On any shape: the pressure P adds P a^T A a to the volume that the push costs (A: displacements under
/// forces, a = dV/dx), and P = -kappa dV/V. So dV = dV_0/(1 + kappa/B), B = V/(a^T A a), which is
/// (E + 3 E_s/R)/3 of the sphere.
Claim one_stiffness(const Setting& s, const VolumeStudy& study) {
    Claim c{"volume_stiffness", "law 2 with ν",
            "On any shape the loss is that of ν = 0 over 1 + κ/B, with one stiffness B of the body for all ν "
            "and forces, within 5 % for F/(ER²) ≤ 0.001"};
    c.threshold = 5, c.unit = "% from the first B", c.study = "volume";
    const std::vector<const VolumeMean*> base = means_at(study, 0);
    std::vector<Judged> numbers;
    double first = 0, least = INFINITY, largest = 0;
    for (const double poisson : s.options.poisson) {
        if (base.empty() || poisson == 0 || poisson == hard) continue;
        Material m = s.body().material;
        m.poisson = poisson;
        const std::vector<const VolumeMean*> means = means_at(study, poisson);
        for (std::size_t n = 0; n < means.size() && !means[n]->deepest && means[n]->force_group <= 1e-3;
             ++n) {
            const double B = bulk_modulus(m) / (base[n]->final_percent / means[n]->final_percent - 1);
            if (first == 0) first = B;
            least = std::min(least, B), largest = std::max(largest, B);
            numbers.push_back(
                {means[n]->force_group, fmt::format("ν = {:g}", poisson), 100 * std::abs(B / first - 1)});
        }
    }
    if (numbers.empty()) c.condition = "ν = 0 and one between 0 and ½ are needed";
    if (!numbers.empty()) c.measured = fmt::format("B = {:.4g} to {:.4g} Pa", least, largest);
    judge(c, numbers);
    return c;
}

Claim bulge(const VolumeStudy& study) {
    Claim c{
        "volume_bulge", "linear elasticity",
        fmt::format("The equator of a sphere squeezed by two caps of {:g} rad bulges as Lamé's solid of the "
                    "same ν, within 10 %",
                    bulge_cap)};
    c.threshold = 10, c.unit = "% from the series", c.study = "volume";
    std::vector<Judged> numbers;
    for (const BulgeRow& b : study.bulge) {
        numbers.push_back(
            {0, fmt::format("ν = {:g}", b.poisson), 100 * std::abs(b.equator / b.reference_equator - 1)});
        c.measured +=
            fmt::format("{}{:g}: {:.3g} ({:.3g})", c.measured.empty() ? "u ER/F (the series') by ν: " : ", ",
                        b.poisson, b.equator, b.reference_equator);
    }
    judge(c, numbers);
    return c;
}

}  // namespace

std::vector<Claim> claims_of(const Setting& s, const VolumeStudy& study) {
    std::vector<Claim> claims{volume_kept(study), falls_with_poisson(s, study), law_with_poisson(study),
                              one_stiffness(s, study)};
    if (!study.bulge.empty()) claims.push_back(bulge(study));
    return claims;
}

}  // namespace innerspring
