#pragma once
#include <span>
#include <utility>
#include <vector>

#include "innerspring/mesh/geometry.h"

namespace innerspring::viewer {

/// Surfaces of revolution about `axis` from `from`: a profile of (along, radius) [m].
void revolve(const Vector& from, const Vector& axis, std::span<const std::pair<double, double>> profile,
             std::vector<Vector>& corners, std::vector<Vector>& normals);

/// The profile of a capsule about its middle; of length 0, a ball's.
std::vector<std::pair<double, double>> capsule(double radius, double length);

}  // namespace innerspring::viewer
