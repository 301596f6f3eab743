#pragma once
#include "renderer.h"

namespace innerspring::viewer {

/// A rectangle of the window [point], from the upper left.
struct Box2 {
    double x = 0, y = 0, width = 0, height = 0;
};

/// What stands beside a picture, whoever made it.
struct Marks {
    std::vector<std::string> heading;  ///< lines
    std::string legend;                ///< what the colours are, with their unit; empty: none
    ValueRange range;
    Vector gravity = Vector::Zero();
};
/// Heading, legend, a scale bar, which is true at the depth of the focus, and the axes; between Gui::begin
/// and end.
void draw_marks(const Marks& marks, const Camera& camera, const Box2& box, double scale);

/// What is written over a body's picture, between Gui::begin and end: its name and state, the forces at their
/// arrows, and the marks.
void draw_overlay(const Snapshot& snapshot, std::size_t body, ColourBy colour, const ValueRange& range,
                  const Camera& camera, const Box2& box, double scale);

/// How wide the legend's column is [point]; 0 without one.
double legend_room(ColourBy colour, const Box2& box, double scale);

/// Where a point is seen [point].
std::array<double, 2> project(const Camera& camera, const Box2& box, const Vector& place);

/// A bar's length [m]: a round number at most `most`.
double round_length(double most);
/// "20 cm".
std::string length_text(double metres);

}  // namespace innerspring::viewer
