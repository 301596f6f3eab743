#pragma once
#include "innerspring/mesh/geometry.h"

namespace innerspring {

// Signs of determinants. Exact for all finite coordinates that are 0 or between 1e-90 and 1e90 in size: a
// rounding bound decides the clear cases and exact expansion arithmetic the others. The tests below only
// branch on these signs, so they are exact as well.

/// Sign of (b-a) x (c-a) . (d-a): 1 if d lies on the side from which a, b, c turn counter-clockwise, 0 if the
/// four are coplanar.
int orientation(const Vector& a, const Vector& b, const Vector& c, const Vector& d);

/// Sign of the area of a, b, c projected along `axis` (0 x, 1 y, 2 z).
int orientation_along(int axis, const Vector& a, const Vector& b, const Vector& c);

/// True if the closed segment pq and the closed triangle abc have a point in common. False for a triangle
/// without area.
bool segment_meets_triangle(const Vector& p, const Vector& q, const Vector& a, const Vector& b,
                            const Vector& c);

/// True if two triangles of a surface meet anywhere but in the vertices they share: sharing an edge, if they
/// are folded onto each other; sharing one vertex, if they have another point in common; sharing none, if
/// they touch at all. Two triangles with the same three vertices overlap. A triangle without area counts as
/// its sides, and not at all against another such triangle.
bool triangles_cross(Positions x, const Triangle& s, const Triangle& t);

}  // namespace innerspring
