#include "innerspring/mesh/medial.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <nanoflann.hpp>
#include <numbers>

#include "innerspring/mesh/bvh.h"
#include "innerspring/mesh/geometry.h"

namespace innerspring {

namespace {

/// Some of the points, as nanoflann wants them.
struct Sample {
    std::vector<Vector> points;

    std::size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(std::size_t n, std::size_t axis) const { return points[n][Eigen::Index(axis)]; }
    template <class Bounds>
    bool kdtree_get_bbox(Bounds&) const {
        return false;
    }
};

using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Sample>, Sample, 3, Index>;

/// One point per cell of a grid, the first.
std::vector<Vector> one_per_cell(const std::vector<Vector>& points, const Vector& lower, double cell) {
    std::vector<std::pair<std::uint64_t, Index>> keyed;
    for (Index i = 0; i < points.size(); ++i) {
        std::uint64_t key = 0;
        for (int axis = 0; axis < 3; ++axis)
            key = key << 21 | (std::uint64_t((points[i][axis] - lower[axis]) / cell) & 0x1fffff);
        keyed.emplace_back(key, i);
    }
    std::sort(keyed.begin(), keyed.end());
    std::vector<Vector> kept;
    for (std::size_t n = 0; n < keyed.size(); ++n)
        if (n == 0 || keyed[n].first != keyed[n - 1].first) kept.push_back(points[keyed[n].second]);
    return kept;
}

/// The points in less and less detail. On a sphere every point touches the final ball, and looking at all of
/// them for each vertex would be quadratic: a ball need only be tried on points some tenth of its radius
/// apart.
struct Level {
    Level(double cell_size, std::vector<Vector> points)
        : cell(cell_size), sample{std::move(points)}, tree(3, sample) {}
    Level(const Level&) = delete;
    double cell;
    Sample sample;
    Tree tree;
};

using Levels = std::vector<std::unique_ptr<Level>>;

Levels build_levels(const std::vector<Vector>& x, const Vector& lower, double size) {
    Levels levels;
    levels.push_back(std::make_unique<Level>(0, x));
    // The first cell is about twice the mean spacing of vertices over a surface of area size^2.
    for (double cell = 2 * size / std::sqrt(double(x.size())); levels.back()->sample.points.size() > 1000;
         cell *= std::numbers::sqrt2)
        levels.push_back(
            std::make_unique<Level>(cell, one_per_cell(levels.back()->sample.points, lower, cell)));
    return levels;
}

std::size_t level_for(const Levels& levels, double radius) {
    std::size_t level = 0;
    while (level + 1 < levels.size() && levels[level + 1]->cell < 0.1 * radius) ++level;
    return level;
}

/// Search result: of the points seen inside the ball that touches p, the one through which the smallest such
/// ball passes.
struct SmallestBall {
    const std::vector<Vector>& points;
    Vector p, n;
    double
        least_sine;  // of the angle between the tangent plane at p and the direction to a point that counts
    double square_distance;  // from the centre of the ball: only points nearer are still looked for
    double radius;           // the least found
    bool found = false;

    double worstDist() const { return square_distance; }
    bool full() const { return found; }
    std::size_t size() const { return found; }
    bool addPoint(double square, Index point) {
        if (square >= square_distance) return true;
        const Vector v = points[point] - p;
        const double depth = -v.dot(n), distance = v.norm();
        // Seen from the centre of the ball that touches p and passes through p + v, the two are 2
        // asin(depth/|v|) apart, however large the ball was before: neighbours along the surface never count.
        if (depth <= least_sine * distance) return true;
        square_distance = square;
        radius = std::min(radius, distance * distance / (2 * depth));
        found = true;
        return true;
    }
};

double shrink(const Levels& levels, const Vector& p, const Vector& n, double radius, double least_sine) {
    constexpr double tolerance = 1e-4;  // of the radius
    for (std::size_t level = level_for(levels, radius);; level = std::min(level, level_for(levels, radius))) {
        const Vector centre = p - radius * n;
        const double reach = radius * (1 - tolerance);
        SmallestBall ball{levels[level]->sample.points, p, n, least_sine, reach * reach, radius};
        levels[level]->tree.findNeighbors(ball, centre.data(), nanoflann::SearchParams());
        if (ball.found)
            radius = ball.radius;
        else if (level_for(levels, radius) >= level)
            return radius;
    }
}

/// Distance along the ray from vertex `from` to the next triangle it is no corner of, at most `longest`.
double ray_length(const SurfaceMesh& mesh, const BoxTree& tree, Index from, const Vector& direction,
                  double longest) {
    const Vector& o = mesh.positions[from];
    // Never zero, so that a ray within a face of a box gives no 0 * infinity.
    const Vector inverse =
        direction.unaryExpr([](double d) { return 1 / (std::abs(d) < 1e-300 ? 1e-300 : d); });
    double length = longest;
    std::array<Index, 64> stack;
    std::size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const BoxTree::Node& node = tree.nodes[stack[--top]];
        const Vector a = (node.box.lower - o).cwiseProduct(inverse),
                     b = (node.box.upper - o).cwiseProduct(inverse);
        const double enter = std::max(a.cwiseMin(b).maxCoeff(), 0.0),
                     leave = std::min(a.cwiseMax(b).minCoeff(), length);
        if (enter > leave) continue;
        if (node.count == 0) {
            stack[top++] = node.first + 1;
            stack[top++] = node.first;
        }
        for (Index slot = node.first; slot < node.first + node.count; ++slot) {
            const Triangle& t = mesh.triangles[tree.items[slot]];
            if (t[0] == from || t[1] == from || t[2] == from) continue;
            // Moeller & Trumbore: o + s d = x0 + u e + v f, edges included.
            const Vector e = mesh.positions[t[1]] - mesh.positions[t[0]],
                         f = mesh.positions[t[2]] - mesh.positions[t[0]];
            const Vector d_f = direction.cross(f), r = o - mesh.positions[t[0]];
            const double det = e.dot(d_f);
            if (det == 0) continue;
            const double u = r.dot(d_f) / det, v = direction.dot(r.cross(e)) / det,
                         s = f.dot(r.cross(e)) / det;
            if (u >= -1e-9 && v >= -1e-9 && u + v <= 1 + 1e-9 && s > 0) length = std::min(length, s);
        }
    }
    return length;
}

BoxTree triangle_tree(const SurfaceMesh& mesh) {
    std::vector<Box> boxes;
    for (const Triangle& t : mesh.triangles) {
        const Vector &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        boxes.push_back({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
    }
    return build_box_tree(boxes);
}

/// Vertex normals by the weights of Max, "Weights for computing vertex normals from facet normals", J.
/// Graphics Tools 4(2) (1999): exact when the vertices lie on a sphere, however irregular its triangles,
/// where area weights are off by degrees.
std::vector<Vector> sphere_exact_normals(const SurfaceMesh& mesh) {
    const std::vector<Vector>& x = mesh.positions;
    std::vector<Vector> normals(x.size(), Vector::Zero());
    for (const Triangle& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) {
            const Vector a = x[t[(k + 1) % 3]] - x[t[k]], b = x[t[(k + 2) % 3]] - x[t[k]];
            const double weight = a.squaredNorm() * b.squaredNorm();
            if (weight > 0) normals[t[k]] += a.cross(b) / weight;
        }
    const std::vector<Vector> by_area = vertex_normals(x, mesh.triangles);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double length = normals[i].norm();
        // Tiny or folded triangles can outweigh the rest: then area is the better guide.
        const bool sound = length > 0 && std::isfinite(length) && normals[i].dot(by_area[i]) > 0.7 * length;
        normals[i] = sound ? Vector(normals[i] / length) : by_area[i];
    }
    return normals;
}

double nearest_distance(const Levels& levels, const Vector& p) {
    Index nearest[2];
    double square[2] = {0, 0};
    const std::size_t found = levels[0]->tree.knnSearch(p.data(), 2, nearest, square);
    return found > 1 ? std::sqrt(square[1]) : 0;
}

}  // namespace

std::vector<double> medial_radii(const SurfaceMesh& mesh, const MedialOptions& options) {
    const Positions x = mesh.positions;
    const auto [lower, upper] = bounding_box(x);
    const double largest = (upper - lower).norm();
    if (!(largest > 0)) return std::vector<double>(x.size(), 1.0);
    const std::vector<Vector> normals = sphere_exact_normals(mesh);
    const Levels levels = build_levels(mesh.positions, lower, largest);
    const BoxTree tree = triangle_tree(mesh);
    // Where triangles fold onto each other or touch, the ball may vanish: no mesh tells lengths so far below
    // its own spacing.
    constexpr double least_over_spacing = 0.1;
    const std::vector<double> areas = vertex_areas(x, mesh.triangles);
    const double least_sine = std::sin(options.denoising_angle / 2);
    std::vector<double> radii(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
        if (normals[i].squaredNorm() > 0) {
            // The ball cannot be thicker than the solid is here. A little more to begin with, so that where
            // the vertices are dense enough to tell, they do; where they are not (thin and coarse), half the
            // thickness it is.
            const double thickness = ray_length(mesh, tree, Index(i), -normals[i], 2 * largest / 1.2);
            const double start = 0.6 * thickness, end = shrink(levels, x[i], normals[i], start, least_sine);
            radii[i] = end < start ? end : thickness / 2;
        } else {
            radii[i] = nearest_distance(levels, x[i]);
        }
        radii[i] =
            std::clamp(radii[i], std::max(least_over_spacing * std::sqrt(areas[i]), 1e-9 * largest), largest);
    }
    return radii;
}

}  // namespace innerspring
