#pragma once
#include <limits>

#include "innerspring/mesh/bvh.h"

namespace innerspring {

/// The point of a triangle nearest to another point.
struct OnTriangle {
    Vector point;                   ///< [m]
    std::array<double, 3> weights;  ///< barycentric, >= 0, sum 1
    int corners() const {           ///< 1: a corner, 2: on a side, 3: inside
        return (weights[0] > 0) + (weights[1] > 0) + (weights[2] > 0);
    }
};

/// By the region of the plane in which p lies (Ericson, Real-Time Collision Detection, 5.1.5).
OnTriangle nearest_on_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c);

/// A closed surface that can be asked for the distance to it. The sign is by the pseudonormal of the nearest
/// face, side or corner, which is right on every closed surface (Baerentzen & Aanaes 2005).
struct DistanceField {
    SurfaceMesh mesh;
    BoxTree tree;                                ///< of the triangles' boxes
    std::vector<Vector> corner_normals;          ///< per vertex, weighted by angle
    std::vector<std::array<Vector, 3>> normals;  ///< per triangle: sum over both sides of (0,1), (1,2), (2,0)
    struct Ball {
        Vector centre;
        double radius;
    };
    std::vector<Ball> balls;  ///< per triangle: it lies within [m]
    double radius = 0;        ///< of the ball about the origin that holds it [m]
};

/// Throws InputError if the surface is not usable (see require_usable).
DistanceField build_distance_field(SurfaceMesh mesh);

struct Nearest {
    double distance = std::numeric_limits<double>::infinity();  ///< [m], negative inside
    Vector normal = Vector::Zero();  ///< unit, where the distance grows fastest; undefined beyond `within`
    Index triangle = no_index;       ///< of a mesh: the nearest, of equals that with the lowest index
};

/// Infinitely far if nothing is within `within` [m].
Nearest nearest(const DistanceField& field, const Vector& p,
                double within = std::numeric_limits<double>::infinity());

/// The triangles within `radius` of a centre [m], if they are few: for many points in the ball one search.
struct NearTriangles {
    Vector centre = Vector::Zero();
    double radius = -1;  ///< < 0: they are too many, ask the field
    Index count = 0;
    std::array<Index, 12> triangles;
    /// Whether the nearest is among them for a point that is at most `distance` from the surface.
    bool answer(const Vector& p, double distance) const { return (p - centre).norm() + distance <= radius; }
    /// It is likely to be the nearest: others are then mostly seen to be farther at a glance.
    void begin_with(Index triangle) {
        for (Index n = 1; n < count; ++n)
            if (triangles[n] == triangle) return std::swap(triangles[0], triangles[n]);
    }
};
NearTriangles triangles_near(const DistanceField& field, const Vector& centre, double radius);

/// The same as without `few`, to the last bit, where they answer(p, within).
Nearest nearest(const DistanceField& field, const NearTriangles& few, const Vector& p, double within);

}  // namespace innerspring
