#include "fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/error.h"

namespace innerspring::viewer {

namespace {

struct Name {
    std::string_view name, legend, meaning;
};

const Name& name_of(ColourBy colour) {
    static constexpr Name names[] = {
        {"plain", "", "no colours"},
        {"displacement", "displacement [m]", "how far each vertex is from where it rests, |x - q|"},
        {"m", "vertex mass m [kg]", "Eqs. 1 and 2"},
        {"K", "inner spring K [N/m]", "Eq. 3"},
        {"strain", "surface strain [%]", "change of the area around each vertex"},
        {"pressure", "pressure [Pa]", "what the inner spring bears, K (h - x).n / A"},
        {"contact", "contact pressure [Pa]", "what tools press with, normal force over the vertex's area"},
        {"spacing", "length of edges at rest [m]", "short where the surface was refined"}};
    return names[std::size_t(colour)];
}

}  // namespace

std::string_view to_string(ColourBy colour) {
    return name_of(colour).name;
}
std::string_view legend_of(ColourBy colour) {
    return name_of(colour).legend;
}
std::string_view meaning_of(ColourBy colour) {
    return name_of(colour).meaning;
}

ColourBy parse_colour(std::string_view text) {
    std::string names;
    for (ColourBy colour : all_colours) {
        if (text == to_string(colour)) return colour;
        names += fmt::format("{}{}", names.empty() ? "" : ", ", to_string(colour));
    }
    throw InputError(fmt::format("colour '{}': expected one of {}", text.substr(0, 40), names));
}

void make_drawn(const BodySnapshot& body, ColourBy colour, Drawn& drawn) {
    const Surface& s = *body.surface;
    const std::size_t n = s.rest.size();
    drawn.x.resize(n);
    for (std::size_t i = 0; i < n; ++i)
        drawn.x[i] = s.rest[i] + Vector(body.u[i][0], body.u[i][1], body.u[i][2]);
    drawn.normals = vertex_normals(drawn.x, s.triangles);
    drawn.values.clear();
    if (colour == ColourBy::plain) return;
    if (colour == ColourBy::mass) drawn.values = s.m;
    if (colour == ColourBy::stiffness) drawn.values = s.K;
    if (colour == ColourBy::spacing) drawn.values = s.spacing;
    if (colour == ColourBy::displacement) {
        drawn.values.resize(n);
        for (std::size_t i = 0; i < n; ++i)
            drawn.values[i] = std::hypot(double(body.u[i][0]), double(body.u[i][1]), double(body.u[i][2]));
    }
    if (colour == ColourBy::strain) {
        drawn.values = vertex_areas(drawn.x, s.triangles);
        for (std::size_t i = 0; i < n; ++i) drawn.values[i] = 100 * (drawn.values[i] / s.area[i] - 1);
    }
    if (colour == ColourBy::contact && body.simulated) {
        drawn.values.assign(n, 0);
        for (const auto& [vertex, pascal] : body.pressed) drawn.values[vertex] = pascal;
    }
    if (colour == ColourBy::pressure && !s.K.empty()) {
        drawn.values.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            const Vector u = body.frame.R * s.rest[i] + body.frame.t - drawn.x[i];
            Vector pull = s.K[i] * u;
            if (!s.N.empty()) pull += body.frame.R * (s.N[i] * Vector(body.frame.R.transpose() * u));
            drawn.values[i] = pull.dot(drawn.normals[i]) / s.area[i];
        }
    }
}

ValueRange range_of(std::span<const Drawn> drawn, ColourBy colour) {
    double low = INFINITY, high = -INFINITY;
    for (const Drawn& d : drawn)
        for (double v : d.values)
            if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
    if (low > high) return {};
    if (colour == ColourBy::displacement || colour == ColourBy::contact) low = 0;
    const double size = std::max(std::abs(low), std::abs(high));
    if (size < 1e-280) return {0, 1, true};
    if (high - low < 1e-6 * size) return {low - 0.5 * size, high + 0.5 * size};
    return {low, high};
}

}  // namespace innerspring::viewer
