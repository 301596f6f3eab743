#pragma once
#include "overlay.h"
#include "renderer.h"

namespace innerspring::viewer {

/// Everything but the panel: bodies side by side with what is written over them. The window and the pictures
/// off screen are drawn by this.
class Stage {
  public:
    /// Draws into the left `width` points of a framebuffer `pixels` to a point. Called between Gui::begin and
    /// end. `settle` [s]: how much time has passed for the range of colours to shrink in; 0: it fits at once.
    void draw(const Snapshot& snapshot, const Look& look, const Camera& camera, const Box2& box,
              double window_height, double pixels, double scale, double settle);

    /// Which body a point of the window is in, and the ray through it.
    struct Aim {
        std::size_t body;
        Ray ray;
    };
    Aim aim(const Snapshot& snapshot, const Camera& camera, const Box2& box, double x, double y) const;

    const std::vector<Drawn>& drawn() const { return drawn_; }
    const ValueRange& range() const { return range_; }

  private:
    Renderer renderer_;
    std::vector<Drawn> drawn_;
    ValueRange range_;
    ColourBy range_of_ = ColourBy::plain;
};

/// The part of the box that body n of `count` has.
Box2 part_of(const Box2& box, std::size_t n, std::size_t count);

/// Room for the legend beside the last body; two go aside by half of it, so that they are seen alike.
void make_room(Camera& camera, const Snapshot& snapshot, ColourBy colour, const Box2& box, double scale);

/// Looks at all the bodies at rest.
void fit(Camera& camera, const Snapshot& snapshot);

}  // namespace innerspring::viewer
