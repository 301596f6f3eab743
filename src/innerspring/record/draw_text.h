#pragma once
#include <string_view>

#include "innerspring/record/picture.h"

namespace innerspring {

/// Width [pixel] of `text` when a cell of the 5x7 font is `scale` pixels; a character that is not ASCII is
/// one box.
double text_width(std::string_view text, double scale);

/// Draws dark text from (x, y), the left end of its base line; `upward`: turned to be read from below.
void draw_text(Image& image, double x, double y, std::string_view text, double scale, bool upward = false);

}  // namespace innerspring
