#include "innerspring/mesh/refine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <queue>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/subdivision.h"

namespace innerspring {

namespace {

/// Most triangles that a refinement may ask for.
constexpr double most_triangles = 1e8;

/// The point of triangle abc nearest to p: by the signs of the projections on its sides (Ericson, Real-Time
/// Collision Detection, 2005, section 5.1.5).
Vector nearest_point(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {
    const Vector ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp),
                 d6 = ac.dot(cp);
    if (d1 <= 0 && d2 <= 0) return a;
    if (d3 >= 0 && d4 <= d3) return b;
    if (d6 >= 0 && d5 <= d6) return c;
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
    if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
    return a + (vb * ab + vc * ac) / (va + vb + vc);
}

/// Distance at c of a front that is at a and b at distances A and B: as from the point behind ab that has
/// these distances, in the plane of the triangle; by the sides alone where its ray misses ab.
double front_arrival(const Vector& a, const Vector& b, const Vector& c, double A, double B) {
    const double length = (b - a).norm(), by_side = std::min(A + (c - a).norm(), B + (c - b).norm());
    if (!(length > 0)) return by_side;
    const Vector along = (b - a) / length;
    const double source_x = (length * length + A * A - B * B) / (2 * length),
                 source_y = std::sqrt(std::max(0.0, A * A - source_x * source_x));
    const double x = along.dot(c - a), y = ((c - a) - x * along).norm();
    if (!(source_y + y > 0)) return by_side;
    const double crossing = source_x + (x - source_x) * source_y / (source_y + y);
    return crossing < 0 || crossing > length ? by_side : std::hypot(x - source_x, y + source_y);
}

std::vector<Index> triangles_at(const SurfaceMesh& mesh, const std::vector<bool>& vertex) {
    std::vector<Index> found;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (std::ranges::any_of(mesh.triangles[t], [&](Index i) { return vertex[i]; }))
            found.push_back(Index(t));
    return found;
}

void require_vertex(const SurfaceMesh& mesh, Index vertex) {
    if (vertex >= mesh.positions.size())
        throw InputError(fmt::format("{}: vertex {} does not exist; the mesh has {}", mesh.name, vertex,
                                     mesh.positions.size()));
}

void require_radius(double radius) {
    if (!(radius >= 0 && std::isfinite(radius)))
        throw InputError(fmt::format("radius {:g} m must not be negative", radius));
}

}  // namespace

std::vector<Index> triangles_near(const SurfaceMesh& mesh, const Vector& point, double radius) {
    require_radius(radius);
    std::vector<Index> found;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& c = mesh.triangles[t];
        const double d =
            (nearest_point(point, mesh.positions[c[0]], mesh.positions[c[1]], mesh.positions[c[2]]) - point)
                .norm();
        if (d <= radius) found.push_back(Index(t));
    }
    return found;
}

std::vector<Index> triangles_along(const SurfaceMesh& mesh, const Topology& topology, Index vertex,
                                   double radius) {
    require_vertex(mesh, vertex);
    require_radius(radius);
    const auto& x = mesh.positions;
    std::vector<double> distance(x.size(), INFINITY);
    std::vector<bool> reached(x.size(), false);
    using Entry = std::pair<double, Index>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
    distance[vertex] = 0;
    front.push({0, vertex});
    while (!front.empty()) {
        const auto [d, i] = front.top();
        front.pop();
        if (reached[i]) continue;
        if (d > radius) break;
        reached[i] = true;
        for (Index t : topology.vertex_triangles[i]) {
            const Triangle& corners = mesh.triangles[t];
            for (int k = 0; k < 3; ++k) {
                const Index c = corners[k];
                if (reached[c]) continue;
                const Index other = corners[(k + 1) % 3] == i ? corners[(k + 2) % 3] : corners[(k + 1) % 3];
                const double arrival = reached[other]
                                           ? front_arrival(x[i], x[other], x[c], d, distance[other])
                                           : d + (x[c] - x[i]).norm();
                if (arrival < distance[c]) distance[c] = arrival, front.push({arrival, c});
            }
        }
    }
    return triangles_at(mesh, reached);
}

std::vector<Index> triangles_in_ring(const SurfaceMesh& mesh, const Topology& topology, Index vertex,
                                     int rings) {
    require_vertex(mesh, vertex);
    std::vector<bool> chosen(mesh.positions.size(), false);
    for (Index i : ring(topology, vertex, rings)) chosen[i] = true;
    return triangles_at(mesh, chosen);
}

std::vector<Index> triangles_where(
    const SurfaceMesh& mesh, const std::function<bool(const Vector&, const Vector&, const Vector&)>& chosen) {
    std::vector<Index> found;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& c = mesh.triangles[t];
        if (chosen(mesh.positions[c[0]], mesh.positions[c[1]], mesh.positions[c[2]]))
            found.push_back(Index(t));
    }
    return found;
}

void require_refinable(const SurfaceMesh& mesh, std::span<const Index> triangles, int levels) {
    if (levels < 1 || levels > most_levels)
        throw InputError(fmt::format("levels is {}; it must be from 1 to {}", levels, most_levels));
    for (Index t : triangles)
        if (t >= mesh.triangles.size())
            throw InputError(fmt::format("{}: triangle {} does not exist; the mesh has {}", mesh.name, t,
                                         mesh.triangles.size()));
    const double wanted = double(triangles.size()) * std::pow(4.0, levels) + double(mesh.triangles.size());
    if (wanted > most_triangles)
        throw InputError(fmt::format("{} levels on {} triangles would make {:.2g}; at most {:g} are allowed",
                                     levels, triangles.size(), wanted, most_triangles));
}

RefinedMesh refine(const SurfaceMesh& mesh, std::span<const Index> triangles, const RefineOptions& options) {
    require_refinable(mesh, triangles, options.levels);
    RefinedMesh refined{mesh, mesh.positions.size(), {}, 0};
    Subdivision subdivision(mesh, options.placement);
    const SurfaceChange change = subdivision.split(refined.mesh, triangles, options.levels);
    for (const SurfaceChange::Middle& c : change.created) refined.halves.push_back(c.halves);
    if (options.placement != Placement::in_plane)
        refined.volume_change_m3 = volume(refined.mesh) - volume(mesh);
    return refined;
}

}  // namespace innerspring
