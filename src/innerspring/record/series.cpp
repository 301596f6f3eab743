#include "innerspring/record/series.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

std::string column(std::string name) {
    std::replace_if(
        name.begin(), name.end(), [](unsigned char c) { return c == ',' || c == '"' || c < 32; }, '_');
    return name;
}

std::string header(const Loads& loads) {
    std::string text =
        "time_s,volume_m3,volume_variation_percent,kinetic_j,elastic_j,potential_j,max_displacement_m,"
        "pressure_pa";
    for (std::size_t n = 0; n < loads.forces.size(); ++n) {
        text += fmt::format(",force_{}_n", column(loads.forces[n].name));
    }
    for (const Tool& tool : loads.tools)
        for (char axis : {'x', 'y', 'z'}) text += fmt::format(",tool_{}_{}_n", column(tool.name), axis);
    return text;
}

}  // namespace

std::string to_csv(std::span<const Measures> rows, const Loads& loads) {
    std::string text = header(loads) + "\n";
    for (const Measures& r : rows) {
        fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{}", r.time, r.volume,
                       r.volume_variation_percent, r.kinetic, r.elastic, r.potential, r.max_displacement,
                       r.pressure);
        for (double f : r.force) fmt::format_to(std::back_inserter(text), ",{}", f);
        for (const Vector& f : r.tool_force)
            fmt::format_to(std::back_inserter(text), ",{},{},{}", f.x(), f.y(), f.z());
        text += '\n';
    }
    return text;
}

std::vector<Measures> read_series(const std::filesystem::path& file, std::size_t count, const Loads& loads) {
    std::ifstream in(file);
    std::string line;
    if (!in || !std::getline(in, line) || line != header(loads))
        throw InputError(
            fmt::format("{}: missing, or not the series of this scene; it cannot be resumed", file.string()));
    std::vector<Measures> rows;
    while (rows.size() < count && std::getline(in, line)) {
        Measures r;
        r.force.resize(loads.forces.size());
        std::vector<double*> columns{&r.time,    &r.volume,    &r.volume_variation_percent, &r.kinetic,
                                     &r.elastic, &r.potential, &r.max_displacement,         &r.pressure};
        for (double& f : r.force) columns.push_back(&f);
        r.tool_force.resize(loads.tools.size());
        for (Vector& f : r.tool_force)
            for (double& component : f) columns.push_back(&component);
        const char *p = line.data(), *end = p + line.size();
        for (std::size_t c = 0; c < columns.size(); ++c) {
            const auto [next, error] = std::from_chars(p, end, *columns[c]);
            if (error != std::errc() || (c + 1 < columns.size() ? next == end || *next != ',' : next != end))
                throw InputError(fmt::format("{}:{}: not a row of a series", file.string(), rows.size() + 2));
            p = next + 1;
        }
        rows.push_back(std::move(r));
    }
    if (rows.size() < count)
        throw InputError(
            fmt::format("{}: {} rows where the saved state has {}", file.string(), rows.size(), count));
    return rows;
}

VolumeVariation volume_variation(std::span<const double> percent) {
    VolumeVariation v;
    for (const double now : percent) {
        v.max = std::max(v.max, std::abs(now));
        v.mean += std::abs(now) / double(percent.size());
    }
    if (!percent.empty()) v.final = percent.back();
    return v;
}

VolumeVariation volume_variation(std::span<const Measures> rows) {
    std::vector<double> percent;
    for (const Measures& r : rows) percent.push_back(r.volume_variation_percent);
    return volume_variation(percent);
}

}  // namespace innerspring
