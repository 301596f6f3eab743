#pragma once
#include "innerspring/record/series.h"
#include "innerspring/study/setting.h"

namespace innerspring {

// The paper's Fig. 9: how much volume a force costs, over the whole surface and where the mesh is coarse or
// dense.

struct ForceRow {
    LoadKind load;
    Scheme scheme;
    Index vertex;
    DensityClass density;
    double force_n, force_group;
    VolumeVariation volume_variation_percent;
};

/// Over the vertices of a class.
struct ForceMean {
    LoadKind load;
    Scheme scheme;
    DensityClass density;
    double force_n, force_group;
    VolumeVariation volume_variation_percent;  ///< each the mean over the vertices
    double final_std_percent = 0,
           final_spread_percent = 0;  ///< of the final variation: standard deviation, max - min
    double law_percent = 0;           ///< law 2: -100 3F / (4 pi R^2 (E + 3 E_s/R))
};

struct ForceStudy {
    std::vector<ForceRow> rows;
    std::vector<ForceMean> means;
};

std::vector<Job> force_jobs(const Setting& setting);
ForceStudy force_study(const Setting& setting, const Responses& responses);

}  // namespace innerspring
