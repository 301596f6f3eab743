#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/study/figures.h"

namespace innerspring {

namespace {

/// A number, or nothing where there is none (local centres have no offset).
std::string number(double value) {
    return std::isfinite(value) ? fmt::format("{}", value) : "";
}

std::string fields(const Deviation& d) {
    return fmt::format("{},{},{},{},{},{},{}", d.coarse_final_m, d.refined_final_m, d.ratio, d.mean_m,
                       d.std_m, d.mean_relative, d.std_relative);
}

}  // namespace

std::string to_csv(const Figure& figure) {
    std::string text = figure.x_column;
    for (const std::string& column : figure.y_columns) text += ',' + column;
    text += '\n';
    const std::vector<double>& x = figure.plot.curves.front().x;
    for (std::size_t row = 0; row < x.size(); ++row) {
        text += number(x[row]);
        for (std::size_t n = 0; n < figure.y_columns.size(); ++n) {
            const std::vector<double>& y = figure.plot.curves[n].y;
            text += ',' + (row < y.size() ? number(y[row]) : "");
        }
        text += '\n';
    }
    return text;
}

std::string refinement_series_csv(const Setting& s, const Responses& responses, LoadKind load) {
    std::string text =
        "scheme,levels,vertex,force_n,time_s,coarse_load_m,refined_load_m,coarse_vertex_m,refined_vertex_m\n";
    const std::size_t stride = std::size_t(s.sampling.samples) / 59 + 1;
    for (int levels = 1; levels <= s.options.levels; ++levels)
        for (const Variant& v : variants)
            for (const Index vertex : s.refinable)
                for (const double group : s.force_groups) {
                    const Response& coarse = responses.at(coarse_key(v, load, vertex, group));
                    const Response& fine = responses.at(refined_key(v, load, levels, vertex, group));
                    const std::size_t last = coarse.load_m.size() - 1;
                    for (std::size_t n = 0;; n = std::min(n + stride, last)) {
                        text += fmt::format("{},{},{},{},{:.10g},{:.10g},{:.10g},{:.10g},{:.10g}\n", v.name,
                                            levels, vertex, s.force_n(group), double(n) * s.sampling.dt_s,
                                            coarse.load_m[n], fine.load_m[n], coarse.vertex_m[n],
                                            fine.vertex_m[n]);
                        if (n == last) break;
                    }
                }
    return text;
}

std::string to_csv(const RefinementStudy& study) {
    std::string text = "load,scheme,levels,vertex,force_n,force_group";
    for (const char* prefix : {"", "vertex_"})
        for (const char* column : {"coarse_final_m", "refined_final_m", "ratio", "mean_deviation_m",
                                   "std_deviation_m", "mean_deviation_relative", "std_deviation_relative"})
            text += fmt::format(",{}{}", prefix, column);
    text += '\n';
    for (const RefinementRow& r : study.rows)
        text += fmt::format("{},{},{},{},{},{},{},{}\n", to_string(r.load), r.scheme, r.levels, r.vertex,
                            r.force_n, r.force_group, fields(r.measured), fields(r.vertex_own));
    return text;
}

std::string to_csv(const GravityStudy& study) {
    std::string text =
        "scheme,centre,offset_share,final_percent,max_percent,mean_percent,law_percent,displacement_std_m\n";
    for (const GravityRow& r : study.rows) {
        const VolumeVariation& v = r.volume_variation_percent;
        text +=
            fmt::format("{},{},{},{},{},{},{},{}\n", to_string(r.scheme), r.centre, number(r.offset_share),
                        v.final, v.max, v.mean, number(r.law_percent), r.displacement_std_m);
    }
    return text;
}

std::string to_csv(const ForceStudy& study) {
    std::string text =
        "load,scheme,vertex,density_class,force_n,force_group,mean_percent,max_percent,final_percent\n";
    for (const ForceRow& r : study.rows) {
        const VolumeVariation& v = r.volume_variation_percent;
        text += fmt::format("{},{},{},{},{},{},{},{},{}\n", to_string(r.load), to_string(r.scheme), r.vertex,
                            to_string(r.density), r.force_n, r.force_group, v.mean, v.max, v.final);
    }
    return text;
}

std::string to_csv(const VolumeStudy& study) {
    std::string text =
        "poisson,vertex,force_n,force_group,deepest,indentation_share,final_percent,pressure_pa\n";
    for (const VolumeRow& r : study.rows)
        text += fmt::format("{},{},{},{},{},{},{},{}\n", r.poisson, r.vertex, r.force_n, r.force_group,
                            int(r.deepest), r.indentation_share, r.final_percent, r.pressure_pa);
    return text;
}

}  // namespace innerspring
