#pragma once
#include <optional>
#include <span>
#include <vector>

#include "innerspring/record/picture.h"

namespace innerspring {

struct View {
    Vector right, up, back;          ///< unit axes; `back` points to the eye
    double scale = 1;                ///< [pixel/m]
    Vector middle = Vector::Zero();  ///< of what is seen, in these axes [m]
    double column = 0, row = 0;      ///< of the middle [pixel]
};

struct Range {
    double low, high;
};

/// Part of a picture [pixel], y downwards.
struct Rectangle {
    double left, top, right, bottom;
};

/// A surface ready to be drawn.
struct Drawing {
    View view;
    std::vector<Vector> corners;      ///< column, row, nearness to the eye [pixel], one per vertex
    std::vector<Vector> normals;      ///< unit, one per vertex
    std::vector<Triangle> triangles;  ///< those that can be drawn
    std::span<const double> values;   ///< one per vertex if there is a range
    std::optional<Range> range;       ///< of the colours; none: plain
    bool edges = true;
    double edge_width = 1;  ///< [pixel]
};

/// Keeps the triangles that can be drawn and finds their normals; x may hold NaN, triangles indices out of
/// range.
Drawing drawing_of(Positions x, Triangles triangles, const View& view);

/// Draws the drawing, cut to `part`, on white.
void draw_surface(const Drawing& drawing, const Rectangle& part, Image& image);

}  // namespace innerspring
