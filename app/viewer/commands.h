#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "innerspring/record/scene.h"

namespace innerspring::viewer {

// What a user can do to a body. Each is plain data, written into a recording as one line. Places are points
// of the rest shape [m]: the vertex nearest to them is meant, whatever its index is by then.

struct Gravity {
    Vector g = Vector::Zero();  ///< [m/s^2]
};
/// Takes hold of the surface: a spring between the weighted mean of the patch and the hand, without force
/// yet.
struct Grab {
    Vector near = Vector::Zero();  ///< [m]
    double radius = 0;             ///< of influence [m]
};
/// Moves the hand.
struct Drag {
    Vector by = Vector::Zero();  ///< from where it took hold [m]
};
/// A patch force.
struct Push {
    Vector near = Vector::Zero();    ///< [m]
    double radius = 0;               ///< of influence [m]
    Vector newton = Vector::Zero();  ///< [N]
};
/// A ball, or a capsule where `length` is not 0, that touches the body and stays until it is released.
struct Touch {
    double radius = 0;              ///< [m]
    double length = 0;              ///< [m] of a capsule's axis, without the round ends
    double friction = 0;            ///< Coulomb's coefficient [1]
    Vector at = Vector::Zero();     ///< its middle [m]
    Vector axis = Vector::UnitZ();  ///< of a capsule
};
/// Where its middle is to go, and how it is to be turned.
struct MoveTool {
    Vector to = Vector::Zero();    ///< [m]
    Vector turn = Vector::Zero();  ///< since it was taken: the axis, times the angle [radian]
};
/// Ends a grab, a push or a touch.
struct Release {};
/// Another material: mass, young, surface, damping, poisson.
struct Tune {
    Material material;
};
struct SetScheme {
    Scheme scheme = Scheme::C;
};
/// Cuts the triangles within `radius` [m] into four.
struct RefineNear {
    Vector near = Vector::Zero();
    double radius = 0;
};
/// Undoes refinement within `radius` [m], one level.
struct CoarsenNear {
    Vector near = Vector::Zero();
    double radius = 0;
};
/// Holds the vertices nearest to these places where they are at rest.
struct PinAt {
    std::vector<Vector> places;
};
struct Unpin {};
/// Everything as the scene began.
struct Reset {};
/// Everything as before the last command that changed the body, the loads or the material.
struct Undo {};

using Command = std::variant<Gravity, Grab, Drag, Push, Touch, MoveTool, Release, Tune, SetScheme, RefineNear,
                             CoarsenNear, PinAt, Unpin, Reset, Undo>;

/// One line, "push 0 0 1 0.3 0 0 -0.02"; reads back to the same bits.
std::string to_line(const Command& command);
/// Throws InputError saying what is wrong with it.
Command parse_command(std::string_view line);

/// A session written down: the scenes side by side, and what was done before which step. The same bits come
/// out of it on any machine with any number of threads.
struct Recording {
    struct Input {
        std::uint64_t tick = 0;  ///< steps taken before, of all since the beginning
        Command command;
        std::optional<std::size_t> body{};  ///< the only one it is for
    };
    std::vector<Scene> scenes;
    std::vector<Input> inputs;  ///< in order
    std::uint64_t ticks = 0;    ///< steps in all
    std::uint64_t hash = 0;     ///< of the states after them
};

/// Text: a heading, the inputs one a line, then each scene as TOML.
std::string to_text(const Recording& recording);
/// Throws InputError "NAME:LINE: ...".
Recording recording_from_text(std::string_view text, const std::string& name);
/// True for text written by to_text(), by its first line.
bool is_recording(std::string_view text);

}  // namespace innerspring::viewer
