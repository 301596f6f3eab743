#pragma once
#include "innerspring/study/force.h"
#include "innerspring/study/gravity.h"
#include "innerspring/study/refinement.h"
#include "innerspring/study/volume.h"

namespace innerspring {

enum class Outcome {
    holds,
    holds_only_if,  ///< for some of what was measured; Claim::condition says which
    fails,
    not_judged  ///< what it needs could not be measured; Claim::condition says why
};
std::string_view to_string(Outcome outcome);  ///< "holds", "holds only if", "fails", "not judged"

/// A claim, and what our numbers say to it. The outcome follows from the numbers and the threshold alone.
struct Claim {
    std::string id;             ///< stable key
    std::string source;         ///< the paper's figure, or the law of docs/physics.md
    std::string claim;          ///< what is claimed
    std::string measured = {};  ///< what was found, in words with numbers
    Outcome outcome = Outcome::not_judged;
    std::string condition = {};
    double number = 0;       ///< what is compared with the threshold
    double threshold = 0;    ///< number at most this: holds
    std::string unit = {};   ///< of both
    std::string study = {};  ///< "refinement", "gravity", "force" or "volume": the command that shows it
};

std::vector<Claim> claims_of(const Setting& setting, const RefinementStudy& study);
std::vector<Claim> claims_of(const Setting& setting, const GravityStudy& study);
std::vector<Claim> claims_of(const Setting& setting, const ForceStudy& study);
std::vector<Claim> claims_of(const Setting& setting, const VolumeStudy& study);

}  // namespace innerspring
