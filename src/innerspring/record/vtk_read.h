#pragma once
#include <filesystem>
#include <utility>

#include "innerspring/record/vtk.h"

namespace innerspring {

/// What to_vtp() wrote: fields of one or three values per vertex, one vertex after another.
struct VtpData {
    std::vector<Vector> positions;  ///< [m]
    std::vector<Triangle> triangles;
    std::vector<std::pair<std::string, std::vector<double>>> fields;
};

/// Reads files in the layout that to_vtp() writes, whole: triangles only, raw appended binary. Throws
/// InputError "FILE:
/// ..." for anything else or damage; indices are in range, positions finite.
VtpData read_vtp(const std::filesystem::path& file);
VtpData vtp_from_memory(std::string_view bytes, const std::string& name);

/// Frames of a collection that to_pvd() wrote, in order. Throws InputError; a file outside the collection's
/// folder is refused.
std::vector<Frame> read_pvd(const std::filesystem::path& file);

}  // namespace innerspring
