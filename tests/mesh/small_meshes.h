#pragma once
// Meshes made on the spot, small enough to know everything about.
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <utility>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring::testing {

/// Corners (0,0,0), (1,0,0), (0,1,0), (0,0,1); volume 1/6.
inline SurfaceMesh tetrahedron() {
    return {"tetrahedron",
            {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
            {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

/// [0, 1]^3, vertex number = x + 2 y + 4 z, 12 triangles.
inline SurfaceMesh cube() {
    SurfaceMesh m{"cube", {}, {}};
    for (int i = 0; i < 8; ++i) m.positions.emplace_back(i & 1, (i >> 1) & 1, i >> 2);
    m.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return m;
}

/// About the z axis, major radius 2, minor radius 1, m by n vertices.
inline SurfaceMesh torus(Index m, Index n) {
    SurfaceMesh mesh{"torus", {}, {}};
    for (Index i = 0; i < m; ++i)
        for (Index j = 0; j < n; ++j) {
            const double a = 2 * std::numbers::pi * i / m, b = 2 * std::numbers::pi * j / n,
                         r = 2 + std::cos(b);
            mesh.positions.emplace_back(r * std::cos(a), r * std::sin(a), std::sin(b));
            const Index k = (i + 1) % m, l = (j + 1) % n;
            mesh.triangles.push_back({i * n + j, k * n + j, k * n + l});
            mesh.triangles.push_back({i * n + j, k * n + l, i * n + l});
        }
    return mesh;
}

/// Unit ball: an octahedron of which each triangle is cut into four, `levels` times.
inline SurfaceMesh ball(int levels) {
    std::vector<Vector> corners{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    SurfaceMesh m{"ball", {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}, {}};
    for (Index x : {0, 1})
        for (Index y : {2, 3})
            for (Index z : {4, 5})
                m.triangles.push_back((x + y + z) % 2 == 0 ? Triangle{x, y, z} : Triangle{x, z, y});
    for (int level = 0; level < levels; ++level) {
        std::vector<Triangle> finer;
        std::vector<std::pair<Triangle, Index>> middles;
        auto middle = [&](Index a, Index b) {
            const Triangle key{std::min(a, b), std::max(a, b), 0};
            for (const auto& [known, v] : middles)
                if (known == key) return v;
            m.positions.push_back((m.positions[a] + m.positions[b]).normalized());
            middles.emplace_back(key, Index(m.positions.size() - 1));
            return middles.back().second;
        };
        for (const auto& [a, b, c] : m.triangles) {
            const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
        }
        m.triangles = finer;
    }
    return m;
}

inline SurfaceMesh moved(SurfaceMesh m, const Vector& by, double scale = 1) {
    for (Vector& p : m.positions) p = scale * p + by;
    return m;
}

inline SurfaceMesh reversed(SurfaceMesh m) {
    for (Triangle& t : m.triangles) std::swap(t[1], t[2]);
    return m;
}

/// Both in one mesh, nothing shared.
inline SurfaceMesh together(SurfaceMesh a, const SurfaceMesh& b) {
    const Index n = Index(a.positions.size());
    a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
    for (const Triangle& t : b.triangles) a.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
    return a;
}

/// Whole numbers from 0 to n - 1, the same on every machine.
struct Dice {
    std::mt19937_64 engine;
    explicit Dice(unsigned seed) : engine(seed) {}
    std::int64_t operator()(std::int64_t n) { return std::int64_t(engine() % std::uint64_t(n)); }
    double unit() { return double(engine() >> 11) * 0x1p-53; }
};

inline Eigen::Matrix3d some_rotation() {
    return Eigen::AngleAxisd(0.7, Vector(1, 2, 3).normalized()).toRotationMatrix();
}

}  // namespace innerspring::testing
