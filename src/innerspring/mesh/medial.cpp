#include "innerspring/mesh/medial.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "innerspring/mesh/beam.h"
#include "innerspring/mesh/curve_order.h"
#include "innerspring/mesh/geometry.h"
#include "innerspring/mesh/team.h"

namespace innerspring {

namespace {

/// One point per cell of a grid, the first.
std::vector<Vector> one_per_cell(const std::vector<Vector>& points, const Vector& lower, double cell) {
    std::vector<CurvePlace> keyed;
    keyed.reserve(points.size());
    for (Index i = 0; i < points.size(); ++i) {
        std::uint64_t key = 0;
        for (int axis = 0; axis < 3; ++axis)
            key = key << 21 | (std::uint64_t((points[i][axis] - lower[axis]) / cell) & 0x1fffff);
        keyed.push_back({key, i});
    }
    sort_by_key(keyed, 63);
    std::vector<Vector> kept;
    for (std::size_t n = 0; n < keyed.size(); ++n)
        if (n == 0 || keyed[n].key != keyed[n - 1].key) kept.push_back(points[keyed[n].index]);
    return kept;
}

/// The points in less and less detail. On a sphere every point touches the final ball, and looking at all of
/// them for each vertex would be quadratic: a ball need only be tried on points some tenth of its radius
/// apart.
struct Level {
    double cell = 0;
    BoxTree tree;
    std::vector<Vector> points;  ///< per slot of the tree
};

std::vector<Level> build_levels(const std::vector<Vector>& x, const Vector& lower, double size) {
    std::vector<Level> levels;
    std::vector<Vector> points = x;
    // The first cell is about twice the mean spacing of vertices over a surface of area size^2.
    for (double cell = 0, next = 2 * size / std::sqrt(double(x.size()));;
         cell = next, next *= std::numbers::sqrt2) {
        if (cell > 0) points = one_per_cell(points, lower, cell);
        Level& level = levels.emplace_back();
        level.cell = cell;
        level.tree = build_point_tree(points, 8);
        level.points.reserve(points.size());
        for (Index i : level.tree.items) level.points.push_back(points[i]);
        if (points.size() <= 1000) return levels;
    }
}

std::size_t level_for(const std::vector<Level>& levels, double radius) {
    std::size_t level = 0;
    while (level + 1 < levels.size() && levels[level + 1].cell < 0.1 * radius) ++level;
    return level;
}

/// The ball that touches p, where the outward normal is n, while it shrinks. The smaller ones lie within the
/// larger ones, so one walk down the tree serves all: what a ball has left out stays out.
struct Ball {
    Vector p, n;
    double
        least_sine;  // of the angle between the tangent plane at p and the direction to a point that counts
    double radius = 0;
    Vector centre = Vector::Zero();
    double square_reach = 0;  // only points nearer to the centre are still looked for
    Vector touches = p;       // the last point that made it smaller

    Ball(const Vector& touched, const Vector& normal, double least, double largest)
        : p(touched), n(normal), least_sine(least) {
        set(largest);
    }

    void set(double r) {
        constexpr double tolerance = 1e-4;  // of the radius
        radius = r;
        centre = p - r * n;
        square_reach = r * r * (1 - tolerance) * (1 - tolerance);
    }

    /// Shrinks until x is outside.
    void look_at(const Vector& x) {
        if ((x - centre).squaredNorm() >= square_reach) return;
        const Vector v = x - p;
        const double depth = -v.dot(n), distance = v.norm();
        // Seen from the centre of the ball that touches p and passes through p + v, the two are 2
        // asin(depth/|v|) apart, however large the ball was before: neighbours along the surface never count.
        if (depth <= least_sine * distance) return;
        set(distance * distance / (2 * depth));
        touches = x;
    }

    /// Square distance of the centre from a box; infinity if nothing in there can count.
    double square_distance(const Box& box) const {
        double outside = 0, from_p = 0, depth = 0;  // depth: the most in the box
        for (int i = 0; i < 3; ++i) {
            const double c = std::max({box.lower[i] - centre[i], centre[i] - box.upper[i], 0.0});
            const double low = box.lower[i] - p[i], high = box.upper[i] - p[i];
            const double d = std::max({low, -high, 0.0});
            outside += c * c, from_p += d * d;
            depth -= std::min(n[i] * low, n[i] * high);
        }
        if (depth <= 0 || depth * depth < 0.999999 * least_sine * least_sine * from_p) return INFINITY;
        return outside;
    }
};

void shrink(const Level& level, Ball& ball) {
    std::array<Index, 128> stack;
    std::size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const BoxTree::Node& node = level.tree.nodes[stack[--top]];
        // Again, as the ball may have shrunk since.
        if (ball.square_distance(node.box) >= ball.square_reach) continue;
        if (node.count > 0) {
            for (Index slot = node.first; slot < node.first + node.count; ++slot)
                ball.look_at(level.points[slot]);
            continue;
        }
        const double left = ball.square_distance(level.tree.nodes[node.first].box),
                     right = ball.square_distance(level.tree.nodes[node.first + 1].box);
        const Index nearer = left <= right ? 0 : 1;
        if (std::max(left, right) < ball.square_reach) stack[top++] = node.first + 1 - nearer;
        if (std::min(left, right) < ball.square_reach) stack[top++] = node.first + nearer;
    }
}

void shrink(const std::vector<Level>& levels, Ball& ball) {
    for (std::size_t level = level_for(levels, ball.radius);;) {
        shrink(levels[level], ball);
        const std::size_t finer = level_for(levels, ball.radius);
        if (finer >= level) return;
        level = finer;
    }
}

/// Points inside a ball, side by side so that several are looked at in one instruction: in single precision
/// about its centre and in units of its radius, which leaves out only what is surely outside.
struct Candidates {
    Vector centre = Vector::Zero();
    double scale = 1;
    std::vector<Vector> points;
    std::vector<float> x, y, z;  ///< filled up to a multiple of `width` with points far away

    void find(const Level& level, const Vector& middle, double radius) {
        centre = middle, scale = 1 / radius;
        points.clear(), x.clear(), y.clear(), z.clear();
        std::array<Index, 128> stack;
        std::size_t top = 0;
        stack[top++] = 0;
        while (top > 0) {
            const BoxTree::Node& node = level.tree.nodes[stack[--top]];
            const Vector outside =
                (node.box.lower - centre).cwiseMax(centre - node.box.upper).cwiseMax(Vector::Zero());
            if (outside.squaredNorm() >= radius * radius) continue;
            if (node.count == 0) stack[top++] = node.first + 1, stack[top++] = node.first;
            for (Index slot = node.first; slot < node.first + node.count; ++slot) {
                const Vector p = scale * (level.points[slot] - centre);
                if (p.squaredNorm() >= 1) continue;
                points.push_back(level.points[slot]);
                x.push_back(float(p[0])), y.push_back(float(p[1])), z.push_back(float(p[2]));
            }
        }
        while (x.size() % width != 0) x.push_back(INFINITY), y.push_back(0), z.push_back(0);
    }

    void shrink(Ball& ball) const {
        for (std::size_t n = 0; n < x.size(); n += width) {
            const Vector c = scale * (ball.centre - centre);
            const float cx = float(c[0]), cy = float(c[1]), cz = float(c[2]),
                        reach = float(scale * scale * ball.square_reach * (1 + 1e-5));
            int inside = 0;
            for (std::size_t k = n; k < n + width; ++k) {
                const float dx = x[k] - cx, dy = y[k] - cy, dz = z[k] - cz;
                inside |= dx * dx + dy * dy + dz * dz < reach;
            }
            if (!inside) continue;
            for (std::size_t k = n; k < std::min(n + width, points.size()); ++k) ball.look_at(points[k]);
        }
    }

    static constexpr std::size_t width = 16;
};

/// Balls of neighbours: one of them is shrunk by itself, and the others start from the point where it came to
/// rest. Then they are all but done, and the few points that may still lie in one of them are found for all
/// together; if they are too different for that, for each half of them.
void shrink_together(const std::vector<Level>& levels, std::span<Ball> balls, Candidates& candidates) {
    shrink(levels, balls[0]);
    Vector centre = Vector::Zero();
    std::size_t level = levels.size();
    for (Ball& ball : balls) {
        ball.look_at(balls[0].touches);
        centre += ball.centre / double(balls.size());
        level = std::min(level, level_for(levels, ball.radius));
    }
    double radius = 0, least = INFINITY;
    for (const Ball& ball : balls) {
        radius = std::max(radius, (ball.centre - centre).norm() + ball.radius);
        least = std::min(least, ball.radius);
    }
    if (radius > 1.3 * least) {
        const std::size_t half = balls.size() / 2;
        if (half == 0) return;
        shrink_together(levels, balls.first(half), candidates);
        shrink_together(levels, balls.subspan(half), candidates);
        return;
    }
    if (balls.size() > 1) candidates.find(levels[level], centre, radius);
    for (Ball& ball : balls) {
        if (balls.size() > 1) candidates.shrink(ball);
        if (level_for(levels, ball.radius) < level) shrink(levels, ball);
    }
}

/// The slots of the largest nodes of no more than `most` items.
std::vector<std::pair<Index, Index>> groups(const BoxTree& tree, Index most) {
    std::vector<Index> size(tree.nodes.size());
    for (std::size_t n = size.size(); n-- > 0;) {
        const BoxTree::Node& node = tree.nodes[n];
        size[n] = node.count > 0 ? node.count : size[node.first] + size[node.first + 1];
    }
    std::vector<std::pair<Index, Index>> found;
    std::vector<Index> open{0};
    Index slot = 0;
    while (!open.empty()) {
        const Index n = open.back();
        open.pop_back();
        if (size[n] > most && tree.nodes[n].count == 0) {
            open.push_back(tree.nodes[n].first + 1), open.push_back(tree.nodes[n].first);
        } else {
            found.emplace_back(slot, slot + size[n]);
            slot += size[n];
        }
    }
    return found;
}

BoxTree triangle_tree(const SurfaceMesh& mesh) {
    std::vector<Box> boxes;
    boxes.reserve(mesh.triangles.size());
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

/// From point i to the nearest other one.
double nearest_distance(const Level& level, const Vector& p) {
    double least = INFINITY;
    bool itself = false;
    for (const Vector& x : level.points) {
        const double square = (x - p).squaredNorm();
        if (square == 0 && !itself)
            itself = true;
        else
            least = std::min(least, square);
    }
    return std::isfinite(least) ? std::sqrt(least) : 0;
}

}  // namespace

std::vector<double> medial_radii(const SurfaceMesh& mesh, const MedialOptions& options) {
    const Positions x = mesh.positions;
    const auto [lower, upper] = bounding_box(x);
    const double largest = (upper - lower).norm();
    if (!(largest > 0)) return std::vector<double>(x.size(), 1.0);
    // Waking others is not worth it for a few.
    Team team(x.size() < 8000 ? 1 : options.threads);
    std::vector<Vector> normals;
    std::vector<Level> levels;
    BoxTree tree;
    team.run(2, [&, low = lower](std::size_t part) {
        if (part == 0)
            levels = build_levels(mesh.positions, low, largest);
        else
            normals = sphere_exact_normals(mesh), tree = triangle_tree(mesh);
    });
    // Where triangles fold onto each other or touch, the ball may vanish: no mesh tells lengths so far below
    // its own spacing.
    constexpr double least_over_spacing = 0.1;
    const std::vector<double> areas = vertex_areas(x, mesh.triangles);
    const double least_sine = std::sin(options.denoising_angle / 2);
    std::vector<double> radii(x.size());
    constexpr std::size_t rays_in_beam = 16;
    const double longest = 2 * largest / 1.2;
    struct Scratch {
        std::vector<Ball> balls;
        std::vector<Index> vertices;
        Candidates candidates;
        Beam beam;
    };
    const auto find_radii = [&](Index first, Index last, Scratch& w) {
        w.balls.clear(), w.vertices.clear();
        for (Index slot = first; slot < last; ++slot) {
            const Index i = levels[0].tree.items[slot];
            if (normals[i].squaredNorm() > 0)
                w.vertices.push_back(i);
            else
                radii[i] = nearest_distance(levels[0], x[i]);
        }
        Index hit = no_index;
        for (std::size_t n = 0; n < w.vertices.size(); ++n) {
            const Index i = w.vertices[n];
            if (n % rays_in_beam == 0) {
                w.beam.clear();
                for (std::size_t k = n; k < std::min(n + rays_in_beam, w.vertices.size()); ++k)
                    w.beam.add(x[w.vertices[k]], -normals[w.vertices[k]]);
                w.beam.find(tree, longest);
            }
            // The ball cannot be thicker than the solid is here. A little more to begin with, so that where
            // the vertices are dense enough to tell, they do; where they are not (thin and coarse), half the
            // thickness it is.
            Ray ray(mesh, i, -normals[i], longest);
            if (hit != no_index) ray.look_at(hit);
            for (Index node : w.beam.nodes) ray.look_at(tree, node);
            hit = ray.hit;
            radii[i] = ray.length / 2;
            w.balls.emplace_back(x[i], normals[i], least_sine, 0.6 * ray.length);
        }
        if (w.balls.empty()) return;
        shrink_together(levels, w.balls, w.candidates);
        for (std::size_t n = 0; n < w.balls.size(); ++n)
            if (w.balls[n].radius < 0.6 * 2 * radii[w.vertices[n]]) radii[w.vertices[n]] = w.balls[n].radius;
    };
    // Groups by themselves, some at a time.
    const std::vector<std::pair<Index, Index>> all = groups(levels[0].tree, 256);
    constexpr std::size_t at_a_time = 16;
    team.run((all.size() + at_a_time - 1) / at_a_time, [&](std::size_t block) {
        Scratch scratch;
        for (std::size_t g = block * at_a_time; g < std::min(all.size(), (block + 1) * at_a_time); ++g)
            find_radii(all[g].first, all[g].second, scratch);
    });
    for (std::size_t i = 0; i < x.size(); ++i)
        radii[i] =
            std::clamp(radii[i], std::max(least_over_spacing * std::sqrt(areas[i]), 1e-9 * largest), largest);
    return radii;
}

}  // namespace innerspring
