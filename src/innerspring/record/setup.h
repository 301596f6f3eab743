#pragma once
#include "innerspring/body/estimate.h"
#include "innerspring/record/scene.h"
#include "innerspring/sim/refiner.h"

namespace innerspring {

/// A mesh ready for build_body and what was done to it.
struct LoadedMesh {
    SurfaceMesh mesh;                ///< welded, in metres
    std::vector<std::string> notes;  ///< merged and dropped vertices, scaling: one line each
};

/// Makes a built-in shape or reads a file, welds it, and brings it to metres: by `unit` ("mm", "cm", "m"),
/// or, where `normalize` says so or no unit is known, to unit volume radius with the centroid at the origin.
/// `weld` is the tolerance in the unit of the file.
LoadedMesh load_mesh(const std::string& mesh, const std::string& unit, std::optional<bool> normalize,
                     double weld_tolerance);

/// A scene made concrete.
struct Setup {
    Body body;
    Loads loads;
    std::vector<RefineRule> refine;
    std::vector<std::string> notes;
};
Setup set_up(const Scene& scene);

/// What was estimated or simulated: the head of every result.
struct Subject {
    std::string mesh_name;
    std::size_t vertices = 0, triangles = 0;
    double volume_m3 = 0;
    Scheme scheme = Scheme::C;
    Centre centre;
    std::string material_name;
    Material material;  ///< resolved
    Groups groups;      ///< with the weight under the scene's gravity and its largest force
};
Subject describe(const Scene& scene, const Setup& setup);

/// A force of the scene on this body: place, direction, weights and profile worked out. Throws InputError.
Force to_force(const SceneForce& force, const Body& body);
Pin to_pin(const ScenePin& pin, const Body& body);
Tool to_tool(const SceneTool& tool);  ///< reads its mesh

}  // namespace innerspring
