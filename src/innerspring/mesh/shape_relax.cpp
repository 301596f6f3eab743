#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "innerspring/mesh/geometry.h"
#include "innerspring/mesh/random.h"
#include "innerspring/mesh/shape_mesher.h"
#include "innerspring/mesh/topology.h"

namespace innerspring {

namespace {

constexpr double scatter = 0.45;     // largest random displacement over the local spacing
constexpr int smoothing_rounds = 3;  // few, or the mesh would become a honeycomb again
constexpr int repair_rounds = 60;
const double sliver_cotangent = 1 / std::tan(24 * std::numbers::pi / 180);

/// A triangle mesh under edit. Side k of a triangle is (corner k, corner k+1); across[t][k] is the triangle
/// beyond it.
class Relaxer {
  public:
    Relaxer(const ShapeSurface& surface, SurfaceMesh& mesh)
        : surface_(surface), x_(mesh.positions), triangles_(mesh.triangles), across_(mesh.triangles.size()) {
        const Topology topology = build_topology(x_.size(), triangles_);
        for (std::size_t t = 0; t < triangles_.size(); ++t)
            for (int k = 0; k < 3; ++k) {
                const auto sides = topology.edge_triangles[topology.triangle_edges[t][k]];
                across_[t][k] = sides[0] == t ? sides[1] : sides[0];
            }
        any_triangle_.resize(x_.size());
        degree_.assign(x_.size(), 0);
        for (std::size_t t = 0; t < triangles_.size(); ++t)
            for (Index v : triangles_[t]) {
                any_triangle_[v] = Index(t);
                ++degree_[v];
            }
        density_.assign(x_.size(), 1.0);
        if (surface_.density)
            for (std::size_t v = 0; v < x_.size(); ++v) density_[v] = surface_.density(x_[v]);
    }

    void scatter_vertices(Random& random) {
        for (Index v = 0; v < x_.size(); ++v) {
            const double angle = 2 * std::numbers::pi * random.uniform(),
                         size = scatter * std::sqrt(random.uniform());
            const Star star = look_at(v);
            const Vector n = star.normal.normalized();
            const Vector e = n.unitOrthogonal();
            move(v, size * star.spacing * (std::cos(angle) * e + std::sin(angle) * n.cross(e)));
        }
    }

    /// Moves v towards the centroid of its triangles, weighted such that vertices settle at the wanted
    /// density.
    void smooth(Index v) {
        const Star star = look_at(v);
        Vector d = star.centre - x_[v];
        const double square = star.normal.squaredNorm();
        if (square > 0) d -= d.dot(star.normal) / square * star.normal;
        move(v, d);
    }

    void smooth_all() {
        for (Index v = 0; v < x_.size(); ++v) smooth(v);
    }

    /// Lawson: flips edges whose opposite angles sum to more than pi until none is left.
    void flip_all() {
        std::vector<Index> sides(3 * triangles_.size());
        for (std::size_t n = 0; n < sides.size(); ++n) sides[n] = Index(sides.size() - 1 - n);
        flip(std::move(sides));
    }

    /// Smooths the neighbourhood of every sliver and flips; false if there was none.
    bool repair() {
        std::vector<Index> bad;
        for (Index t = 0; t < triangles_.size(); ++t)
            if (largest_cotangent(t) > sliver_cotangent)
                for (Index v : triangles_[t]) bad.push_back(v);
        const std::size_t corners = bad.size();
        for (std::size_t n = 0; n < corners; ++n)
            for_star(bad[n], [&](Index t, int k) { bad.push_back(triangles_[t][(k + 1) % 3]); });
        std::sort(bad.begin(), bad.end());
        bad.erase(std::unique(bad.begin(), bad.end()), bad.end());
        std::vector<Index> sides;
        for (Index v : bad) {
            smooth(v);
            for_star(v, [&](Index t, int k) { sides.insert(sides.end(), {3 * t + k, 3 * t + (k + 1) % 3}); });
        }
        flip(std::move(sides));
        return !bad.empty();
    }

  private:
    struct Star {
        Vector normal = Vector::Zero(), centre;
        double spacing;
    };

    /// Calls visit(triangle, corner of v in it) for each triangle at v, in order round v.
    template <class Visit>
    void for_star(Index v, Visit visit) const {
        const Index first = any_triangle_[v];
        Index t = first;
        do {
            const Triangle& tri = triangles_[t];
            const int k = tri[0] == v ? 0 : tri[1] == v ? 1 : 2;
            visit(t, k);
            t = across_[t][k];
        } while (t != first);
    }

    Star look_at(Index v) const {
        Star star;
        Vector sum = Vector::Zero();
        double weights = 0, lengths = 0;
        for_star(v, [&](Index t, int k) {
            const Index b = triangles_[t][(k + 1) % 3], c = triangles_[t][(k + 2) % 3];
            const Vector n = (x_[b] - x_[v]).cross(x_[c] - x_[v]);
            const double density = density_[v] + density_[b] + density_[c];
            const double weight = n.norm() * density * density;
            star.normal += n;
            sum += weight * (x_[v] + x_[b] + x_[c]);
            weights += weight;
            lengths += (x_[b] - x_[v]).norm();
        });
        star.centre = weights > 0 ? Vector(sum / (3 * weights)) : x_[v];
        star.spacing = lengths / degree_[v];
        return star;
    }

    /// Moves v by the longest of d, d/2, d/4 that turns no triangle over.
    void move(Index v, Vector d) {
        for (int attempt = 0; attempt < 3; ++attempt, d /= 2) {
            const Vector to = surface_.project(x_[v] + d);
            bool valid = true;
            for_star(v, [&](Index t, int k) {
                const Vector &b = x_[triangles_[t][(k + 1) % 3]], &c = x_[triangles_[t][(k + 2) % 3]];
                const Vector before = (b - x_[v]).cross(c - x_[v]), after = (b - to).cross(c - to);
                const double turn = before.dot(after);
                valid = valid && turn > 0 && 4 * turn * turn > before.squaredNorm() * after.squaredNorm();
            });
            if (!valid) continue;
            x_[v] = to;
            if (surface_.density) density_[v] = surface_.density(to);
            return;
        }
    }

    /// Cotangent of the angle at c in the triangle (a, b, c).
    double cotangent(Index a, Index b, Index c) const {
        const Vector p = x_[a] - x_[c], q = x_[b] - x_[c];
        return p.dot(q) / std::max(p.cross(q).norm(), 1e-300);
    }

    double largest_cotangent(Index t) const {
        const auto [a, b, c] = triangles_[t];
        return std::max({cotangent(a, b, c), cotangent(b, c, a), cotangent(c, a, b)});
    }

    bool joined(Index v, Index w) const {
        bool found = false;
        for_star(v, [&](Index t, int k) { found = found || triangles_[t][(k + 1) % 3] == w; });
        return found;
    }

    void flip(std::vector<Index> sides) {
        for (std::size_t budget = 10 * triangles_.size() + sides.size(); !sides.empty() && budget > 0;
             --budget) {
            const Index t = sides.back() / 3;
            const int k = int(sides.back() % 3);
            sides.pop_back();
            if (!flip_side(t, k)) continue;
            const Index other = across_[t][(k + 1) % 3];
            for (Index side = 0; side < 3; ++side)
                sides.insert(sides.end(), {3 * t + side, 3 * other + side});
        }
    }

    /// Replaces the diagonal (a,b) of the quad a,d,b,c by (c,d) if that is closer to Delaunay and lawful. It
    /// is then side k+1 of t.
    bool flip_side(Index t, int k) {
        const Index u = across_[t][k];
        const Index a = triangles_[t][k], b = triangles_[t][(k + 1) % 3], c = triangles_[t][(k + 2) % 3];
        const int l = triangles_[u][0] == b   ? 0
                      : triangles_[u][1] == b ? 1
                                              : 2;  // u = (b, a, d) from its corner l
        const Index d = triangles_[u][(l + 2) % 3];
        if (cotangent(a, b, c) + cotangent(a, b, d) > -1e-9) return false;
        if (c == d || degree_[a] <= 4 || degree_[b] <= 4 || joined(c, d)) return false;
        const Vector quad = (x_[b] - x_[a]).cross(x_[c] - x_[a]) + (x_[a] - x_[b]).cross(x_[d] - x_[b]);
        const Vector at_a = (x_[d] - x_[a]).cross(x_[c] - x_[a]), at_b = (x_[c] - x_[b]).cross(x_[d] - x_[b]);
        const double limit = 0.3 * quad.norm();
        if (at_a.dot(quad) <= limit * at_a.norm() || at_b.dot(quad) <= limit * at_b.norm()) return false;

        const Index beyond_bc = across_[t][(k + 1) % 3], beyond_ad = across_[u][(l + 1) % 3];
        triangles_[t][(k + 1) % 3] = d;  // t = (a, d, c) from its corner k
        triangles_[u][(l + 1) % 3] = c;  // u = (b, c, d) from its corner l
        across_[t][k] = beyond_ad;
        across_[t][(k + 1) % 3] = u;
        across_[u][l] = beyond_bc;
        across_[u][(l + 1) % 3] = t;
        std::replace(across_[beyond_ad].begin(), across_[beyond_ad].end(), u, t);
        std::replace(across_[beyond_bc].begin(), across_[beyond_bc].end(), t, u);
        any_triangle_[a] = any_triangle_[c] = t;
        any_triangle_[b] = any_triangle_[d] = u;
        --degree_[a], --degree_[b], ++degree_[c], ++degree_[d];
        return true;
    }

    const ShapeSurface& surface_;
    std::vector<Vector>& x_;
    std::vector<Triangle>& triangles_;
    std::vector<std::array<Index, 3>> across_;
    std::vector<Index> any_triangle_, degree_;
    std::vector<double> density_;
};

}  // namespace

void settle(const ShapeSurface& surface, SurfaceMesh& mesh) {
    for (Vector& p : mesh.positions) p = surface.project(p);
    Relaxer relaxer(surface, mesh);
    relaxer.flip_all();
    relaxer.smooth_all();
}

void scatter_and_relax(const ShapeSurface& surface, std::uint64_t seed, SurfaceMesh& mesh) {
    Relaxer relaxer(surface, mesh);
    Random random(seed);
    relaxer.flip_all();
    relaxer.scatter_vertices(random);
    relaxer.flip_all();
    for (int round = 0; round < smoothing_rounds; ++round) {
        relaxer.smooth_all();
        relaxer.flip_all();
    }
    for (int round = 0; round < repair_rounds && relaxer.repair(); ++round) {
    }
}

}  // namespace innerspring
