#include "innerspring/mesh/bvh.h"

#include <algorithm>

#include "innerspring/mesh/curve_order.h"

namespace innerspring {

namespace {

/// All but the boxes: nodes and items.
template <class Middle>
BoxTree split(std::size_t count, Index leaf_size, Middle middle) {
    BoxTree tree;
    if (count == 0) return tree;
    std::vector<CurvePlace> places = places_along_curve(count, middle);
    // Breadth first: a node's items are places[first .. first + count) until it is split, where the curve
    // goes from one half of a cube to the other. Items in one smallest cell, which the curve cannot tell
    // apart, are split at the median of their widest axis.
    tree.nodes.reserve(2 * count / leaf_size + 1);
    tree.nodes.push_back({{}, 0, Index(count)});
    for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
        const Index first = tree.nodes[n].first, all = tree.nodes[n].count;
        if (all <= leaf_size) continue;
        Index half = Index(curve_split(places, first, first + all)) - first;
        if (half == all) {
            half = all / 2;
            const auto begin = places.begin() + first, end = begin + all;
            Box range{middle(begin->index), middle(begin->index)};
            for (auto it = begin; it != end; ++it)
                range = join(range, {middle(it->index), middle(it->index)});
            Index axis = 0;
            (range.upper - range.lower).maxCoeff(&axis);
            std::nth_element(begin, begin + half, end, [&](const CurvePlace& a, const CurvePlace& b) {
                const double p = middle(a.index)[axis], q = middle(b.index)[axis];
                return p != q ? p < q : a.index < b.index;
            });
        }
        tree.nodes[n].first = Index(tree.nodes.size());
        tree.nodes[n].count = 0;
        tree.nodes.push_back({{}, first, half});
        tree.nodes.push_back({{}, first + half, all - half});
    }
    tree.items.resize(count);
    for (std::size_t i = 0; i < count; ++i) tree.items[i] = places[i].index;
    return tree;
}

template <class BoxOf>
void enclose(BoxTree& tree, BoxOf box_of) {
    for (std::size_t n = tree.nodes.size(); n-- > 0;) {  // children come after their parent
        BoxTree::Node& node = tree.nodes[n];
        if (node.count == 0) {
            node.box = join(tree.nodes[node.first].box, tree.nodes[node.first + 1].box);
        } else {
            node.box = box_of(node.first);
            for (Index i = 1; i < node.count; ++i) node.box = join(node.box, box_of(node.first + i));
        }
    }
}

}  // namespace

BoxTree build_box_tree(std::span<const Box> boxes) {
    BoxTree tree = split(boxes.size(), 4,
                         [&](std::size_t i) -> Vector { return boxes[i].lower / 2 + boxes[i].upper / 2; });
    tree.boxes.reserve(boxes.size());
    for (Index item : tree.items) tree.boxes.push_back(boxes[item]);
    enclose(tree, [&](Index slot) -> const Box& { return tree.boxes[slot]; });
    return tree;
}

BoxTree build_point_tree(std::span<const Vector> points, Index leaf_size) {
    BoxTree tree = split(points.size(), leaf_size, [&](std::size_t i) -> const Vector& { return points[i]; });
    enclose(tree, [&](Index slot) -> Box { return {points[tree.items[slot]], points[tree.items[slot]]}; });
    return tree;
}

}  // namespace innerspring
