#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "innerspring/sim/step.h"

namespace innerspring {

/// Where a force acts and how: one [[force]] table. Exactly one of vertex/near and one of newton/inward.
struct SceneForce {
    std::string name;
    std::optional<std::int64_t> vertex;              ///< index in the welded mesh
    std::optional<Vector> near;                      ///< [m]: the vertex nearest to this point, after scaling
    std::optional<Vector> newton;                    ///< [N]
    std::optional<double> inward;                    ///< [N] along the inward normal of the vertex
    double radius = 0;                               ///< [m] radius of influence; 0: a point force
    double start = 0;                                ///< [s]
    std::optional<double> end;                       ///< [s]
    double ramp = 0;                                 ///< [s] of linear onset (and release)
    std::vector<std::pair<double, double>> profile;  ///< [[time_s, factor], ...] instead of start, end, ramp
};

/// Vertices held or moved: one [[pin]] table. vertices, or near with radius.
struct ScenePin {
    std::vector<std::int64_t> vertices;
    std::optional<Vector> near;                   ///< [m]
    double radius = 0;                            ///< [m] all vertices within it; 0: the nearest one
    std::vector<std::pair<double, Vector>> path;  ///< [[time_s, dx, dy, dz], ...] in metres
};

/// Refinement during the run: one [[refine]] table. One of at (with vertex or near), edge_share and
/// tool_share.
struct SceneRefine {
    std::optional<double> at;            ///< [s]: once, around vertex or near
    std::optional<std::int64_t> vertex;  ///< index in the welded mesh
    std::optional<Vector> near;          ///< [m]: the vertex nearest to this point
    double radius = 0;                   ///< [m] from that vertex, straight through space
    std::optional<double> edge_share;  ///< around patch forces while they act: no edge longer than this share
                                       ///< of the radius of influence
    std::optional<double> tool_share;  ///< under and around tools: no edge longer than this share of their
                                       ///< radius
    int levels = 1;                    ///< without at: at most so many
};

/// A rigid thing that touches the body: one [[tool]] table. Exactly one of radius (a sphere, with length a
/// capsule), mesh and normal (a plane), and one of at and path.
struct SceneTool {
    std::string name;
    std::optional<double> radius;  ///< [m]
    double length = 0;             ///< [m] of a capsule's axis, without the round ends
    std::string mesh;              ///< a file (relative to the scene) or a built-in shape, about its origin
    double scale = 1;              ///< metres per unit of the mesh
    std::optional<Vector> normal;  ///< out of the plane, towards the body
    std::optional<Vector> axis;    ///< where the z axis of a capsule or mesh points; default: z
    double friction = 0;           ///< Coulomb's coefficient [1]
    std::optional<Vector> at;      ///< [m]: it rests there
    /// [[time_s, x, y, z], ...] in metres, or [[time_s, x, y, z, w, i, j, k], ...] with a rotation w + i, j,
    /// k that comes after the one by axis or normal.
    std::vector<std::array<double, 8>> path;
};

/// How the body is felt: the [haptic] table. The tool in the hand is the first [[tool]], wherever it says it
/// is.
struct SceneHaptic {
    std::string device = "simulated";  ///< device: "simulated", "openhaptics", "forcedimension",
                                       ///< "spacenavigator", "mouse" or "replay:FILE"
    double rate = 1000;                ///< rate_hz of the servo, 30 to 4000
    double body_rate = 200;            ///< body_rate_hz: steps of the body
    double metres = 0;       ///< workspace_scale: metres of the scene per metre of the hand; 0: auto
    double newtons = 0;      ///< force_scale: newtons at the hand per newton of the body; 0: auto
    double stiffness = 0;    ///< coupling_n_m; 0: what is passive on the device
    bool controller = true;  ///< controller: of passivity
};

/// All that a simulation needs, as a scene file says it. Keys of the file are given behind each member; units
/// are SI.
struct Scene {
    std::string mesh = "sphere";          ///< mesh: a file (relative to the scene) or a built-in shape
    std::string unit;                     ///< unit: "mm", "cm" or "m"; empty: unknown
    std::optional<bool> normalize;        ///< normalize: to unit volume radius; default: files without a unit
    double weld = 0;                      ///< weld: tolerance in the unit of the file
    std::string material_name = "paper";  ///< [material] name
    Material material;  ///< [material] mass_kg, density_kg_m3, young_pa, surface_n_m, surface_ratio,
                        ///< damping_ratio, poisson; [anisotropy] kind, along_pa, across_pa, one of
                        ///< direction, around (through, pitch_deg), outward and field, moduli_pa, axes
    Scheme scheme = Scheme::C;  ///< [body] scheme
    CentreOption centre;        ///< [body] centre = "auto" | "centroid" | "kernel" | "local" | [x, y, z]
    bool free = false;          ///< [body] free
    Vector gravity = Vector(0, -9.81, 0);  ///< [simulation] gravity_m_s2
    double duration = 2;                   ///< [simulation] duration_s
    StepOptions step;  ///< [simulation] dt_s, integrator, precision, threads, max_substeps, tolerance,
                       ///< max_iterations, linearised
    bool equilibrium = false;  ///< [simulation] equilibrium: solve for balance instead of stepping
    double residual_n = 0;     ///< [simulation] residual_n
    int every = 10;  ///< [simulation] every: a frame each so many steps; 0: only the first and the last
    std::vector<SceneForce> forces;   ///< [[force]]
    std::vector<ScenePin> pins;       ///< [[pin]]
    std::vector<SceneRefine> refine;  ///< [[refine]]
    std::vector<SceneTool> tools;     ///< [[tool]]
    SceneHaptic haptic;               ///< [haptic]
};

/// Reads a scene file. Throws InputError "FILE:LINE: ...": not TOML, an unknown key (naming the nearest known
/// one), a wrong type, a value out of range. A relative mesh file is resolved against the scene's folder.
Scene read_scene(const std::filesystem::path& file);
Scene scene_from_text(std::string_view toml, std::string_view name);

/// One force or pin as on the command line: the inside of a TOML inline table, "vertex = 12, inward = 0.01,
/// radius = 0.4" (braces optional).
SceneForce parse_force(std::string_view text);
ScenePin parse_pin(std::string_view text);
SceneRefine parse_refine(std::string_view text);
SceneTool parse_tool(std::string_view text);
Anisotropy parse_directions(std::string_view text);  ///< also a kind alone

/// The whole scene as TOML with every key said, readable by scene_from_text to the same bits.
std::string to_toml(const Scene& scene);

/// Every file that the scene names (meshes of body and tools, a field of fibres, a recorded hand; not
/// built-in shapes) gets the name that `renamed` gives for it.
void rename_files(Scene& scene, const std::function<std::string(const std::string&)>& renamed);

}  // namespace innerspring
