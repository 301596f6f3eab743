#pragma once
#include <string>

#include "innerspring/mesh/check.h"
#include "innerspring/record/run.h"

namespace innerspring {

// Machine-readable results; the keys are stable and described in docs/formats.md. SI units.

std::string to_json(const Summary& summary);
std::string to_json(const CheckReport& report, const std::string& mesh_name);

/// What `innerspring estimate` found.
struct EstimateReport {
    Subject subject;
    Estimate estimate;
    double largest_stable_step_s = 0;
    std::vector<std::string> warnings;
};
std::string to_json(const EstimateReport& report);

}  // namespace innerspring
