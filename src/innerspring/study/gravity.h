#pragma once
#include "innerspring/record/picture.h"
#include "innerspring/record/series.h"
#include "innerspring/study/setting.h"

namespace innerspring {

// The paper's Figs. 7 and 8: gravity on a held body, for schemes A, B, C and several centres.

/// A centre to try. `offset_share` is how far it lies from the volume centroid along gravity, in R; it is not
/// known for local centres, which are many (NaN).
struct NamedCentre {
    std::string name;
    CentreOption option;
    double offset_share;
};

/// The study's own centre first (unless it is the centroid, which is then first), the volume centroid, the
/// vertex mean, and points 1, 2, 4 and 8 % of R off the centroid along gravity.
std::vector<NamedCentre> gravity_centres(const Setting& setting);

struct GravityRow {
    Scheme scheme;
    std::string centre;  ///< NamedCentre::name
    double offset_share;
    VolumeVariation volume_variation_percent;
    double displacement_std_m;
    double law_percent;  ///< law 3 with the surface springs: 100 (2 M g / (3 V (E + 3 E_s/R))) g.(centroid -
                         ///< c); NaN for local centres
    std::vector<double> volume_percent;  ///< over time
};

/// A centre about which no body can be built.
struct RefusedCentre {
    std::string centre, reason;
};

struct GravityStudy {
    std::vector<GravityRow> rows;  ///< by centre, then scheme
    std::vector<RefusedCentre> refused;
};

/// Also finds out which centres are refused.
std::vector<Job> gravity_jobs(const Setting& setting, std::vector<RefusedCentre>& refused);
GravityStudy gravity_study(const Setting& setting, const Responses& responses,
                           std::vector<RefusedCentre> refused);

/// Fig. 7: schemes B and C at rest under gravity, with one range of colours.
Image gravity_picture(const Setting& setting, const Painter& paint = draw);

}  // namespace innerspring
