#include "innerspring/mesh/signed_distance.h"

#include <cmath>

#include "innerspring/mesh/check.h"
#include "innerspring/mesh/geometry.h"
#include "innerspring/mesh/topology.h"

namespace innerspring {

OnTriangle nearest_on_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {
    const Vector ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) return {a, {1, 0, 0}};
    const double d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) return {b, {0, 1, 0}};
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) {
        const double t = d1 / (d1 - d3);
        return {a + t * ab, {1 - t, t, 0}};
    }
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) return {c, {0, 0, 1}};
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) {
        const double t = d2 / (d2 - d6);
        return {a + t * ac, {1 - t, 0, t}};
    }
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0 && (d4 - d3) + (d5 - d6) > 0) {
        const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {b + t * (c - b), {0, 1 - t, t}};
    }
    const double sum = va + vb + vc;
    if (!(sum > 0)) return {a, {1, 0, 0}};  // no area
    const double v = vb / sum, w = vc / sum;
    return {a + v * ab + w * ac, {1 - v - w, v, w}};
}

DistanceField build_distance_field(SurfaceMesh mesh) {
    require_usable(mesh);
    DistanceField field;
    const auto& x = mesh.positions;
    std::vector<Box> boxes;
    field.corner_normals.assign(x.size(), Vector::Zero());
    field.normals.resize(mesh.triangles.size());
    std::vector<Vector> faces;
    for (const Triangle& t : mesh.triangles) {
        const Vector &a = x[t[0]], &b = x[t[1]], &c = x[t[2]];
        boxes.push_back({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
        faces.push_back(double_area_vector(x, t).stableNormalized());
        for (int k = 0; k < 3; ++k) {
            const Vector u = x[t[(k + 1) % 3]] - x[t[k]], v = x[t[(k + 2) % 3]] - x[t[k]];
            field.corner_normals[t[k]] += std::atan2(u.cross(v).norm(), u.dot(v)) * faces.back();
        }
    }
    const Topology topology = build_topology(x.size(), mesh.triangles);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int side = 0; side < 3; ++side) {
            field.normals[t][side] = Vector::Zero();
            for (Index other : topology.edge_triangles[topology.triangle_edges[t][side]])
                field.normals[t][side] += faces[other];
        }
    field.tree = build_box_tree(boxes);
    for (const Vector& p : x) field.radius = std::max(field.radius, p.norm());
    for (const Triangle& t : mesh.triangles) {
        const Vector middle = (x[t[0]] + x[t[1]] + x[t[2]]) / 3;
        double r2 = 0;
        for (Index i : t) r2 = std::max(r2, (x[i] - middle).squaredNorm());
        field.balls.push_back({middle, std::sqrt(r2) + 1e-9 * field.radius});
    }
    field.mesh = std::move(mesh);
    return field;
}

namespace {

double distance2(const Box& box, const Vector& p) {
    return (box.lower - p).cwiseMax(p - box.upper).cwiseMax(0).squaredNorm();
}

/// The nearest of the triangles it is shown; of equals that with the lowest index.
struct Search {
    const DistanceField& field;
    const Vector& p;
    double best, root;  ///< squared [m^2], and at least that [m]
    Index triangle = no_index;
    OnTriangle on{Vector::Zero(), {}};

    Search(const DistanceField& f, const Vector& point, double within)
        : field(f),
          p(point),
          best(within < 1e150 ? within * within : std::numeric_limits<double>::infinity()),
          root(within) {}

    void look_at(Index t) {
        // No point of it is nearer than its ball.
        const DistanceField::Ball& ball = field.balls[t];
        const double reach = ball.radius + root;
        if ((p - ball.centre).squaredNorm() > reach * reach) return;
        const Triangle& corners = field.mesh.triangles[t];
        const auto& x = field.mesh.positions;
        const OnTriangle q = nearest_on_triangle(p, x[corners[0]], x[corners[1]], x[corners[2]]);
        const double d2 = (p - q.point).squaredNorm();
        if (!(d2 < best || (d2 == best && t < triangle))) return;
        best = d2, triangle = t, on = q;
        root = std::sqrt(best);  // the balls are a little larger than need be, for rounding
    }
    Nearest result() const;
};

}  // namespace

NearTriangles triangles_near(const DistanceField& field, const Vector& centre, double radius) {
    NearTriangles few{centre, radius, 0, {}};
    const Vector reach = Vector::Constant(radius);
    for_each_overlap(field.tree, {centre - reach, centre + reach}, [&](Index t) {
        const Triangle& c = field.mesh.triangles[t];
        const auto& x = field.mesh.positions;
        const Vector q = nearest_on_triangle(centre, x[c[0]], x[c[1]], x[c[2]]).point;
        if ((q - centre).squaredNorm() > radius * radius) return true;
        if (few.count == few.triangles.size())
            few.radius = -1;
        else
            few.triangles[few.count++] = t;
        return few.radius >= 0;
    });
    return few;
}

Nearest nearest(const DistanceField& field, const NearTriangles& few, const Vector& p, double within) {
    Search search(field, p, within);
    for (Index n = 0; n < few.count; ++n) search.look_at(few.triangles[n]);
    return search.result();
}

Nearest nearest(const DistanceField& field, const Vector& p, double within) {
    const auto& nodes = field.tree.nodes;
    Search search(field, p, within);
    struct Entry {
        Index node;
        double distance2;
    };
    std::array<Entry, 128> stack;
    std::size_t top = 0;
    if (!nodes.empty()) stack[top++] = {0, distance2(nodes[0].box, p)};
    while (top > 0) {
        const Entry entry = stack[--top];
        if (!(entry.distance2 <= search.best)) continue;
        const BoxTree::Node& node = nodes[entry.node];
        if (node.count == 0) {
            const Entry a{node.first, distance2(nodes[node.first].box, p)},
                b{node.first + 1, distance2(nodes[node.first + 1].box, p)};
            const bool a_first = a.distance2 <= b.distance2;
            stack[top++] = a_first ? b : a;
            stack[top++] = a_first ? a : b;
            continue;
        }
        for (Index slot = node.first; slot < node.first + node.count; ++slot)
            if (distance2(field.tree.boxes[slot], p) <= search.best) search.look_at(field.tree.items[slot]);
    }
    return search.result();
}

Nearest Search::result() const {
    if (triangle == no_index) return {};
    const Triangle& corners = field.mesh.triangles[triangle];
    Vector outward;
    if (on.corners() == 1) {
        outward = field.corner_normals[corners[on.weights[0] > 0 ? 0 : on.weights[1] > 0 ? 1 : 2]];
    } else if (on.corners() == 2) {
        outward = field.normals[triangle][on.weights[2] == 0 ? 0 : on.weights[0] == 0 ? 1 : 2];
    } else {
        outward = double_area_vector(field.mesh.positions, corners);
    }
    const Vector away = p - on.point;
    const bool outside = away.dot(outward) >= 0;
    const double distance = std::sqrt(best);
    // Too near to tell a direction: that of the surface.
    const Vector normal = distance > 1e-9 * field.radius ? Vector((outside ? 1 : -1) / distance * away)
                                                         : outward.stableNormalized();
    return {outside ? distance : -distance, normal, triangle};
}

}  // namespace innerspring
