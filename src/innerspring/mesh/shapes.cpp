#include "innerspring/mesh/shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/geometry.h"
#include "innerspring/mesh/nearest_name.h"
#include "innerspring/mesh/shape_families.h"

namespace innerspring {

namespace {

struct Key {
    std::string_view name;
    double least, most, normal;  // `normal` is the default
    bool whole = false;
};

/// The values of a shape's keys, in the order of its table.
using Values = std::span<const double>;

struct Shape {
    std::string_view name;
    std::vector<Key> keys;
    SurfaceMesh (*make)(Values);
    bool normalised;  // radius is then the volume radius, else the maker has applied it
};

constexpr Key vertices_key{"vertices", 12, 5e6, 1000, true};
constexpr Key seed_key{"seed", 0, 0x1p53, 1, true};
constexpr Key radius_key{"radius", 1e-6, 1e6, 1};

// Every table begins with vertices, seed, radius.
Index vertices_of(Values v) {
    return Index(v[0]);
}
std::uint64_t seed_of(Values v) {
    return std::uint64_t(v[1]);
}
double radius_of(Values v) {
    return v[2];
}

const std::vector<Shape>& shapes() {
    constexpr Key v = vertices_key, s = seed_key, r = radius_key;
    static const std::vector<Shape> table{
        {"sphere",
         {v, s, r, {"irregularity", 1, 50, 3}},
         [](Values k) { return irregular_sphere(vertices_of(k), seed_of(k), k[3], radius_of(k)); },
         false},
        {"icosphere", {v, s, r}, [](Values k) { return icosphere(vertices_of(k), radius_of(k)); }, false},
        {"ellipsoid",
         {v, s, r, {"a", 0.01, 100, 2}, {"b", 0.01, 100, 1}, {"c", 0.01, 100, 1}},
         [](Values k) { return ellipsoid(vertices_of(k), seed_of(k), k[3], k[4], k[5]); },
         true},
        {"breast", {v, s, r}, [](Values k) { return breast(vertices_of(k), seed_of(k)); }, true},
        {"capsule",
         {v, s, r, {"aspect", 1, 20, 2}},
         [](Values k) { return capsule(vertices_of(k), seed_of(k), k[3]); },
         true},
        {"torus",
         {v, s, r, {"ratio", 1.2, 20, 2.5}},
         [](Values k) { return torus(vertices_of(k), seed_of(k), k[3]); },
         true},
        {"dumbbell",
         {v, s, r, {"neck", 0.1, 0.95, 0.5}},
         [](Values k) { return dumbbell(vertices_of(k), seed_of(k), k[3]); },
         true},
        {"plate",
         {v, s, r, {"aspect", 1, 50, 6}},
         [](Values k) { return plate(vertices_of(k), seed_of(k), k[3]); },
         true},
        {"organ",
         {v, s, r, {"bumpiness", 0, 1.5, 1}},
         [](Values k) { return organ(vertices_of(k), seed_of(k), k[3]); },
         true},
    };
    return table;
}

std::string joined(std::span<const std::string_view> names) {
    return fmt::format("{}", fmt::join(names, ", "));
}

std::string suggestion(std::string_view word, std::span<const std::string_view> known) {
    const std::string nearest = nearest_name(word, known);
    return nearest.empty() ? "known: " + joined(known)
                           : fmt::format("did you mean '{}'? Known: {}", nearest, joined(known));
}

const Shape& find_shape(std::string_view name) {
    for (const Shape& shape : shapes())
        if (shape.name == name) return shape;
    throw InputError(fmt::format("unknown shape '{}'; {}", name, suggestion(name, shape_names())));
}

std::size_t find_key(const Shape& shape, std::string_view name) {
    std::vector<std::string_view> known;
    for (const Key& key : shape.keys) {
        if (key.name == name) return known.size();
        known.push_back(key.name);
    }
    throw InputError(
        fmt::format("shape '{}' has no key '{}'; {}", shape.name, name, suggestion(name, known)));
}

double parse_value(const Shape& shape, const Key& key, std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool number = error == std::errc() && end == text.data() + text.size() && !text.empty();
    const bool in_range =
        number && value >= key.least && value <= key.most && (!key.whole || value == std::floor(value));
    if (!in_range)
        throw InputError(fmt::format("shape '{}': {}={} must be a {} from {} to {}", shape.name, key.name,
                                     text, key.whole ? "whole number" : "number", key.least, key.most));
    return value;
}

}  // namespace

SurfaceMesh make_shape(std::string_view specification) {
    const std::size_t colon = specification.find(':');
    const Shape& shape = find_shape(specification.substr(0, colon));
    std::vector<double> values;
    for (const Key& key : shape.keys) values.push_back(key.normal);
    std::vector<bool> given(values.size(), false);

    std::string_view rest = colon == std::string_view::npos ? "" : specification.substr(colon + 1);
    while (!rest.empty()) {
        const std::size_t comma = rest.find(',');
        const std::string_view item = rest.substr(0, comma);
        rest = comma == std::string_view::npos ? "" : rest.substr(comma + 1);
        const std::size_t equals = item.find('=');
        if (equals == std::string_view::npos)
            throw InputError(
                fmt::format("shape '{}': '{}' is not of the form key=value", specification, item));
        const std::size_t k = find_key(shape, item.substr(0, equals));
        if (given[k])
            throw InputError(fmt::format("shape '{}': {} is given twice", specification, shape.keys[k].name));
        given[k] = true;
        values[k] = parse_value(shape, shape.keys[k], item.substr(equals + 1));
    }

    SurfaceMesh mesh = shape.make(values);
    mesh.name = specification;
    if (shape.normalised) normalize(mesh, radius_of(values));
    return mesh;
}

bool is_shape(std::string_view specification) {
    const std::string_view name = specification.substr(0, specification.find(':'));
    return std::ranges::find(shape_names(), name) != shape_names().end();
}

std::span<const std::string_view> shape_names() {
    static const std::vector<std::string_view> names = [] {
        std::vector<std::string_view> all;
        for (const Shape& shape : shapes()) all.push_back(shape.name);
        return all;
    }();
    return names;
}

}  // namespace innerspring
