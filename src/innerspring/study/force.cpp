#include "innerspring/study/force.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace innerspring {

std::vector<Job> force_jobs(const Setting& s) {
    std::vector<Job> jobs;
    for (const Scheme scheme : schemes)
        for (const DensityClass density : density_classes)
            for (const Index vertex : s.vertices(density)) jobs.push_back(coarse_job(s, scheme, vertex));
    return jobs;
}

ForceStudy force_study(const Setting& s, const Responses& responses) {
    const Body& body = s.body();
    const double R = body.radius, E = body.material.young, E_s = body.material.surface;
    ForceStudy study;
    for (const LoadKind load : load_kinds)
        for (const DensityClass density : density_classes)
            for (const Scheme scheme : schemes)
                for (const double group : s.force_groups) {
                    const std::vector<Index>& vertices = s.vertices(density);
                    const double F = s.force_n(group), n = double(vertices.size());
                    ForceMean mean{load, scheme, density, F, group, {}};
                    mean.law_percent = -100 * 3 * F / (4 * std::numbers::pi * R * R * (E + 3 * E_s / R));
                    double least = INFINITY, largest = -INFINITY, squares = 0;
                    const std::size_t first = study.rows.size();
                    for (const Index vertex : vertices) {
                        const Response& r = responses.at(case_key(load, to_string(scheme), 0, vertex, group));
                        const VolumeVariation v = volume_variation(r.volume_percent);
                        study.rows.push_back({load, scheme, vertex, density, F, group, v});
                        mean.volume_variation_percent.final += v.final / n;
                        mean.volume_variation_percent.max += v.max / n;
                        mean.volume_variation_percent.mean += v.mean / n;
                        least = std::min(least, v.final);
                        largest = std::max(largest, v.final);
                    }
                    for (std::size_t row = first; row < study.rows.size(); ++row) {
                        const double off = study.rows[row].volume_variation_percent.final -
                                           mean.volume_variation_percent.final;
                        squares += off * off / n;
                    }
                    mean.final_std_percent = std::sqrt(squares);
                    mean.final_spread_percent = largest - least;
                    study.means.push_back(mean);
                }
    return study;
}

}  // namespace innerspring
