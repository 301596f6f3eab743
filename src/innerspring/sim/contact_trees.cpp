#include "innerspring/sim/contact_trees.h"

#include <algorithm>
#include <cmath>

namespace innerspring {

namespace {

constexpr Index vertices_in_a_leaf = 8, triangles_in_a_leaf = 4;  // as built; twice as many at most

/// Where more than this share of a body changes, building is cheaper than following.
constexpr double most_changed = 0.25;

Box box_of(const Body& body, Index t) {
    const Triangle& c = body.rest.triangles[t];
    const auto& x = body.rest.positions;
    return {x[c[0]].cwiseMin(x[c[1]]).cwiseMin(x[c[2]]), x[c[0]].cwiseMax(x[c[1]]).cwiseMax(x[c[2]])};
}

double longest_side(const Body& body, Index t) {
    const Triangle& c = body.rest.triangles[t];
    const Vector &p = body.rest.positions[c[0]], &q = body.rest.positions[c[1]],
                 &r = body.rest.positions[c[2]];
    return std::sqrt(std::max({(q - p).squaredNorm(), (r - q).squaredNorm(), (p - r).squaredNorm()}));
}

std::int64_t in_units(const ContactTrees& trees, double length) {
    return std::llround(length / trees.unit);
}

void add_side(ContactTrees& trees, const Body& body, Index t) {
    trees.longest[t] = longest_side(body, t);
    trees.largest = std::max(trees.largest, trees.longest[t]);
    trees.sides += in_units(trees, trees.longest[t]);
}

}  // namespace

double ContactTrees::mean_side() const {
    if (longest.empty()) return 0;
    const double mean = unit * (double(sides) / double(longest.size()));
    if (!std::isnormal(mean)) return mean;
    const double eighth = std::exp2(std::ilogb(mean) - 3);
    return eighth * std::floor(mean / eighth);
}

void build(ContactTrees& trees, const Body& body) {
    trees = {};
    trees.vertices =
        live_tree(build_point_tree(body.rest.positions, vertices_in_a_leaf), 2 * vertices_in_a_leaf);
    trees.unit = std::exp2(std::ilogb(body.radius) - 30);
    trees.longest.resize(body.rest.triangles.size());
    for (Index t = 0; t < trees.longest.size(); ++t) add_side(trees, body, t);
}

void need_triangles(ContactTrees& trees, const Body& body) {
    if (!trees.triangles.nodes.empty()) return;
    std::vector<Box> boxes(body.rest.triangles.size());
    for (Index t = 0; t < boxes.size(); ++t) boxes[t] = box_of(body, t);
    trees.triangles = live_tree(build_box_tree(boxes), 2 * triangles_in_a_leaf);
}

void adapt(ContactTrees& trees, const Body& body, const SurfaceChange& surface, const BodyChange& change) {
    const auto many = [](std::size_t changed, std::size_t all) {
        return double(changed) > most_changed * double(all);
    };
    if (many(surface.removed.size() + surface.added.size(), body.rest.triangles.size())) {
        trees.vertices = {};
        return;
    }
    LiveTree& vertices = trees.vertices;
    const auto point = [&](Index i) -> Box { return {body.rest.positions[i], body.rest.positions[i]}; };
    vertices.leaf_of.resize(vertices.leaf_of.size() + surface.created.size(), no_index);
    for (const auto& [from, to] : change.moved) {
        if (vertices.leaf_of[to] != no_index) take_out(vertices, to);
        if (from != to) rename(vertices, from, to);
        vertices.leaf_of.pop_back();
    }
    fit(vertices, point);
    for (Index i : change.touched)
        if (vertices.leaf_of[i] == no_index) insert(vertices, i, point);

    for (const auto& [t, corners] : surface.removed) trees.sides -= in_units(trees, trees.longest[t]);
    trees.longest.resize(body.rest.triangles.size());
    for (const auto& [t, corners] : surface.added) add_side(trees, body, t);
    if (LiveTree& triangles = trees.triangles; !triangles.nodes.empty()) {
        const auto box = [&](Index t) { return box_of(body, t); };
        for (const auto& [t, corners] : surface.removed) take_out(triangles, t);
        triangles.leaf_of.resize(body.rest.triangles.size(), no_index);
        fit(triangles, box);
        for (const auto& [t, corners] : surface.added) insert(triangles, t, box);
        if (degraded(triangles)) triangles = {};
    }
    if (degraded(vertices)) vertices = {};
}

}  // namespace innerspring
