#include "innerspring/mesh/geometry.h"

#include <cmath>
#include <numbers>

namespace innerspring {

double volume(Positions x, Triangles triangles) {
    // Eq. 4: V = (1/3) sum_t (A_t/3) n_t . (x_1 + x_2 + x_3). With A_t n_t = (x_2-x_1) x (x_3-x_1) / 2 each
    // term is the signed tetrahedron x_1 . (x_2 x x_3) / 6; taking x relative to one vertex changes nothing
    // on a closed surface.
    if (triangles.empty()) return 0;
    const Vector o = x[triangles[0][0]];
    double six_v = 0;
    for (const Triangle& t : triangles) six_v += (x[t[0]] - o).dot((x[t[1]] - o).cross(x[t[2]] - o));
    return six_v / 6;
}

Vector volume_centroid(Positions x, Triangles triangles) {
    if (triangles.empty()) return Vector::Zero();
    const Vector o = x[triangles[0][0]];
    double six_v = 0;
    Vector moment = Vector::Zero();
    for (const Triangle& t : triangles) {
        const Vector a = x[t[0]] - o, b = x[t[1]] - o, c = x[t[2]] - o;
        const double v = a.dot(b.cross(c));
        six_v += v;
        moment += v * (a + b + c);
    }
    return o + moment / (4 * six_v);
}

Vector vertex_mean(Positions x) {
    Vector sum = Vector::Zero();
    for (const Vector& p : x) sum += p;
    return x.empty() ? sum : Vector(sum / double(x.size()));
}

std::vector<double> triangle_areas(Positions x, Triangles triangles) {
    std::vector<double> areas(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t)
        areas[t] = double_area_vector(x, triangles[t]).norm() / 2;
    return areas;
}

std::vector<double> vertex_areas(Positions x, Triangles triangles) {
    std::vector<double> areas(x.size(), 0.0);
    for (const Triangle& t : triangles) {
        const double third = double_area_vector(x, t).norm() / 6;
        for (Index i : t) areas[i] += third;
    }
    return areas;
}

std::vector<Vector> vertex_normals(Positions x, Triangles triangles) {
    std::vector<Vector> normals(x.size(), Vector::Zero());
    for (const Triangle& t : triangles) {
        const Vector n = double_area_vector(x, t);
        for (Index i : t) normals[i] += n;
    }
    for (Vector& n : normals) {
        const double length = n.norm();
        n = length > 0 ? Vector(n / length) : Vector(Vector::Zero());
    }
    return normals;
}

Index nearest_vertex(Positions x, const Vector& point) {
    Index nearest = 0;
    for (Index i = 1; i < x.size(); ++i)
        if ((x[i] - point).squaredNorm() < (x[nearest] - point).squaredNorm()) nearest = i;
    return nearest;
}

std::pair<Vector, Vector> bounding_box(Positions x) {
    if (x.empty()) return {Vector::Zero(), Vector::Zero()};
    Vector lower = x[0], upper = x[0];
    for (const Vector& p : x) {
        lower = lower.cwiseMin(p);
        upper = upper.cwiseMax(p);
    }
    return {lower, upper};
}

double volume_radius(double volume_m3) {
    return std::cbrt(3 * std::abs(volume_m3) / (4 * std::numbers::pi));
}

double normalize(SurfaceMesh& mesh, double radius) {
    const Vector centre = volume_centroid(mesh.positions, mesh.triangles);
    const double factor = radius / volume_radius(volume(mesh));
    for (Vector& p : mesh.positions) p = factor * (p - centre);
    return factor;
}

}  // namespace innerspring
