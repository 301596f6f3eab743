#pragma once
// What every mesh reader promises for any bytes, and weld() for whatever was read.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "allocation_limit.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/read.h"
#include "innerspring/mesh/read_formats.h"
#include "innerspring/mesh/weld.h"

inline void require(bool holds) {
    if (!holds) std::abort();
}

inline void require_valid(const innerspring::SurfaceMesh& mesh) {
    for (const innerspring::Vector& p : mesh.positions)
        for (int i = 0; i < 3; ++i) require(std::abs(p[i]) <= innerspring::largest_coordinate);
    for (const innerspring::Triangle& t : mesh.triangles)
        for (const innerspring::Index v : t) require(v < mesh.positions.size());
}

inline void require_welded(const innerspring::SurfaceMesh& mesh, double tolerance) {
    const innerspring::Welded welded = innerspring::weld(mesh, {.tolerance = tolerance});
    require_valid(welded.mesh);
    require(welded.mesh.triangles.size() == mesh.triangles.size());
    require(welded.new_from_old.size() == mesh.positions.size());
    require(welded.mesh.positions.size() + welded.merged + welded.unused == mesh.positions.size());
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const innerspring::Index kept = welded.new_from_old[v];
        if (kept == innerspring::no_index) continue;
        require(kept < welded.mesh.positions.size());
        const innerspring::Vector d = welded.mesh.positions[kept] - mesh.positions[v];
        require(std::hypot(d[0], d[1], d[2]) <= tolerance);
    }
}

/// The last bytes choose the tolerance of the second welding; the reader sees all of them.
template <class Reader>
int read_and_weld(const std::uint8_t* data, std::size_t size, Reader reader) {
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    const allocation::Limit limit(size);
    try {
        const innerspring::SurfaceMesh mesh = reader(bytes, "fuzz");
        require_valid(mesh);
        require_welded(mesh, 0);
        require_welded(mesh, std::pow(10.0, size == 0 ? 0 : int(data[size - 1] % 64) - 32));
    } catch (const innerspring::InputError& error) {
        const std::string_view message = error.what();
        require(message.starts_with("fuzz:") && message.find('\n') == message.npos && message.size() < 400);
    }
    return 0;
}
