#pragma once
#include "renderer.h"

namespace innerspring::viewer {

/// A rectangle of the window [point], from the upper left.
struct Box2 {
    double x = 0, y = 0, width = 0, height = 0;
};

/// What is written over a body's picture, between Gui::begin and end: its name and state, the colours with
/// their unit, and a scale bar, which is true at the depth of the focus.
void draw_overlay(const Snapshot& snapshot, std::size_t body, ColourBy colour, const ValueRange& range,
                  const Camera& camera, const Box2& box, double scale);

/// Where a point is seen [point].
std::array<double, 2> project(const Camera& camera, const Box2& box, const Vector& place);

/// A bar's length [m]: a round number at most `most`.
double round_length(double most);
/// "20 cm".
std::string length_text(double metres);

}  // namespace innerspring::viewer
