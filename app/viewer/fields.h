#pragma once
#include <string>
#include <string_view>

#include "snapshot.h"

namespace innerspring::viewer {

/// What the colours of a body say.
enum class ColourBy { plain, displacement, mass, stiffness, strain, pressure, contact, spacing };
inline constexpr ColourBy all_colours[] = {ColourBy::plain,     ColourBy::displacement, ColourBy::mass,
                                           ColourBy::stiffness, ColourBy::strain,       ColourBy::pressure,
                                           ColourBy::contact,   ColourBy::spacing};

std::string_view to_string(ColourBy colour);   ///< "displacement"
ColourBy parse_colour(std::string_view text);  ///< throws InputError with the names there are
std::string_view legend_of(ColourBy colour);   ///< "displacement [m]"
std::string_view meaning_of(ColourBy colour);  ///< one line

struct ValueRange {
    double low = 0, high = 0;  ///< equal: nothing is coloured
    bool zero = false;         ///< there was nothing but zeros
};

/// A body ready to be drawn.
struct Drawn {
    std::vector<Vector> x;        ///< [m]
    std::vector<Vector> normals;  ///< outward, length 1
    std::vector<double> values;   ///< as ColourBy says; none for plain, or where the recording has none
};
void make_drawn(const BodySnapshot& body, ColourBy colour, Drawn& drawn);

/// Of all bodies, from 0 for displacements and contact; a little room around a constant.
ValueRange range_of(std::span<const Drawn> drawn, ColourBy colour);

}  // namespace innerspring::viewer
