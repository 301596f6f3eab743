#include "innerspring/record/raster.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "innerspring/record/colours.h"

namespace innerspring {
namespace {

constexpr int samples = 3;     // across a pixel
constexpr int band_rows = 32;  // rows of pixels drawn at a time, so that a large picture needs little memory
constexpr Colour plain = {0.33, 0.45, 0.62};  // of a vertex without a value, linear light
constexpr double infinity = std::numeric_limits<double>::infinity();

// A vertex on the picture: column and row [pixel], nearness to the eye [pixel].
Vector project(const View& view, const Vector& p) {
    return {view.column + view.scale * (view.right.dot(p) - view.middle.x()),
            view.row - view.scale * (view.up.dot(p) - view.middle.y()),
            view.scale * (view.back.dot(p) - view.middle.z())};
}

// Barycentric coordinates as linear functions of the place on the picture.
struct Facet {
    double x, y, x1, y1, x2, y2;  // corner 0; gradients of the second and third coordinate
    double det;                   // twice the area [pixel^2], negative when seen from outside

    Facet(const Vector& a, const Vector& b, const Vector& c) : x(a.x()), y(a.y()) {
        const double bx = b.x() - x, by = b.y() - y, cx = c.x() - x, cy = c.y() - y;
        det = bx * cy - by * cx;
        x1 = cy / det, y1 = -cx / det, x2 = -by / det, y2 = bx / det;
    }
    std::array<double, 3> at(double px, double py) const {
        const double b = (px - x) * x1 + (py - y) * y1, c = (px - x) * x2 + (py - y) * y2;
        return {1 - b - c, b, c};
    }
    // How far [pixel] each coordinate 1 is from the opposite edge.
    std::array<double, 3> heights() const {
        return {1 / std::hypot(x1 + x2, y1 + y2), 1 / std::hypot(x1, y1), 1 / std::hypot(x2, y2)};
    }
};

// ---- light ----

double to_linear(double s) {
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

std::uint8_t to_byte(double linear) {
    constexpr int steps = 1 << 14;
    static const std::vector<std::uint8_t> table = [] {
        std::vector<std::uint8_t> bytes(steps + 1);
        for (int i = 0; i <= steps; ++i) {
            const double l = double(i) / steps,
                         s = l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055;
            bytes[i] = static_cast<std::uint8_t>(std::lround(255 * s));
        }
        return bytes;
    }();
    return table[static_cast<std::size_t>(std::lround(steps * std::clamp(linear, 0.0, 1.0)))];
}

// map_colour at 256ths, in linear light.
const std::array<Colour, 257>& linear_map() {
    static const std::array<Colour, 257> map = [] {
        std::array<Colour, 257> colours;
        for (int i = 0; i <= 256; ++i) {
            colours[i] = map_colour(i / 256.0);
            for (double& c : colours[i]) c = to_linear(c);
        }
        return colours;
    }();
    return map;
}

// Light towards the eye from a surface of that colour; n in view axes, unit.
Colour shade(const Colour& colour, const Vector& n) {
    static const Vector key = Vector(-0.45, 0.65, 0.75).normalized();
    static const Vector half = (key + Vector(0, 0, 1)).normalized();
    const double soft = 0.52 + 0.13 * n.y() + 0.07 * n.x();
    const double rim = std::pow(1 - n.z(), 4);
    const double gloss = std::pow(std::max(0.0, n.dot(half)), 40);
    const double diffuse = soft + 0.55 * std::max(0.0, n.dot(key));
    Colour lit{};
    for (int k = 0; k < 3; ++k) lit[k] = colour[k] * (diffuse + 0.12 * rim) + 0.03 * rim + 0.07 * gloss;
    return lit;
}

Colour colour_at(const Drawing& drawing, const Triangle& t, const std::array<double, 3>& b) {
    if (!drawing.range) return plain;
    const auto [low, high] = *drawing.range;
    const double value =
        b[0] * drawing.values[t[0]] + b[1] * drawing.values[t[1]] + b[2] * drawing.values[t[2]];
    if (!std::isfinite(value)) return plain;
    const double s = 256 * std::clamp((value - low) / (high - low), 0.0, 1.0);
    const auto i = std::min<std::size_t>(255, static_cast<std::size_t>(s));
    Colour colour{};
    for (int k = 0; k < 3; ++k)
        colour[k] = linear_map()[i][k] + (s - double(i)) * (linear_map()[i + 1][k] - linear_map()[i][k]);
    return colour;
}

Colour look_at(const Drawing& drawing, const Triangle& t, double px, double py) {
    const Facet facet(drawing.corners[t[0]], drawing.corners[t[1]], drawing.corners[t[2]]);
    std::array<double, 3> b = facet.at(px, py);
    double edge = infinity;  // [pixel]
    const std::array<double, 3> heights = facet.heights();
    for (int k = 0; k < 3; ++k) {
        b[k] = std::clamp(b[k], 0.0, 1.0);
        edge = std::min(edge, b[k] * heights[k]);
    }
    const Vector world =
        b[0] * drawing.normals[t[0]] + b[1] * drawing.normals[t[1]] + b[2] * drawing.normals[t[2]];
    Vector n(drawing.view.right.dot(world), drawing.view.up.dot(world), drawing.view.back.dot(world));
    if (facet.det > 0) n = -n;  // seen from inside
    n.z() = std::max(n.z(), 0.05 * n.norm() + 1e-9);
    n.normalize();
    Colour colour = shade(colour_at(drawing, t, b), n);
    if (drawing.edges) {
        // Lines fade where the triangles are too small for them.
        const double fade =
            std::clamp((std::sqrt(std::abs(facet.det)) / drawing.edge_width - 4) / 14, 0.0, 1.0);
        const double line = std::clamp(0.5 * drawing.edge_width + 0.5 - edge, 0.0, 1.0);
        for (double& c : colour) c *= 1 - 0.5 * fade * line;
    }
    return colour;
}

// Draws the rows [begin, end) of the picture: first which triangle each sample sees, then its light.
struct Band {
    std::vector<double> nearness;  // one per sample
    std::vector<Index> seen;       // one per sample, no_index: background
};

void rasterise(const Drawing& drawing, const Rectangle& part, int width, int begin, int end, Band& band) {
    const int columns = width * samples;
    band.nearness.assign(static_cast<std::size_t>(columns) * (end - begin) * samples, -infinity);
    band.seen.assign(band.nearness.size(), no_index);
    // First sample at or after a place, in [low, high].
    const auto sample = [](double place, double low, double high) {
        return static_cast<int>(std::clamp(std::ceil(place * samples - 0.5), low, high));
    };
    const int first_row = std::max(begin * samples, sample(part.top, 0, 1e6));
    const int last_row = std::min(end * samples, sample(part.bottom, 0, 1e6));
    for (std::size_t index = 0; index < drawing.triangles.size(); ++index) {
        const Triangle& t = drawing.triangles[index];
        const Vector &a = drawing.corners[t[0]], &b = drawing.corners[t[1]], &c = drawing.corners[t[2]];
        const auto [y_low, y_high] = std::minmax({a.y(), b.y(), c.y()});
        const int row_begin = std::max(first_row, sample(y_low, 0, 1e6)),
                  row_end = std::min(last_row, sample(y_high, -1, 1e6) + 1);
        if (row_begin >= row_end) continue;
        const auto [x_low, x_high] = std::minmax({a.x(), b.x(), c.x()});
        const int column_begin = std::max(sample(part.left, 0, columns), sample(x_low, 0, columns));
        const int column_end = std::min(sample(part.right, 0, columns), sample(x_high, -1, columns) + 1);
        const Facet facet(a, b, c);
        for (int row = row_begin; row < row_end; ++row) {
            const std::size_t start = static_cast<std::size_t>(row - begin * samples) * columns;
            for (int column = column_begin; column < column_end; ++column) {
                const auto w = facet.at((column + 0.5) / samples, (row + 0.5) / samples);
                // The little tolerance leaves no crack between neighbours.
                if (w[0] < -1e-9 || w[1] < -1e-9 || w[2] < -1e-9) continue;
                const double near = w[0] * a.z() + w[1] * b.z() + w[2] * c.z();
                if (near <= band.nearness[start + column]) continue;
                band.nearness[start + column] = near;
                band.seen[start + column] = static_cast<Index>(index);
            }
        }
    }
}

// Mean light of a pixel; a triangle is shaded once, at the mean of its samples.
Colour resolve(const Drawing& drawing, const Band& band, int columns, int begin, int row, int column) {
    Colour sum{};
    int count = 0;
    double x = 0, y = 0;
    Index current = no_index;
    const auto flush = [&] {
        if (count == 0) return;
        const Colour light = current == no_index
                                 ? Colour{1, 1, 1}
                                 : look_at(drawing, drawing.triangles[current], x / count, y / count);
        for (int k = 0; k < 3; ++k) sum[k] += count * std::min(light[k], 1.0);
        count = 0, x = 0, y = 0;
    };
    for (int j = 0; j < samples; ++j) {
        for (int i = 0; i < samples; ++i) {
            const std::size_t place =
                static_cast<std::size_t>((row - begin) * samples + j) * columns + column * samples + i;
            if (band.seen[place] != current) flush();
            current = band.seen[place];
            ++count;
            x += column + (i + 0.5) / samples;
            y += row + (j + 0.5) / samples;
        }
    }
    flush();
    for (double& c : sum) c /= samples * samples;
    return sum;
}

bool drawable(const Triangle& t, std::span<const Vector> corners) {
    for (const Index i : t)
        if (i >= corners.size() || !corners[i].allFinite() || corners[i].cwiseAbs().maxCoeff() > 1e9)
            return false;
    const double det = Facet(corners[t[0]], corners[t[1]], corners[t[2]]).det;
    return std::abs(det) > 1e-12;
}

}  // namespace

Drawing drawing_of(Positions x, Triangles triangles, const View& view) {
    Drawing drawing;
    drawing.view = view;
    drawing.corners.reserve(x.size());
    for (const Vector& p : x) drawing.corners.push_back(project(view, p));
    for (const Triangle& t : triangles)
        if (drawable(t, drawing.corners)) drawing.triangles.push_back(t);
    drawing.normals = vertex_normals(x, drawing.triangles);
    return drawing;
}

void draw_surface(const Drawing& drawing, const Rectangle& part, Image& image) {
    Band band;
    for (int begin = 0; begin < image.height; begin += band_rows) {
        const int end = std::min(begin + band_rows, image.height);
        rasterise(drawing, part, image.width, begin, end, band);
        for (int row = begin; row < end; ++row) {
            for (int column = 0; column < image.width; ++column) {
                const Colour light = resolve(drawing, band, image.width * samples, begin, row, column);
                for (int k = 0; k < 3; ++k)
                    image.rgb[3 * (static_cast<std::size_t>(row) * image.width + column) + k] =
                        to_byte(light[k]);
            }
        }
    }
}

}  // namespace innerspring
