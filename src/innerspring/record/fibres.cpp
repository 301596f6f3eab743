#include "innerspring/record/fibres.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>

#include "innerspring/mesh/bvh.h"
#include "innerspring/mesh/error.h"
#include "innerspring/record/vtk_read.h"

namespace innerspring {

namespace {

constexpr std::string_view columns[6] = {"x_m", "y_m", "z_m", "fibre_x", "fibre_y", "fibre_z"};

std::string_view trimmed(std::string_view text) {
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '"'; };
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && blank(text.back())) text.remove_suffix(1);
    return text;
}

/// Takes the text up to the next `end` off the front.
std::string_view take(std::string_view& text, char end) {
    const std::size_t at = std::min(text.find(end), text.size());
    const std::string_view part = text.substr(0, at);
    text.remove_prefix(std::min(at + 1, text.size()));
    return part;
}

void require(const FibreSamples& samples, std::string_view name) {
    if (samples.places.empty()) throw InputError(fmt::format("{}: there is no fibre in it", name));
    for (std::size_t i = 0; i < samples.places.size(); ++i)
        if (!samples.places[i].allFinite() || !samples.directions[i].allFinite() ||
            !(samples.directions[i].stableNorm() > 0))
            throw InputError(fmt::format("{}: fibre {} has no direction, or a number that is none", name, i));
}

struct Nearest {
    FibreSamples samples;
    BoxTree tree;

    Vector operator()(const Vector& q) const {
        const auto far = [&](Index node) {
            const Box& box = tree.nodes[node].box;
            return (q - q.cwiseMax(box.lower).cwiseMin(box.upper)).squaredNorm();
        };
        double least = INFINITY;
        Index found = 0;
        std::array<Index, 128> stack;
        std::size_t top = 0;
        stack[top++] = 0;
        while (top > 0) {
            const Index at = stack[--top];
            const BoxTree::Node& node = tree.nodes[at];
            if (far(at) > least) continue;
            if (node.count == 0) {
                const bool first = far(node.first) <= far(node.first + 1);
                stack[top++] = first ? node.first + 1 : node.first;  // the nearer one comes off first
                stack[top++] = first ? node.first : node.first + 1;
            }
            for (Index slot = node.first; slot < node.first + node.count; ++slot) {
                const Index i = tree.items[slot];
                const double d = (samples.places[i] - q).squaredNorm();
                if (d < least || (d == least && i < found)) least = d, found = i;
            }
        }
        return samples.directions[found];
    }
};

}  // namespace

FibreSamples fibres_from_csv(std::string_view text, std::string_view name) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // as spreadsheets begin UTF-8 with
    std::string_view heading = take(text, '\n');
    std::size_t column_of[6];
    std::fill(std::begin(column_of), std::end(column_of), std::string_view::npos);
    std::size_t width = 0;
    for (; !heading.empty() || width == 0; ++width) {
        const std::string_view title = trimmed(take(heading, ','));
        for (std::size_t k = 0; k < 6; ++k)
            if (title == columns[k]) column_of[k] = width;
    }
    for (std::size_t k = 0; k < 6; ++k)
        if (column_of[k] == std::string_view::npos)
            throw InputError(fmt::format("{}:1: no column '{}'; a field of fibres has {}", name, columns[k],
                                         fmt::join(columns, ", ")));
    FibreSamples samples;
    for (std::size_t line = 2; !text.empty(); ++line) {
        std::string_view row = trimmed(take(text, '\n'));
        if (row.empty()) continue;
        double value[6];
        bool read[6] = {};
        for (std::size_t column = 0; !row.empty(); ++column) {
            std::string_view cell = trimmed(take(row, ','));
            if (cell.size() > 1 && cell[0] == '+' && cell[1] != '-') cell.remove_prefix(1);
            for (std::size_t k = 0; k < 6; ++k) {
                if (column_of[k] != column) continue;
                const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value[k]);
                read[k] = error == std::errc() && end == cell.data() + cell.size() && std::isfinite(value[k]);
            }
        }
        for (std::size_t k = 0; k < 6; ++k)
            if (!read[k])
                throw InputError(
                    fmt::format("{}:{}: column '{}' is missing or no number", name, line, columns[k]));
        samples.places.push_back({value[0], value[1], value[2]});
        samples.directions.push_back({value[3], value[4], value[5]});
        if (!(samples.directions.back().stableNorm() > 0))
            throw InputError(fmt::format("{}:{}: the fibre has no direction", name, line));
    }
    require(samples, name);
    return samples;
}

FibreSamples read_fibres(const std::filesystem::path& file) {
    if (file.extension() == ".vtp") {
        VtpData vtp = read_vtp(file);
        FibreSamples samples;
        samples.places = std::move(vtp.positions);
        for (const auto& [name, values] : vtp.fields)
            if (name == "fibre" && values.size() == 3 * samples.places.size())
                for (std::size_t i = 0; i + 2 < values.size(); i += 3)
                    samples.directions.push_back({values[i], values[i + 1], values[i + 2]});
        if (samples.directions.size() != samples.places.size())
            throw InputError(fmt::format(
                "{}: no field 'fibre' of three numbers a point, as 'innerspring estimate --vtp' writes it",
                file.string()));
        require(samples, file.string());
        return samples;
    }
    std::error_code failed;
    std::ifstream in(file, std::ios::binary);
    if (!in || std::filesystem::is_directory(file, failed))
        throw InputError(fmt::format("{}: cannot be read; is it there, and a file?", file.string()));
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    return fibres_from_csv(text, file.string());
}

std::function<Vector(const Vector&)> nearest_fibre(FibreSamples samples) {
    BoxTree tree = build_point_tree(samples.places, 8);
    const auto shared = std::make_shared<const Nearest>(Nearest{std::move(samples), std::move(tree)});
    return [shared](const Vector& q) { return (*shared)(q); };
}

}  // namespace innerspring
