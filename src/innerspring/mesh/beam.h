#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "innerspring/mesh/bvh.h"

namespace innerspring {

/// A ray from vertex `from`, and the next triangle on it of which that is no corner.
struct Ray {
    const SurfaceMesh& mesh;
    Index from;
    Vector origin, direction, inverse;
    double length;         ///< to the triangle, or as far as was asked
    Index hit = no_index;  ///< the triangle

    Ray(const SurfaceMesh& surface, Index vertex, const Vector& towards, double longest)
        : mesh(surface), from(vertex), origin(mesh.positions[vertex]), direction(towards), length(longest) {
        // Never zero, so that a ray within a face of a box gives no 0 * infinity.
        inverse = direction.unaryExpr([](double d) { return 1 / (std::abs(d) < 1e-300 ? 1e-300 : d); });
    }

    /// Where it enters the box; infinity if it does not, or beyond `length`.
    double enters(const Box& box) const {
        double enter = 0, leave = length;
        for (int i = 0; i < 3; ++i) {
            const double a = (box.lower[i] - origin[i]) * inverse[i],
                         b = (box.upper[i] - origin[i]) * inverse[i];
            enter = std::max(enter, std::min(a, b)), leave = std::min(leave, std::max(a, b));
        }
        return enter > leave ? INFINITY : enter;
    }

    void look_at(Index triangle) {
        const Triangle& t = mesh.triangles[triangle];
        if (t[0] == from || t[1] == from || t[2] == from) return;
        // Moeller & Trumbore: o + s d = x0 + u e + v f, edges included.
        const Vector &x0 = mesh.positions[t[0]], e = mesh.positions[t[1]] - x0, f = mesh.positions[t[2]] - x0;
        const Vector d_f = direction.cross(f), r = origin - x0;
        const double det = e.dot(d_f);
        if (det == 0) return;
        const double u = r.dot(d_f) / det, v = direction.dot(r.cross(e)) / det, s = f.dot(r.cross(e)) / det;
        if (u >= -1e-9 && v >= -1e-9 && u + v <= 1 + 1e-9 && s > 0 && s < length) length = s, hit = triangle;
    }

    void look_at(const BoxTree& tree, Index root) {
        std::array<Index, 128> stack;
        std::size_t top = 0;
        stack[top++] = root;
        while (top > 0) {
            const BoxTree::Node& node = tree.nodes[stack[--top]];
            if (!(enters(node.box) <= length)) continue;
            for (Index slot = node.first; slot < node.first + node.count; ++slot) look_at(tree.items[slot]);
            if (node.count == 0) stack[top++] = node.first + 1, stack[top++] = node.first;
        }
    }
};

/// Rays of neighbours that go much the same way. The small nodes that any of them can meet are found for all
/// together, so that each need not come down from the root by itself.
struct Beam {
    Box origins, directions;
    bool any = false;
    std::vector<Index> nodes;

    void clear() { any = false; }

    void add(const Vector& origin, const Vector& direction) {
        origins = any ? join(origins, {origin, origin}) : Box{origin, origin};
        directions = any ? join(directions, {direction, direction}) : Box{direction, direction};
        any = true;
    }

    /// May a ray be in the box, as far as `longest`? At a distance t all are within origins + t directions.
    bool meets(const Box& box, double longest) const {
        double from = 0, to = longest;
        const auto at_most = [&](double slope, double bound) {  // t slope <= bound
            if (slope > 0)
                to = std::min(to, bound / slope);
            else if (slope < 0)
                from = std::max(from, bound / slope);
            else if (bound < 0)
                to = -1;
        };
        for (int i = 0; i < 3; ++i) {
            at_most(directions.lower[i], box.upper[i] - origins.lower[i]);
            at_most(-directions.upper[i], origins.upper[i] - box.lower[i]);
        }
        return from <= to * (1 + 1e-9) + 1e-12 * longest;
    }

    void find(const BoxTree& tree, double longest) {
        constexpr double small = 4;  // of the origins' box
        nodes.clear();
        const double size = small * (origins.upper - origins.lower).maxCoeff();
        std::array<Index, 128> stack;
        std::size_t top = 0;
        stack[top++] = 0;
        while (top > 0) {
            const Index n = stack[--top];
            const BoxTree::Node& node = tree.nodes[n];
            if (!meets(node.box, longest)) continue;
            if (node.count > 0 || (node.box.upper - node.box.lower).maxCoeff() < size)
                nodes.push_back(n);
            else
                stack[top++] = node.first + 1, stack[top++] = node.first;
        }
    }
};

}  // namespace innerspring
