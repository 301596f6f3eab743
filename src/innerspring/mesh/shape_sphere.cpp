#include <algorithm>
#include <cmath>
#include <numbers>

#include "innerspring/mesh/shape_families.h"
#include "innerspring/mesh/shape_mesher.h"

namespace innerspring {

namespace {

Vector on_sphere(const Vector& p, double radius) {
    return p * (radius / p.norm());
}

/// Vertex indices of an icosahedron whose faces are cut into n^2 triangles: corners, then inner points of
/// edges, then of faces.
struct Geodesic {
    explicit Geodesic(int frequency) : n(frequency) {
        const double g = std::numbers::phi;
        corners = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
        positions = corners;
        for (auto& row : edge) row.fill(no_index);
        for (const Triangle& face : faces) add_face(face);
    }

    void add_face(const Triangle& face) {
        const Index a = face[0], b = face[1], c = face[2];
        add_edge(a, b), add_edge(b, c), add_edge(c, a);
        const Index inner = Index(positions.size());
        for (int i = 1; i < n; ++i)
            for (int j = 1; i + j < n; ++j)
                positions.push_back((n - i - j) * corners[a] + i * corners[b] + j * corners[c]);
        auto vertex = [&](int i, int j) -> Index {  // i steps towards b, j towards c
            if (j == 0) return on_edge(a, b, i);
            if (i == 0) return on_edge(a, c, j);
            if (i + j == n) return on_edge(b, c, j);
            return inner + Index((i - 1) * (n - 1) - i * (i - 1) / 2 + j - 1);
        };
        for (int i = 0; i < n; ++i)
            for (int j = 0; i + j < n; ++j) {
                triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)});
                if (i + j + 1 < n)
                    triangles.push_back({vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
            }
    }

    void add_edge(Index a, Index b) {
        if (edge[a][b] != no_index) return;
        edge[a][b] = edge[b][a] = Index(positions.size());
        const Index low = std::min(a, b), high = std::max(a, b);
        for (int i = 1; i < n; ++i) positions.push_back((n - i) * corners[low] + i * corners[high]);
    }

    Index on_edge(Index a, Index b, int steps) const {
        if (steps == 0) return a;
        if (steps == n) return b;
        return edge[a][b] + Index(a < b ? steps - 1 : n - steps - 1);
    }

    static constexpr std::array<Triangle, 20> faces{
        {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
         {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
         {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
    int n;
    std::vector<Vector> corners, positions;
    std::vector<Triangle> triangles;
    std::array<std::array<Index, 12>, 12> edge;
};

}  // namespace

SurfaceMesh icosphere(Index vertices, double radius) {
    // 10 n^2 + 2 nearest to `vertices`
    int n = std::max(1, int(std::sqrt((vertices - 2) / 10.0)));
    auto count = [](int frequency) { return 10.0 * frequency * frequency + 2; };
    if (count(n + 1) - vertices < vertices - count(n)) ++n;
    Geodesic geodesic(n);
    for (Vector& p : geodesic.positions) p = on_sphere(p, radius);
    return {"", std::move(geodesic.positions), std::move(geodesic.triangles)};
}

SurfaceMesh irregular_sphere(Index vertices, std::uint64_t seed, double irregularity, double radius) {
    // Vertices per area grow as irregularity^((z+1)/2), from 1 at the south pole to `irregularity` at the
    // north pole.
    const double rate = std::log(irregularity) / 2;
    ShapeSurface sphere;
    sphere.place = [](double u, double phi) {
        const double theta = std::numbers::pi * u;
        return Vector(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    };
    sphere.project = [](const Vector& p) { return on_sphere(p, 1); };
    if (irregularity > 1) sphere.density = [rate](const Vector& p) { return std::exp(rate * (p.z() + 1)); };
    SurfaceMesh mesh = mesh_shape(sphere, vertices, seed);
    for (Vector& p : mesh.positions) p = on_sphere(p, radius);
    return mesh;
}

}  // namespace innerspring
