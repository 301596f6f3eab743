#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

enum class PlyEncoding { ascii, binary_little, binary_big };

/// Writes by the extension of `file` (.obj .stl (binary) .ply (binary little endian) .off); doubles survive
/// the round trip except in STL, which holds float. Written to a temporary name beside it and renamed: the
/// file is whole or not there. Throws InputError for an unknown extension, RunError if writing fails.
void write(const SurfaceMesh& mesh, const std::filesystem::path& file);

std::string to_obj(const SurfaceMesh& mesh);
std::string to_off(const SurfaceMesh& mesh);
std::string to_ply(const SurfaceMesh& mesh, PlyEncoding encoding = PlyEncoding::binary_little);
std::string to_stl_text(const SurfaceMesh& mesh);
std::string to_stl_binary(const SurfaceMesh& mesh);

/// Writes `bytes` to a temporary name beside `file`, then renames. Throws RunError naming the file and the
/// reason.
void write_whole(const std::filesystem::path& file, std::string_view bytes);

}  // namespace innerspring
