#include "innerspring/record/picture.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>

#include "innerspring/record/colours.h"
#include "innerspring/record/draw_text.h"
#include "innerspring/record/raster.h"

namespace innerspring {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Vector unit_or(const Vector& v, const Vector& fallback) {
    const Vector u = v.stableNormalized();
    return u.allFinite() && u.squaredNorm() > 0.5 ? u : fallback;
}

View view_of(const PictureOptions& options, Positions frame, const Rectangle& part) {
    View view;
    view.back = unit_or(-options.look, Vector(0, 0, 1));
    Vector up = unit_or(options.up, Vector(0, 1, 0));
    if (up.cross(view.back).norm() < 1e-9)
        up = std::abs(view.back.y()) < 0.9 ? Vector(0, 1, 0) : Vector(0, 0, -1);
    view.right = up.cross(view.back).normalized();
    view.up = view.back.cross(view.right);

    Vector low = Vector::Constant(infinity), high = -low;
    for (const Vector& p : frame) {
        const Vector q(view.right.dot(p), view.up.dot(p), view.back.dot(p));
        if (!q.allFinite()) continue;
        low = low.cwiseMin(q);
        high = high.cwiseMax(q);
    }
    view.column = (part.left + part.right) / 2;
    view.row = (part.top + part.bottom) / 2;
    if (low.x() > high.x()) return view;
    view.middle = 0.5 * low + 0.5 * high;
    const Vector size = high - low;
    const double fit =
        0.94 * std::min((part.right - part.left) / size.x(), (part.bottom - part.top) / size.y());
    if (std::isfinite(fit) && fit > 0) view.scale = fit;
    return view;
}

// The colours' range: as asked for, else from the values; none where neither says.
std::optional<Range> range_of(std::span<const double> values, const PictureOptions& options) {
    Range range{infinity, -infinity};
    for (const double v : values) {
        if (!std::isfinite(v)) continue;
        range.low = std::min(range.low, v);
        range.high = std::max(range.high, v);
    }
    if (std::isfinite(options.low) && std::isfinite(options.high) && options.low != options.high)
        range = {std::min(options.low, options.high), std::max(options.low, options.high)};
    if (range.low > range.high) return std::nullopt;
    range.low = std::clamp(range.low, -1e300, 1e300);
    range.high = std::clamp(range.high, -1e300, 1e300);
    // Room about a constant, which rounding would otherwise spread over all colours.
    const double size = std::max(std::abs(range.low), std::abs(range.high));
    if (size < 1e-280) return Range{-1, 1};
    if (range.high - range.low < 1e-9 * size) return Range{range.low - 0.5 * size, range.high + 0.5 * size};
    return range;
}

struct Bar {
    Range range;
    Ticks ticks;
    double text;       // [pixel] of a font cell
    double wide;       // [pixel] of the colours
    double label_gap;  // [pixel] from the colours to the labels
    double labels;     // [pixel] widest label
    double width;      // [pixel] of all, with the legend
};

Bar bar_of(const Range& range, const PictureOptions& options, double text) {
    Bar bar{range, round_ticks(range.low, range.high), text, 11 * text, 6 * text, 0, 0};
    for (const std::string& label : bar.ticks.labels)
        bar.labels = std::max(bar.labels, text_width(label, text));
    // Room for six characters whatever the labels, so that pictures that differ in range only agree in scale.
    bar.width = bar.wide + bar.label_gap + std::max(bar.labels, text_width("000000", text)) +
                (options.legend.empty() ? 0 : 14 * text);
    return bar;
}

void fill(Image& image, double left, double top, double right, double bottom, const Colour& colour) {
    const auto pixel = [](double v, int end) {
        return static_cast<int>(std::clamp(std::round(v), 0.0, double(end)));
    };
    for (int row = pixel(top, image.height); row < pixel(bottom, image.height); ++row) {
        for (int column = pixel(left, image.width); column < pixel(right, image.width); ++column) {
            for (int k = 0; k < 3; ++k)
                image.rgb[3 * (static_cast<std::size_t>(row) * image.width + column) + k] =
                    static_cast<std::uint8_t>(std::lround(255 * colour[k]));
        }
    }
}

void draw_bar(const Bar& bar, const std::string& legend, double left, double top, double bottom,
              Image& image) {
    constexpr Colour line = {0.35, 0.35, 0.35};
    const double thick = std::max(1.0, std::round(0.5 * bar.text));
    left = std::round(left), top = std::round(top), bottom = std::round(bottom);
    const double right = left + std::round(bar.wide), tall = bottom - top;
    fill(image, left - thick, top - thick, right + thick, bottom + thick, line);
    for (double row = top; row < bottom; ++row)
        fill(image, left, row, right, row + 1, map_colour((bottom - row - 0.5) / tall));
    for (std::size_t i = 0; i < bar.ticks.values.size(); ++i) {
        const double y =
            bottom - tall * (bar.ticks.values[i] - bar.range.low) / (bar.range.high - bar.range.low);
        fill(image, right + thick, y - thick / 2, right + 0.6 * bar.label_gap, y + thick / 2, line);
        draw_text(image, right + bar.label_gap + thick, y + 3.5 * bar.text, bar.ticks.labels[i], bar.text);
    }
    if (bar.ticks.exponent != 0)
        draw_text(image, left, top - 6 * bar.text, fmt::format("x 1e{}", bar.ticks.exponent), bar.text);
    const double length = text_width(legend, 1),
                 size = std::min(bar.text, 1.1 * tall / std::max(length, 1.0));
    draw_text(image, right + bar.label_gap + bar.labels + 12 * bar.text,
              (top + bottom) / 2 + length * size / 2, legend, size, true);
}

}  // namespace

Image draw(Positions x, Triangles triangles, std::span<const double> values, const PictureOptions& options,
           Positions frame) {
    Image image;
    image.width = std::clamp(options.width, 16, 8192);
    image.height = std::clamp(options.height, 16, 8192);
    image.rgb.assign(std::size_t{3} * image.width * image.height, 255);

    assert(values.empty() || values.size() == x.size());
    // Text grows with the picture; too small a picture has none.
    const double width = image.width, height = image.height;
    const double text = std::max(1.15, std::min(width, height) / 330), margin = 7 * text;
    Rectangle part{0, 0, width, height};
    if (!options.title.empty() && height > 60) part.top = 17 * text;
    std::optional<Bar> bar;
    const std::optional<Range> range = range_of(values, options);
    if (range && width > 120 && height > 100) {
        bar = bar_of(*range, options, text);
        if (bar->width + 2 * margin > 0.5 * width) bar.reset();
    }
    if (bar) part.right -= bar->width + 2 * margin;

    Drawing drawing = drawing_of(x, triangles, view_of(options, frame.empty() ? x : frame, part));
    const bool coloured = !values.empty() && values.size() == x.size();
    drawing.values = values;
    if (coloured) drawing.range = range;
    drawing.edges = options.edges;
    drawing.edge_width = std::max(0.8, 0.5 * text);
    draw_surface(drawing, part, image);

    if (part.top > 0) {
        const double length = text_width(options.title, 1),
                     size = std::min(1.15 * text, (width - 2 * margin) / length);
        const double left =
            std::min((part.left + part.right - length * size) / 2, width - margin - length * size);
        draw_text(image, std::max(left, margin), 12.5 * text, options.title, size);
    }
    if (bar && coloured && !drawing.triangles.empty()) {
        const double inset = 0.14 * (part.bottom - part.top);
        draw_bar(*bar, options.legend, part.right + margin, part.top + inset, part.bottom - inset, image);
    }
    return image;
}

Image beside(std::span<const Image> images) {
    Image row;
    for (const Image& image : images) {
        row.width += image.width;
        row.height = std::max(row.height, image.height);
    }
    row.rgb.assign(std::size_t{3} * row.width * row.height, 255);
    std::size_t left = 0;
    for (const Image& image : images) {
        const std::size_t bytes = std::size_t{3} * image.width;
        for (int y = 0; y < image.height; ++y)
            std::copy_n(image.rgb.data() + bytes * y, bytes,
                        row.rgb.data() + 3 * (std::size_t(row.width) * y + left));
        left += image.width;
    }
    return row;
}

}  // namespace innerspring
