#pragma once
#include <array>
#include <string_view>

#include "innerspring/body/refine.h"
#include "innerspring/mesh/refine.h"
#include "innerspring/record/scene.h"
#include "innerspring/study/cases.h"

namespace innerspring {

/// What is asked of the studies. Lengths are shares of the volume radius R.
struct StudyOptions {
    int vertices = 12;             ///< where forces act, spread over the surface; 2 .. 1000
    int forces = 8;                ///< from F/(E R^2) = 1e-4 to 1e-1, the decades among them; 4 .. 100
    int levels = 2;                ///< of refinement: 1 .. 4
    double influence_share = 0.4;  ///< radius of influence of a patch load
    double region_share = 0.5;     ///< triangles within this of the loaded vertex are refined
    std::vector<double> poisson = {0, 0.3, 0.45, 0.49, 0.5};  ///< of the volume study, increasing; 0 .. 1/2
};

enum class LoadKind { patch, point };
inline constexpr std::array load_kinds = {LoadKind::patch, LoadKind::point};
std::string_view to_string(LoadKind load);

enum class DensityClass { sampled, coarsest, densest };
inline constexpr std::array density_classes = {DensityClass::sampled, DensityClass::coarsest,
                                               DensityClass::densest};
std::string_view to_string(DensityClass density);

inline constexpr std::array schemes = {Scheme::A, Scheme::B, Scheme::C};

/// A sampled vertex whose surroundings cannot be refined.
struct RefusedVertex {
    Index vertex;
    std::string reason;
};

/// What the studies share: the bodies of schemes A, B and C, where, how hard and for how long they are
/// loaded.
struct Setting {
    StudyOptions options;
    std::string material_name;
    std::array<std::shared_ptr<const Body>, 3> bodies;  ///< in the order of `schemes`
    Vector gravity = Vector::Zero();                    ///< [m/s^2]
    std::vector<Index> sampled;                         ///< spread over the whole surface
    std::vector<Index> coarsest;         ///< spread over the tenth of the vertices of largest A_i
    std::vector<Index> densest;          ///< and of least A_i
    std::vector<Index> refinable;        ///< those of `sampled` whose surroundings can be refined
    std::vector<RefusedVertex> refused;  ///< the others
    std::vector<Vector> inward;          ///< unit normal into the solid, per vertex
    std::vector<double> force_groups;    ///< F/(E R^2), increasing
    double influence_m = 0, region_m = 0;
    bool sphere =
        false;  ///< all vertices at one distance of the centre within 2 %: where laws 2 and 3 are exact
    Sampling sampling;
    std::vector<std::string> notes;  ///< of the mesh

    const Body& body(Scheme scheme = Scheme::C) const { return *bodies[std::size_t(scheme)]; }
    double force_n(double group) const;  ///< F = group E R^2 [N]
    const std::vector<Index>& vertices(DensityClass density) const;
};

/// Throws InputError: a mesh that cannot become a body, a bad material or option.
Setting set_up_study(const Scene& scene, const StudyOptions& options);

/// A hash of everything the responses of the cases depend on.
std::uint64_t setting_hash(const Setting& setting);

/// `count` of `among` spread over the surface (farthest-point sampling, Gonzalez 1985): the first is farthest
/// from the mean of the mesh's vertices, each next one farthest from those before it. All if there are no
/// more.
std::vector<Index> spread_vertices(const SurfaceMesh& mesh, std::span<const Index> among, std::size_t count);

/// `count` groups from 1e-4 to 1e-1, log spaced, the nearest ones moved onto 1e-3 and 1e-2.
std::vector<double> log_spaced_groups(int count);

/// The triangles around a loaded vertex that are refined.
std::vector<Index> region_of(const Setting& setting, Index vertex);

/// The load of one case on a body, coarse or refined: vertices keep their index.
Loads study_load(const Setting& setting, const Body& body, LoadKind load, Index vertex, double force_n);

/// "patch C 0 417 0.01": a load on the mesh refined `levels` times about the vertex; `scheme` tells A_total
/// from A_node on a refined mesh.
std::string case_key(LoadKind load, std::string_view scheme, int levels, Index vertex, double group);

/// The cases of one vertex on the unrefined body of a scheme: every load kind and force.
Job coarse_job(const Setting& setting, Scheme scheme, Index vertex);

}  // namespace innerspring
