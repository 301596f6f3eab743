#pragma once
#include <array>
#include <memory>
#include <string>
#include <vector>

#include <optional>

#include "innerspring/body/body.h"
#include "innerspring/sim/forces.h"

namespace innerspring {
class BodySide;
struct LoopReport;
enum class ServoHealth;
}  // namespace innerspring

namespace innerspring::viewer {

class Rig;

using Point = std::array<float, 3>;

/// What of a body changes only when it is refined, tuned or replaced. Shared between threads, never changed.
struct Surface {
    std::string name;
    std::vector<Vector> rest;  ///< q_i [m]
    std::vector<Triangle> triangles;
    std::vector<Edge> edges;
    std::vector<double> area;     ///< A_i [m^2]
    std::vector<double> spacing;  ///< mean length of the edges at each vertex, at rest [m]
    std::vector<double> m;        ///< [kg]
    std::vector<double> K;        ///< [N/m]
    std::vector<double> L;        ///< distance to the vertex's centre [m]
    std::vector<Symmetric> N;     ///< of an anisotropic body: see Body::N; else empty
    std::vector<Vector> fibre;    ///< and where it is stiffest [1], at rest
    Centre centre;
    Vector lower = Vector::Zero(), upper = Vector::Zero();  ///< box at rest [m]
    double radius = 1;                                      ///< volume radius R [m]
    std::uint64_t mesh_version = 0;                         ///< another one: other triangles
};

/// A force as it acts now.
struct Pull {
    Vector newton = Vector::Zero();  ///< [N]
    Vector place = Vector::Zero();   ///< weighted mean of the vertices it acts on [m]
    double radius = 0;               ///< of influence [m]
    bool hand = false;               ///< the user's, not the scene's
};

/// A tool as it is now, and what it does to the body.
struct TouchingTool {
    Tool tool;                       ///< its path is where it is
    Vector newton = Vector::Zero();  ///< on the body [N]
    Vector place = Vector::Zero();   ///< where the force's line comes out of the tool [m]
    bool hand = false;               ///< the user's, not the scene's
    const Pose& pose() const { return tool.path.front().pose; }
};

/// A body at one moment.
struct BodySnapshot {
    std::shared_ptr<const Surface> surface;
    std::vector<Point> u;  ///< displacement x_i - q_i [m], per vertex
    HomeFrame frame;
    Scheme scheme = Scheme::C;
    Material material;
    std::string_view integrator, precision;
    int substeps = 0;
    double volume_variation_percent = 0, kinetic = 0, elastic = 0, potential = 0;  ///< [J]
    double pressure = 0;          ///< of the volume term [Pa]
    double max_displacement = 0;  ///< [m]
    double step_ms = 0;           ///< time of a step
    std::vector<Pull> pulls;
    std::vector<TouchingTool> tools;
    std::vector<std::pair<Index, double>> pressed;  ///< vertices that tools press on, and how hard [Pa]
    std::vector<Index> pinned;
    bool simulated = true;  ///< false: a frame of a recording, of which only the surface is known
};

/// The hand on a haptic device.
struct FeltHand {
    Vector device = Vector::Zero(),
           proxy = Vector::Zero();  ///< where it is, and where the tool is to be [m], scene
    Vector force = Vector::Zero();  ///< on the hand [N]
    ServoHealth health{};
    bool heard = false;                        ///< of the above
    std::shared_ptr<const LoopReport> report;  ///< so far; null before the first
};

struct Snapshot {
    std::vector<BodySnapshot> bodies;
    std::optional<FeltHand> felt;
    double time = 0;  ///< [s]
    double dt = 0;    ///< [s]
    std::uint64_t ticks = 0;
    Vector gravity = Vector::Zero();
    double real_time_factor = 0;  ///< seconds simulated per second, over the last half second
    double steps_per_second = 0;
    double speed = 1;  ///< asked for
    bool paused = false, replaying = false;
    std::string message;      ///< the last thing refused, or why it stopped
    std::uint64_t said = 0;   ///< messages so far
    std::uint64_t taken = 0;  ///< snapshots so far
};

/// Copies what is to be seen of the rig, or of a body that is felt. Surfaces are made anew only where those
/// of the snapshot before are of another version.
class Capture {
  public:
    void operator()(const Rig& rig, Snapshot& into);
    void operator()(const BodySide& side, std::size_t tool, Snapshot& into);

  private:
    struct Known {
        std::shared_ptr<const Surface> surface;
        std::uint64_t version = 0;
    };
    std::vector<Known> known_;
};

/// Of all forces on a body, their sizes added up [N].
double force_sum(const BodySnapshot& body);

/// Of all that tools do to a body [N].
double tool_force_sum(const BodySnapshot& body);
/// The largest of the pressures by tools [Pa].
double most_pressure(const BodySnapshot& body);
/// How long a force's arrow is drawn [m]: it grows with the root of the force; E R^2 makes 1.5 R.
double arrow_length(const BodySnapshot& body, double newton);
/// A tool where it is at a time [s].
TouchingTool tool_at(const Tool& tool, double time);

/// A surface as the renderer needs it.
Surface surface_of(const SurfaceMesh& rest);

}  // namespace innerspring::viewer
