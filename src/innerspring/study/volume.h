#pragma once
#include <optional>

#include "innerspring/study/setting.h"

namespace innerspring {

// Fig. 9 again with Poisson's ratio, ours: how much volume a push costs at each nu, from small forces to an
// indentation of 0.3 R. Scheme C, patch loads of the force study, equilibria.

inline constexpr double deepest_share =
    0.3;  ///< of R: the indentation that the last force of each vertex makes

struct VolumeRow {
    double poisson;
    Index vertex;
    double force_n, force_group;
    bool deepest;  ///< the force that presses the vertex in by deepest_share R; else one of the groups
    double indentation_share;  ///< displacement of the vertex, of R
    double final_percent;      ///< 100 (V/V_0 - 1)
    double pressure_pa;        ///< of the volume term
};

/// Over the vertices, at one force; or where each is pressed in by deepest_share R (forces are then means).
struct VolumeMean {
    double poisson;
    double force_n = 0, force_group = 0;
    bool deepest = false;
    double indentation_share = 0, final_percent = 0, pressure_pa = 0;
    double largest_percent = 0;  ///< of |final_percent|
    double law_percent, law_pa;  ///< law 2: -100 3F / (4 pi R^2 (E + 3 kappa + 3 E_s/R)), and P of that
};

/// A sphere squeezed by two caps of `bulge_cap` about the ends of an axis, against Lame's series.
struct BulgeRow {
    double poisson, equator, reference_equator;  ///< outward, u E R/F
};
inline constexpr double bulge_cap = 0.3;  ///< half angle [rad]

struct VolumeStudy {
    std::vector<VolumeRow> rows;
    std::vector<VolumeMean> means;  ///< by nu, then force, the deepest last
    std::vector<BulgeRow> bulge;    ///< by nu; spheres only
};

std::vector<Job> volume_jobs(const Setting& setting);
VolumeStudy volume_study(const Setting& setting, const Responses& responses);

}  // namespace innerspring
