#pragma once
#include <filesystem>
#include <string_view>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

enum class MeshFormat { obj, stl_text, stl_binary, ply, off };

/// Largest accepted coordinate: beyond it areas and volumes could overflow.
inline constexpr double largest_coordinate = 1e30;

/// Reads a mesh file as it stands: vertices in file order (STL: three per triangle, unwelded), polygons cut
/// into fans. The format is recognised by content, the extension only settles ties. Throws InputError
/// "FILE:LINE: what is wrong" (or "FILE: byte N: ..." for binary files): unreadable file, unknown format,
/// index out of range, not a number, non-finite or huge coordinate, truncated data, no triangle.
SurfaceMesh read(const std::filesystem::path& file);

/// The same from memory; `name` stands for the file in messages and its extension settles ties.
/// Never allocates more than 64 times the size of `bytes` (plus a constant).
SurfaceMesh read_from_memory(std::string_view bytes, std::string_view name);

/// The format of `bytes`, by content; throws InputError if it is none of ours.
MeshFormat detect_format(std::string_view bytes, std::string_view name);

}  // namespace innerspring
