#pragma once
// Private to the readers: one function per format, and what they share.
#include <cstdint>
#include <string>
#include <string_view>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

SurfaceMesh read_obj(std::string_view bytes, std::string_view name);
SurfaceMesh read_stl_text(std::string_view bytes, std::string_view name);
SurfaceMesh read_stl_binary(std::string_view bytes, std::string_view name);
SurfaceMesh read_ply(std::string_view bytes, std::string_view name);
SurfaceMesh read_off(std::string_view bytes, std::string_view name);

/// The token in quotes, cut to 40 characters, whatever is not printable ASCII escaped.
std::string quoted(std::string_view token);

[[noreturn]] void fail_in_file(std::string_view name, std::string_view message);  ///< "NAME: ..."
[[noreturn]] void fail_at_line(std::string_view name, std::size_t line,
                               std::string_view message);  ///< "NAME:LINE: ..."
[[noreturn]] void fail_at_byte(std::string_view name, std::size_t byte,
                               std::string_view message);  ///< "NAME: byte N: ..."

/// Why a coordinate cannot be used and what to do; empty if it can.
std::string_view coordinate_fault(double x);

/// More vertices than Index can tell apart?
inline bool is_full(const SurfaceMesh& mesh) {
    return mesh.positions.size() >= no_index;
}
inline constexpr std::string_view full_message =
    "more than 4294967294 vertices; cut the mesh into smaller files";

/// Where a vertex may be named before it is defined: the largest index so far and its place, judged at the
/// end of the file.
struct LargestIndex {
    std::uint64_t value = 0;
    std::size_t place = 0;
    bool any = false;

    void see(std::uint64_t index, std::size_t where) {
        if (any && index <= value) return;
        value = index, place = where, any = true;
    }
};

/// Cuts a polygon, given corner by corner, into the fan around its first corner.
struct Fan {
    SurfaceMesh& mesh;
    Index first = 0, last = 0;
    std::size_t corners = 0;

    void add(Index corner) {
        if (corners == 0) first = corner;
        if (corners >= 2) mesh.triangles.push_back({first, last, corner});
        last = corner;
        ++corners;
    }
};

}  // namespace innerspring
