#pragma once
#include <algorithm>

#include "innerspring/mesh/bvh.h"

namespace innerspring {

/// A box tree whose items come and go, each at the cost of a way from the root to a leaf. Every leaf has the
/// same number of slots; one that overflows is split, one that empties is taken together with its neighbour.
struct LiveTree : BoxTree {
    Index room = 0;                             ///< slots of a leaf
    std::vector<Index> parents;                 ///< per node; no_index: the root. Its own number: not in use
    std::vector<Index> leaf_of;                 ///< per item; no_index: not in the tree
    std::vector<Index> unfitted;                ///< nodes whose box may be too large
    std::vector<Index> free_pairs, free_slots;  ///< first of two nodes; first slot of a leaf
    double leaves = 0, built = 0;  ///< half the surface of the leaves' boxes, now and as built [m^2]
    int deepest = 0;               ///< leaf that was split
};

/// `room` is at least as much as the leaves hold.
LiveTree live_tree(BoxTree&& tree, Index room);

/// Takes an item out; boxes stay as they are until fit().
void take_out(LiveTree& tree, Index item);

/// Item `from` is now item `to`, which was taken out.
void rename(LiveTree& tree, Index from, Index to);

/// Whether the tree should rather be built anew: its leaves cover four times what they did, or it grew so
/// deep that a search could run out of stack.
inline bool degraded(const LiveTree& tree) {
    return tree.leaves > 4 * tree.built || tree.deepest > 100;
}

namespace live_tree_parts {

void set_box(LiveTree& tree, Index node, const Box& box);
Index child_for(const LiveTree& tree, Index node, const Box& box);
Index root_leaf(LiveTree& tree, const Box& box);
/// The left of two new leaves under `leaf`, with half of its items in the order they have, and room for one
/// more in either.
Index split_leaf(LiveTree& tree, Index leaf);
void put(LiveTree& tree, Index leaf, Index item);

template <class BoxOf>
Box box_of_items(const LiveTree& tree, Index leaf, BoxOf&& box_of) {
    const BoxTree::Node& node = tree.nodes[leaf];
    Box box = box_of(tree.items[node.first]);
    for (Index n = 1; n < node.count; ++n) box = join(box, box_of(tree.items[node.first + n]));
    return box;
}

}  // namespace live_tree_parts

/// Makes boxes as small as their items after some were taken out. box_of(item) is its box.
template <class BoxOf>
void fit(LiveTree& tree, BoxOf&& box_of) {
    using namespace live_tree_parts;
    for (Index n : tree.unfitted)
        for (bool shrinks = true; shrinks && n != no_index && tree.parents[n] != n; n = tree.parents[n]) {
            const BoxTree::Node& node = tree.nodes[n];
            const Box box = node.count > 0 ? box_of_items(tree, n, box_of)
                                           : join(tree.nodes[node.first].box, tree.nodes[node.first + 1].box);
            shrinks = box.lower != node.box.lower || box.upper != node.box.upper;
            set_box(tree, n, box);
        }
    tree.unfitted.clear();
}

/// Adds an item that is not in the tree, on the way of the nearer box middles: by growth a large box would
/// draw all to itself that lies in it.
template <class BoxOf>
void insert(LiveTree& tree, Index item, BoxOf&& box_of) {
    using namespace live_tree_parts;
    const Box box = box_of(item);
    if (tree.nodes.empty()) root_leaf(tree, box);
    Index n = 0;
    for (;; n = child_for(tree, n, box)) {
        set_box(tree, n, join(tree.nodes[n].box, box));
        if (tree.nodes[n].count > 0 || tree.nodes.size() == 1) break;
    }
    if (tree.nodes[n].count < tree.room) return put(tree, n, item);
    // Halved across the axis along which the middles are farthest apart.
    const auto middle = [&](Index i) -> Vector {
        const Box b = box_of(i);
        return b.lower / 2 + b.upper / 2;
    };
    const BoxTree::Node& full = tree.nodes[n];
    Box range{middle(item), middle(item)};
    for (Index k = 0; k < full.count; ++k) {
        const Vector m = middle(tree.items[full.first + k]);
        range = join(range, {m, m});
    }
    Index axis = 0;
    (range.upper - range.lower).maxCoeff(&axis);
    std::sort(tree.items.begin() + full.first, tree.items.begin() + full.first + full.count,
              [&](Index a, Index b) {
                  const double p = middle(a)[axis], q = middle(b)[axis];
                  return p != q ? p < q : a < b;
              });
    const Index left = split_leaf(tree, n);
    for (Index leaf : {left, left + 1}) set_box(tree, leaf, box_of_items(tree, leaf, box_of));
    const Index chosen = child_for(tree, n, box);
    set_box(tree, chosen, join(tree.nodes[chosen].box, box));
    put(tree, chosen, item);
}

}  // namespace innerspring
