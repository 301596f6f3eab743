#pragma once
#include "overlay.h"

namespace innerspring::viewer {

/// "label   value" of a panel, between ImGui::Begin and End.
void draw_row(const char* label, const std::string& value);

/// What the haptic loop reports so far, inside a window.
void draw_live(const FeltHand& felt);

/// The device's point, the proxy and the way between them, over the body's picture.
void draw_felt(const FeltHand& felt, const Camera& camera, const Box2& box, double scale);

}  // namespace innerspring::viewer
