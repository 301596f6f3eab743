#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace innerspring {

using Vector = Eigen::Vector3d;
using Index = std::uint32_t;
inline constexpr Index no_index = std::numeric_limits<Index>::max();

/// Three vertex indices, counter-clockwise seen from outside.
using Triangle = std::array<Index, 3>;

/// A triangle surface. Indices are in range wherever a SurfaceMesh is passed on by this library;
/// closedness and orientation are what check() reports and build_body() requires.
struct SurfaceMesh {
    std::string name;                 ///< file name or shape, for messages
    std::vector<Vector> positions;    ///< [m] unless no unit is known yet, one per vertex
    std::vector<Triangle> triangles;  ///< one per triangle
};

}  // namespace innerspring
