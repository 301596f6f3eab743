#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "innerspring/mesh/geometry.h"

namespace innerspring {

struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  ///< 3 bytes per pixel, rows from the top
};

/// PNG bytes (libpng). Throws RunError.
std::string to_png(const Image& image);

struct PictureOptions {
    int width = 800, height = 600;             ///< [pixel]
    Vector look = Vector(-0.75, -0.45, -0.8);  ///< direction of view, from the eye into the scene
    Vector up = Vector(0, 1, 0);
    std::string title;         ///< drawn above; ASCII
    std::string legend;        ///< what `values` are, with unit; drawn beside the colour bar; ASCII
    double low = 0, high = 0;  ///< range of the colours; equal: from the values
    bool edges = true;         ///< draw the mesh's edges thinly
};

/// An off-screen picture of a surface, smoothly shaded, coloured by one value per vertex (none: plain), with
/// a colour bar in the values' unit: a software rasteriser with a depth buffer; needs no display.
/// Orthographic, fitted to `frame` positions (or to x itself if empty): pictures of the same frame, size,
/// legend and range have the same scale, coloured or plain. Triangles with a corner that is not finite are
/// left out, values that are not finite drawn plain. Width and height are clamped to 16..8192.
Image draw(Positions x, Triangles triangles, std::span<const double> values,
           const PictureOptions& options = {}, Positions frame = {});

/// Who draws a picture: draw(), which works anywhere, or a program's own renderer in its place.
using Painter = std::function<Image(Positions x, Triangles triangles, std::span<const double> values,
                                    const PictureOptions& options, Positions frame)>;

/// Pictures beside each other, top aligned.
Image beside(std::span<const Image> images);

}  // namespace innerspring
