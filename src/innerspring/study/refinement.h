#pragma once
#include "innerspring/study/setting.h"

namespace innerspring {

// The paper's Fig. 6: the same force before and after the surface around it is refined and its properties are
// re-estimated. What should not change does change; how much, for each scheme?

/// A scheme with what its mean stiffness becomes on the refined mesh.
struct Variant {
    std::string_view name;
    Scheme scheme;
    MeanStiffness mean;
};
inline constexpr std::array variants = {Variant{"A_total", Scheme::A, MeanStiffness::recomputed},
                                        Variant{"A_node", Scheme::A, MeanStiffness::kept},
                                        Variant{"B", Scheme::B, MeanStiffness::recomputed},
                                        Variant{"C", Scheme::C, MeanStiffness::recomputed}};

/// Displacement over time on the coarse and on the refined mesh, compared.
struct Deviation {
    double coarse_final_m = 0, refined_final_m = 0;
    double ratio = 0;  ///< refined / coarse, at the end [1]
    double mean_m = 0,
           std_m = 0;  ///< over time: mean of |coarse - refined|, standard deviation of coarse - refined
    double mean_relative = 0, std_relative = 0;  ///< over the coarse displacement at the end [1]
};
Deviation deviation(std::span<const double> coarse_m, std::span<const double> refined_m);

/// One force on one vertex.
struct RefinementRow {
    LoadKind load;
    std::string_view scheme;  ///< Variant::name
    int levels;
    Index vertex;
    double force_n, force_group;
    Deviation
        measured;  ///< patch: of the displacement of the load (kernel-weighted mean); point: of the vertex
    Deviation vertex_own;
};

/// The mean of rows over the vertices.
struct RefinementMean {
    LoadKind load;
    std::string_view scheme;
    int levels;
    double force_n, force_group;
    Deviation measured, vertex_own;
    double ratio_least = 0, ratio_largest = 0;  ///< of measured.ratio over the vertices
};

struct RefinementStudy {
    std::vector<RefinementRow> rows;
    std::vector<RefinementMean> means;
};

std::vector<Job> refinement_jobs(const Setting& setting);
RefinementStudy refinement_study(const Setting& setting, const Responses& responses);

/// Key of the coarse case that a variant is compared with, and of the refined one.
std::string coarse_key(const Variant& variant, LoadKind load, Index vertex, double group);
std::string refined_key(const Variant& variant, LoadKind load, int levels, Index vertex, double group);

/// What is compared: the load's displacement for a patch, the vertex's own for a point.
const std::vector<double>& measured(LoadKind load, const Response& response);

}  // namespace innerspring
