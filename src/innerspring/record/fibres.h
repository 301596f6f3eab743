#pragma once
#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

/// Directions of fibres at places of the body at rest.
struct FibreSamples {
    std::vector<Vector> places;      ///< [m]
    std::vector<Vector> directions;  ///< [1], none zero
};

/// A VTP file with the vector field `fibre` on its points, as `estimate --vtp` writes it, or CSV with a line
/// of headings, of which x_m, y_m, z_m, fibre_x, fibre_y and fibre_z are read. Throws InputError
/// "FILE: ...", with the line of a CSV.
FibreSamples read_fibres(const std::filesystem::path& file);
FibreSamples fibres_from_csv(std::string_view text, std::string_view name);

/// The direction of the nearest sample, for Anisotropy::field.
std::function<Vector(const Vector&)> nearest_fibre(FibreSamples samples);

}  // namespace innerspring
