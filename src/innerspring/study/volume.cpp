#include "innerspring/study/volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "innerspring/study/truth.h"
#include "innerspring/study/truth_loads.h"

namespace innerspring {

namespace {

std::string volume_key(double poisson, Index vertex) {
    return fmt::format("volume {} {}", poisson, vertex);
}

std::shared_ptr<const Body> with_poisson(const Setting& s, double poisson) {
    auto body = std::make_shared<Body>(s.body());
    body->material.poisson = poisson;
    return body;
}

/// Law 2: the volume lost, as a share. At nu = 1/2 it is 0, and the pressure what is left of kappa dV/V.
double law_share(const Setting& s, double poisson, double force_n) {
    Material m = s.body().material;
    m.poisson = poisson;
    const double R = s.body().radius;
    return 3 * force_n / (4 * std::numbers::pi * R * R * (m.young + 3 * bulk_modulus(m) + 3 * m.surface / R));
}

double law_pressure(const Setting& s, double poisson, double force_n) {
    Material m = s.body().material;
    m.poisson = poisson;
    const double R = s.body().radius, kappa = bulk_modulus(m);
    return std::isfinite(kappa) ? kappa * law_share(s, poisson, force_n)
                                : force_n / (4 * std::numbers::pi * R * R);
}

BulgeRow bulge_of(const Setting& s, double poisson) {
    SurfaceMesh mesh = s.body().rest;
    for (Vector& q : mesh.positions) q -= s.body().centre.position;
    TruthSubject sphere =
        make_subject(std::move(mesh), s.body().material, {CentreKind::given, Vector::Zero()}, poisson);
    sphere.radius = sphere.mesh.positions[s.sampled.front()].norm();  // of the sphere, not of the polyhedron
    sphere.axis = sphere.mesh.positions[s.sampled.front()] / sphere.radius;
    TruthLoad load = squeeze_load(sphere, bulge_cap);
    std::vector<Vector> reference = squeeze_answer(sphere, bulge_cap);
    constexpr double small = 1e-3;  // of F = E R^2
    scale(load, small);
    for (Vector& u : reference) u *= small;
    const std::vector<TruthModel> models = truth_models();
    const TruthModel& model =
        *std::find_if(models.begin(), models.end(), [](const TruthModel& m) { return m.name == "C volume"; });
    const TruthRow row =
        compare(sphere, load, nodal_forces(sphere, load), reference, model.answer(sphere, load).u);
    return {poisson, *row.equator, *row.reference_equator};
}

}  // namespace

std::vector<Job> volume_jobs(const Setting& s) {
    // An equilibrium costs about as much as a few simulated seconds, and there are some of them in a case.
    const double cost = 3.0 * double(s.body().vertices()) * double(s.force_groups.size());
    std::vector<Job> jobs;
    for (const double poisson : s.options.poisson)
        for (const Index vertex : s.sampled)
            jobs.push_back({[&s, poisson] { return with_poisson(s, poisson); },
                            cost,
                            {{volume_key(poisson, vertex), {}, vertex, [&s, vertex](const Body& body) {
                                  std::vector<double> forces;
                                  for (const double group : s.force_groups)
                                      forces.push_back(s.force_n(group));
                                  const Loads unit = study_load(s, body, LoadKind::patch, vertex, 1);
                                  return press(body, unit.forces.front(), vertex, forces,
                                               deepest_share * body.radius);
                              }}}});
    return jobs;
}

VolumeStudy volume_study(const Setting& s, const Responses& responses) {
    const double unit_n = s.force_n(1), R = s.body().radius, count = double(s.sampled.size());
    VolumeStudy study;
    for (const double poisson : s.options.poisson)
        for (std::size_t n = 1; n <= s.force_groups.size() + 1; ++n) {
            VolumeMean mean;
            mean.poisson = poisson, mean.deepest = n > s.force_groups.size();
            for (const Index vertex : s.sampled) {
                const Response& r = responses.at(volume_key(poisson, vertex));
                const double group = mean.deepest ? r.force_n[n] / unit_n : s.force_groups[n - 1];
                const VolumeRow row{poisson,
                                    vertex,
                                    r.force_n[n],
                                    group,
                                    mean.deepest,
                                    r.vertex_m[n] / R,
                                    r.volume_percent[n],
                                    r.pressure_pa[n]};
                mean.force_n += row.force_n / count;
                mean.force_group += row.force_group / count;
                mean.indentation_share += row.indentation_share / count;
                mean.final_percent += row.final_percent / count;
                mean.pressure_pa += row.pressure_pa / count;
                mean.largest_percent = std::max(mean.largest_percent, std::abs(row.final_percent));
                study.rows.push_back(row);
            }
            if (!mean.deepest)
                mean.force_group = s.force_groups[n - 1], mean.force_n = s.force_n(mean.force_group);
            mean.law_percent = -100 * law_share(s, poisson, mean.force_n);
            mean.law_pa = law_pressure(s, poisson, mean.force_n);
            study.means.push_back(mean);
        }
    if (s.sphere)
        for (const double poisson : s.options.poisson) {
            const BulgeRow row = bulge_of(s, poisson);
            if (std::isfinite(row.equator)) study.bulge.push_back(row);  // else no vertex is near the equator
        }
    return study;
}

}  // namespace innerspring
