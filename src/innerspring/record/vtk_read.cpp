#include "innerspring/record/vtk_read.h"

#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>

#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

constexpr std::uintmax_t largest_file = std::uintmax_t{4} << 30;  ///< [byte]

std::string read_all(const std::filesystem::path& file) {
    std::error_code failed;
    const auto size = std::filesystem::file_size(file, failed);
    std::ifstream in(file, std::ios::binary);
    if (failed || !in) throw InputError(fmt::format("{}: cannot be read", file.string()));
    if (size > largest_file) throw InputError(fmt::format("{}: too big", file.string()));
    return {std::istreambuf_iterator<char>(in), {}};
}

/// The value of `name="..."` in an element's text.
std::optional<std::string_view> attribute(std::string_view element, std::string_view name) {
    for (std::size_t at = element.find(name); at != std::string_view::npos; at = element.find(name, at + 1)) {
        if (at == 0 || element[at - 1] != ' ' || element.substr(at + name.size(), 2) != "=\"") continue;
        const std::size_t begin = at + name.size() + 2, end = element.find('"', begin);
        if (end == std::string_view::npos) break;
        return element.substr(begin, end - begin);
    }
    return std::nullopt;
}

template <class T>
std::optional<T> number(std::optional<std::string_view> text) {
    T value{};
    if (!text) return std::nullopt;
    const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), value);
    if (error != std::errc() || end != text->data() + text->size()) return std::nullopt;
    return value;
}

/// Calls fn with the text of each `<TAG ...>` within the heading, in order.
template <class Function>
void for_each_element(std::string_view text, std::string_view tag, Function fn) {
    for (std::size_t at = text.find(tag); at != std::string_view::npos; at = text.find(tag, at + 1)) {
        const std::size_t end = text.find('>', at);
        if (end == std::string_view::npos) return;
        fn(text.substr(at, end - at));
    }
}

std::string unescape(std::string_view text) {
    constexpr std::pair<std::string_view, char> names[] = {
        {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}, {"&amp;", '&'}};
    std::string out;
    while (!text.empty()) {
        std::size_t taken = 1;
        char c = text[0];
        for (const auto& [name, meaning] : names)
            if (text.starts_with(name)) taken = name.size(), c = meaning;
        out += c;
        text.remove_prefix(taken);
    }
    return out;
}

struct Array {
    std::string name;
    std::size_t components;
    std::string_view type, bytes;

    template <class T>
    std::vector<T> as() const {
        std::vector<T> values(bytes.size() / sizeof(T));
        if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
        return values;
    }
};

}  // namespace

VtpData vtp_from_memory(std::string_view text, const std::string& name) {
    auto fail = [&](std::string_view what) -> InputError {
        return InputError(
            fmt::format("{}: {}; only files as 'innerspring simulate' writes them can be read", name, what));
    };
    const std::size_t marker = text.find("<AppendedData encoding=\"raw\">");
    if (!text.starts_with("<?xml") || marker == std::string_view::npos)
        throw fail("not a VTP file with raw appended data");
    const std::string_view head = text.substr(0, marker);
    const std::size_t underscore = text.find('_', marker);
    if (underscore == std::string_view::npos) throw fail("its data is missing");
    const std::string_view data = text.substr(underscore + 1);
    if (head.find("header_type=\"UInt64\"") == std::string_view::npos ||
        head.find("byte_order=\"LittleEndian\"") == std::string_view::npos)
        throw fail("another byte order or header");

    std::vector<Array> arrays;
    for_each_element(head, "<DataArray ", [&](std::string_view element) {
        const auto offset = number<std::uint64_t>(attribute(element, "offset"));
        const auto components = number<std::size_t>(attribute(element, "NumberOfComponents"));
        const auto type = attribute(element, "type");
        const auto label = attribute(element, "Name");
        if (!offset || !components || !type || !label || *offset > data.size() || data.size() - *offset < 8)
            throw fail("an array is not described or lies outside the file");
        std::uint64_t size = 0;
        std::memcpy(&size, data.data() + *offset, 8);
        if (size > data.size() - *offset - 8)
            throw fail(fmt::format("array '{}' is cut short", label->substr(0, 60)));
        arrays.push_back({unescape(*label), *components, *type, data.substr(*offset + 8, size)});
    });
    auto find = [&](std::string_view label) -> const Array& {
        for (const Array& a : arrays)
            if (a.name == label) return a;
        throw fail(fmt::format("there is no array '{}'", label));
    };

    VtpData result;
    const Array& points = find("Points");
    if (points.type != "Float64" || points.components != 3)
        throw fail("its points are not three doubles each");
    const std::vector<double> x = points.as<double>();
    for (std::size_t i = 0; i + 2 < x.size(); i += 3) {
        result.positions.push_back({x[i], x[i + 1], x[i + 2]});
        if (!result.positions.back().allFinite()) throw fail(fmt::format("point {} is not finite", i / 3));
    }
    auto indices = [&](const Array& a) {
        if (a.type == "Int64") return a.as<std::int64_t>();
        if (a.type != "Int32") throw fail("its polygons are no integers");
        const std::vector<std::int32_t> narrow = a.as<std::int32_t>();
        return std::vector<std::int64_t>(narrow.begin(), narrow.end());
    };
    const auto corners = indices(find("connectivity")), ends = indices(find("offsets"));
    if (corners.size() % 3 != 0 || ends.size() != corners.size() / 3)
        throw fail("not all of its polygons are triangles");
    for (std::size_t t = 0; t < ends.size(); ++t) {
        if (ends[t] != std::int64_t(3 * t + 3)) throw fail(fmt::format("polygon {} is no triangle", t));
        Triangle triangle;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int64_t i = corners[3 * t + k];
            if (i < 0 || std::size_t(i) >= result.positions.size())
                throw fail(fmt::format("triangle {} names vertex {} of {}", t, i, result.positions.size()));
            triangle[k] = Index(i);
        }
        result.triangles.push_back(triangle);
    }
    if (result.triangles.empty()) throw fail("there is no triangle");
    for (const Array& a : arrays)
        if (a.type == "Float64" && &a != &points &&
            a.bytes.size() == 8 * a.components * result.positions.size())
            result.fields.emplace_back(a.name, a.as<double>());
    return result;
}

VtpData read_vtp(const std::filesystem::path& file) {
    return vtp_from_memory(read_all(file), file.string());
}

std::vector<Frame> read_pvd(const std::filesystem::path& file) {
    const std::string text = read_all(file);
    if (text.find("<VTKFile type=\"Collection\"") == std::string::npos)
        throw InputError(fmt::format("{}: not a collection of frames", file.string()));
    std::vector<Frame> frames;
    for_each_element(text, "<DataSet ", [&](std::string_view element) {
        const auto time = number<double>(attribute(element, "timestep"));
        const auto name = attribute(element, "file");
        if (!time || !name || !std::isfinite(*time))
            throw InputError(
                fmt::format("{}: frame {} has no time or no file", file.string(), frames.size()));
        const std::string path = unescape(*name);
        if (std::filesystem::path(path).is_absolute() || path.find("..") != std::string::npos)
            throw InputError(
                fmt::format("{}: frame {} lies outside its folder", file.string(), frames.size()));
        if (!frames.empty() && !(*time >= frames.back().time))
            throw InputError(fmt::format("{}: frame {} comes before the last", file.string(), frames.size()));
        frames.push_back({*time, path});
    });
    return frames;
}

}  // namespace innerspring
