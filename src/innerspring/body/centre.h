#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "innerspring/mesh/geometry.h"

namespace innerspring {

enum class CentreKind { automatic, centroid, given, kernel, local };

std::string_view to_string(CentreKind kind);

/// Which centre the virtual tetrahedra hang on (docs/physics.md, section 2).
struct CentreOption {
    CentreKind kind = CentreKind::automatic;
    Vector position = Vector::Zero();  ///< [m], for given
};

/// "auto", "centroid", "kernel", "local" or "X,Y,Z" [m]. Throws InputError.
CentreOption parse_centre(std::string_view text);

/// The centre a body was built with.
struct Centre {
    CentreKind kind = CentreKind::centroid;  ///< never automatic
    Vector position =
        Vector::Zero();  ///< [m]; for local the volume centroid, which only homes and messages refer to
    std::string reason;  ///< why this one, one line
    double scale = 1;    ///< for local: s, the factor that makes the virtual tetrahedra sum to V
};

/// The point of the mesh's kernel nearest to `target`: at least `margin` [m] inside the plane of every
/// triangle. Nothing if there is none, i.e. the shape is not star-shaped by that margin. Expected linear time
/// (Seidel's incremental method).
std::optional<Vector> kernel_point(const SurfaceMesh& mesh, const Vector& target, double margin);

}  // namespace innerspring
