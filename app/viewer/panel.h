#pragma once
#include <optional>

#include "commands.h"
#include "overlay.h"
#include "plots.h"

namespace innerspring::viewer {

enum class Grip { hold, push, touch, refine, lasso };

/// The tool under the pointer.
struct Ball {
    double radius = 0.25;   ///< in volume radii
    bool capsule = false;   ///< instead: four radii long in all, across the picture
    double friction = 0.3;  ///< Coulomb's coefficient [1]
};

/// What the user has set, beside what the body itself knows.
struct PanelState {
    bool open = true;
    bool help = false;
    Look look;
    Grip grip = Grip::hold;
    std::optional<std::size_t> body;  ///< of two: the one that scheme and sliders are for
    double influence = 0.35;          ///< radius of influence, in volume radii
    double push_share = 0.01;         ///< force of a push, in E R^2
    Ball ball;
    Vector gravity = Vector(0, -9.81, 0);  ///< as it is when it is on [m/s^2]
    double tilt = 0, towards = 0;  ///< where it goes: from -y, and about y from z [degree]; see turn_gravity
    /// While a slider is moved: what its ends are told from.
    std::optional<Material> before_slider;
};

/// What was asked for in this frame.
struct PanelActions {
    std::vector<Command> commands;
    std::optional<bool> pause;
    bool step = false;
    std::optional<double> speed;
    bool fit = false;
    bool down = false;    ///< gravity goes down in the picture
    bool replay = false;  ///< the session from its beginning
    bool picture = false, vtp = false, scene = false, recording = false;
};

/// The panel's width [point].
inline double panel_width(double scale) {
    return 330 * scale;
}

/// The panel in `box` if it is open and fits, the help over the middle if it is asked for, and the message.
PanelActions draw_panel(const Snapshot& snapshot, const History& history, PanelState& state, const Box2& box,
                        bool fits, double scale);

/// Gravity and its angles, of each other.
void set_gravity(PanelState& state, const Vector& gravity);
void turn_gravity(PanelState& state, double tilt, double towards);

/// The keys and what they do.
struct Shortcut {
    const char *keys, *what;
};
std::span<const Shortcut> shortcuts();

}  // namespace innerspring::viewer
