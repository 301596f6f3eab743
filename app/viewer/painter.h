#pragma once
#include "innerspring/record/picture.h"

namespace innerspring::viewer {

/// Draws what draw() of record/picture.h does with the window's renderer, off screen, for pictures with y up;
/// the others as draw() itself. To be called in the thread that made it. Throws RunError without OpenGL 3.3.
Painter make_painter();

/// The same; where there is no OpenGL 3.3, draw() itself.
Painter best_painter();

}  // namespace innerspring::viewer
