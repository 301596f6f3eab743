#include "innerspring/body/distribution.h"

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/medial.h"

namespace innerspring {

namespace {

void apply_equations(const SurfaceMesh& mesh, double volume_m3, Distribution& d) {
    d.m.assign(mesh.positions.size(), 0.0);
    d.K.assign(mesh.positions.size(), 0.0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& corners = mesh.triangles[t];
        const double L_t = d.L[corners[0]] + d.L[corners[1]] + d.L[corners[2]];
        for (Index i : corners) {
            d.m[i] += share(L_t, d.L[i]) * d.V_t[t] / volume_m3;  // Eqs. 1 and 2, M = 1
            d.K[i] += d.V_t[t] /
                      (d.L[i] * d.L[i]);  // Eq. 3, E = 1; no 1/3: a column from the centre to the surface
        }
    }
}

}  // namespace

double virtual_tetrahedron(const Centre& centre, Positions q, std::span<const double> L, const Triangle& t) {
    if (centre.kind == CentreKind::local)
        return centre.scale * (double_area_vector(q, t).norm() / 2 * (L[t[0]] + L[t[1]] + L[t[2]]) / 9);
    const Vector a = q[t[0]] - centre.position, b = q[t[1]] - centre.position, c = q[t[2]] - centre.position;
    return a.dot(b.cross(c)) / 6;
}

Distribution distribute_about(const SurfaceMesh& mesh, const Vector& centre) {
    Distribution d;
    d.L.reserve(mesh.positions.size()), d.V_t.reserve(mesh.triangles.size());
    for (const Vector& q : mesh.positions) d.L.push_back((q - centre).norm());
    for (const Triangle& t : mesh.triangles)
        d.V_t.push_back(virtual_tetrahedron({CentreKind::given, centre, ""}, mesh.positions, d.L, t));
    apply_equations(mesh, volume(mesh), d);
    return d;
}

Distribution distribute_locally(const SurfaceMesh& mesh) {
    Distribution d;
    d.L = medial_radii(mesh);
    const Centre centre{CentreKind::local, Vector::Zero(), ""};
    const double V = volume(mesh);
    double sum = 0;
    d.V_t.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) {
        d.V_t.push_back(virtual_tetrahedron(centre, mesh.positions, d.L, t));
        sum += d.V_t.back();
    }
    d.scale = V / sum;
    for (double& V_t : d.V_t) V_t *= d.scale;
    apply_equations(mesh, V, d);
    return d;
}

LeastPositive least_positive(const SurfaceMesh& mesh, const Distribution& d) {
    const std::vector<double> A = vertex_areas(mesh.positions, mesh.triangles);
    const double V = volume(mesh);
    LeastPositive least{INFINITY, no_index, 0};
    std::size_t count = 0;
    for (std::size_t i = 0; i < A.size(); ++i) {
        const double value = std::min(d.K[i] * d.L[i] / A[i], 3 * d.m[i] * V / (A[i] * d.L[i]));
        if (!(d.m[i] > 0 && d.K[i] > 0)) ++count;
        // A value that is no number (a vertex on the centre itself) is the worst of all.
        if (std::isnan(least.value)) continue;
        if (!(value >= least.value)) least = {value, Index(i), 0};
    }
    least.count = count;
    return least;
}

}  // namespace innerspring
