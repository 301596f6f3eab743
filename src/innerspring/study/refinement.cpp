#include "innerspring/study/refinement.h"

#include <algorithm>
#include <cmath>

namespace innerspring {

std::string coarse_key(const Variant& variant, LoadKind load, Index vertex, double group) {
    return case_key(load, to_string(variant.scheme), 0, vertex, group);
}

std::string refined_key(const Variant& variant, LoadKind load, int levels, Index vertex, double group) {
    return case_key(load, variant.name, levels, vertex, group);
}

const std::vector<double>& measured(LoadKind load, const Response& response) {
    return load == LoadKind::patch ? response.load_m : response.vertex_m;
}

Deviation deviation(std::span<const double> coarse, std::span<const double> refined) {
    const double n = double(coarse.size());
    Deviation d{coarse.back(), refined.back(), refined.back() / coarse.back()};
    double mean = 0, squares = 0;
    for (std::size_t t = 0; t < coarse.size(); ++t) {
        d.mean_m += std::abs(coarse[t] - refined[t]) / n;
        mean += (coarse[t] - refined[t]) / n;
    }
    for (std::size_t t = 0; t < coarse.size(); ++t)
        squares += (coarse[t] - refined[t] - mean) * (coarse[t] - refined[t] - mean) / n;
    d.std_m = std::sqrt(squares);
    d.mean_relative = d.mean_m / std::abs(d.coarse_final_m);
    d.std_relative = d.std_m / std::abs(d.coarse_final_m);
    return d;
}

std::vector<Job> refinement_jobs(const Setting& s) {
    std::vector<Job> jobs;
    for (const Index vertex : s.refinable) {
        for (const Scheme scheme : schemes) jobs.push_back(coarse_job(s, scheme, vertex));
        const std::vector<Index> region = region_of(s, vertex);
        for (int levels = 1; levels <= s.options.levels; ++levels)
            for (const Variant& variant : variants) {
                const double pieces = std::pow(4, levels);
                // Twice as many sub-steps a level, and half a vertex for each new triangle.
                Job job{[&s, region, levels, variant] {
                            return std::make_shared<const Body>(
                                refined(s.body(variant.scheme), region, levels, variant.mean));
                        },
                        (double(s.body().vertices()) + double(region.size()) * (pieces - 1) / 2) *
                            std::sqrt(pieces),
                        {}};
                for (const LoadKind load : load_kinds)
                    for (const double group : s.force_groups)
                        job.cases.push_back({refined_key(variant, load, levels, vertex, group),
                                             [&s, load, vertex, group](const Body& body) {
                                                 return study_load(s, body, load, vertex, s.force_n(group));
                                             },
                                             vertex});
                jobs.push_back(std::move(job));
            }
    }
    return jobs;
}

namespace {

/// Adds `d` to a mean over `n`.
void add(Deviation& mean, const Deviation& d, double n) {
    for (double Deviation::*member :
         {&Deviation::coarse_final_m, &Deviation::refined_final_m, &Deviation::ratio, &Deviation::mean_m,
          &Deviation::std_m, &Deviation::mean_relative, &Deviation::std_relative})
        mean.*member += d.*member / n;
}

}  // namespace

RefinementStudy refinement_study(const Setting& s, const Responses& responses) {
    RefinementStudy study;
    if (s.refinable.empty()) return study;
    for (const LoadKind load : load_kinds)
        for (int levels = 1; levels <= s.options.levels; ++levels)
            for (const Variant& variant : variants)
                for (const double group : s.force_groups) {
                    RefinementMean mean{load, variant.name, levels,   s.force_n(group), group,
                                        {},   {},           INFINITY, -INFINITY};
                    for (const Index vertex : s.refinable) {
                        const Response& coarse = responses.at(coarse_key(variant, load, vertex, group));
                        const Response& fine =
                            responses.at(refined_key(variant, load, levels, vertex, group));
                        const RefinementRow row{load,
                                                variant.name,
                                                levels,
                                                vertex,
                                                s.force_n(group),
                                                group,
                                                deviation(measured(load, coarse), measured(load, fine)),
                                                deviation(coarse.vertex_m, fine.vertex_m)};
                        add(mean.measured, row.measured, double(s.refinable.size()));
                        add(mean.vertex_own, row.vertex_own, double(s.refinable.size()));
                        mean.ratio_least = std::min(mean.ratio_least, row.measured.ratio);
                        mean.ratio_largest = std::max(mean.ratio_largest, row.measured.ratio);
                        study.rows.push_back(row);
                    }
                    study.means.push_back(mean);
                }
    return study;
}

}  // namespace innerspring
