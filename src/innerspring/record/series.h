#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "innerspring/sim/measure.h"

namespace innerspring {

/// series.csv: a header with units, one row per step, numbers that read back to the same bits.
std::string to_csv(std::span<const Measures> rows, const Loads& loads);

/// The first `count` rows of a series written by to_csv, for resuming; only what the file holds is filled in.
/// Throws InputError if the file is missing, has other columns, or fewer rows.
std::vector<Measures> read_series(const std::filesystem::path& file, std::size_t count, const Loads& loads);

/// Volume variation over a run [%].
struct VolumeVariation {
    double final = 0;  ///< at the end, signed
    double max = 0;    ///< largest absolute value
    double mean = 0;   ///< mean absolute value over the rows
};
VolumeVariation volume_variation(std::span<const double> percent);
VolumeVariation volume_variation(std::span<const Measures> rows);

}  // namespace innerspring
