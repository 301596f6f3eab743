#include "innerspring/record/draw_text.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "innerspring/record/font.h"

namespace innerspring {
namespace {

constexpr double pitch = glyph_width + 1;  // [cell] from glyph to glyph
constexpr double pen = 0.46;               // [cell] half the width of a stroke
constexpr double text_grey = 45;

bool starts_character(char byte) {
    return (static_cast<unsigned char>(byte) & 0xC0) != 0x80;
}

struct Stroke {
    double x0, y0, x1, y1;  // [cell] from the left end of the base line, y downwards
};

// The bitmap read as strokes between neighbouring cells: smooth at every size.
std::vector<Stroke> strokes_of(char c) {
    std::vector<Stroke> strokes;
    for (int row = 0; row < glyph_height; ++row) {
        for (int column = 0; column < glyph_width; ++column) {
            if (!ink(c, column, row)) continue;
            const double x = column + 0.5, y = row + 0.5 - glyph_ascent;
            strokes.push_back({x, y, x, y});
            const bool right = ink(c, column + 1, row), left = ink(c, column - 1, row),
                       below = ink(c, column, row + 1);
            if (right) strokes.push_back({x, y, x + 1, y});
            if (below) strokes.push_back({x, y, x, y + 1});
            // A diagonal only where no corner cell joins the two already.
            if (!below && !right && ink(c, column + 1, row + 1)) strokes.push_back({x, y, x + 1, y + 1});
            if (!below && !left && ink(c, column - 1, row + 1)) strokes.push_back({x, y, x - 1, y + 1});
        }
    }
    return strokes;
}

double distance(const Stroke& s, double x, double y) {
    const double dx = s.x1 - s.x0, dy = s.y1 - s.y0, length2 = dx * dx + dy * dy;
    const double t = length2 > 0 ? std::clamp(((x - s.x0) * dx + (y - s.y0) * dy) / length2, 0.0, 1.0) : 0.0;
    return std::hypot(x - s.x0 - t * dx, y - s.y0 - t * dy);
}

}  // namespace

double text_width(std::string_view text, double scale) {
    return static_cast<double>(std::count_if(text.begin(), text.end(), starts_character)) * pitch * scale;
}

void draw_text(Image& image, double x, double y, std::string_view text, double scale, bool upward) {
    double start = 0;  // [pixel] of the glyph along the line
    for (const char byte : text) {
        if (!starts_character(byte)) continue;
        const std::vector<Stroke> strokes = strokes_of(byte);
        const double left = start - scale, right = start + pitch * scale;
        const double top = -(glyph_ascent + 1) * scale, bottom = 3 * scale;
        start += pitch * scale;
        // The glyph's box on the image.
        const double x0 = upward ? x + top : x + left, x1 = upward ? x + bottom : x + right;
        const double y0 = upward ? y - right : y + top, y1 = upward ? y - left : y + bottom;
        const int row_end = static_cast<int>(std::clamp(std::ceil(y1), 0.0, double(image.height)));
        const int column_end = static_cast<int>(std::clamp(std::ceil(x1), 0.0, double(image.width)));
        for (int row = static_cast<int>(std::clamp(std::floor(y0), 0.0, double(image.height))); row < row_end;
             ++row) {
            for (int column = static_cast<int>(std::clamp(std::floor(x0), 0.0, double(image.width)));
                 column < column_end; ++column) {
                const double dx = column + 0.5 - x, dy = row + 0.5 - y;
                const double along = upward ? -dy : dx, down = upward ? dx : dy;
                double nearest = std::numeric_limits<double>::infinity();
                for (const Stroke& s : strokes)
                    nearest = std::min(nearest, distance(s, (along - left) / scale - 1, down / scale));
                const double cover = std::clamp((pen - nearest) * scale + 0.5, 0.0, 1.0);
                if (cover == 0) continue;
                std::uint8_t* const pixel =
                    &image.rgb[3 * (static_cast<std::size_t>(row) * image.width + column)];
                for (int k = 0; k < 3; ++k)
                    pixel[k] =
                        static_cast<std::uint8_t>(std::lround(pixel[k] + cover * (text_grey - pixel[k])));
            }
        }
    }
}

}  // namespace innerspring
