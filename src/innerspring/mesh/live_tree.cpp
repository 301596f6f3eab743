#include "innerspring/mesh/live_tree.h"

namespace innerspring {

namespace {

double half_surface(const Box& box) {
    const Vector s = box.upper - box.lower;
    return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
}

Index new_slots(LiveTree& tree) {
    if (tree.free_slots.empty()) {
        tree.items.resize(tree.items.size() + tree.room, no_index);
        return Index(tree.items.size()) - tree.room;
    }
    const Index first = tree.free_slots.back();
    tree.free_slots.pop_back();
    return first;
}

void free_pair(LiveTree& tree, Index left) {
    for (Index n : {left, left + 1}) tree.parents[n] = n;
    tree.free_pairs.push_back(left);
}

/// A leaf with few items, or none, and its neighbour become one; the parent's box stays.
void merge(LiveTree& tree, Index leaf) {
    const Index parent = tree.parents[leaf], left = tree.nodes[parent].first,
                other = leaf == left ? left + 1 : left;
    BoxTree::Node &above = tree.nodes[parent], &gone = tree.nodes[leaf];
    const BoxTree::Node beside = tree.nodes[other];
    tree.leaves -= half_surface(gone.box);
    if (beside.count == 0) {  // the leaf is empty
        for (Index child : {beside.first, beside.first + 1}) tree.parents[child] = parent;
    } else {
        tree.leaves += half_surface(above.box) - half_surface(beside.box);
        for (Index n = 0; n < gone.count; ++n)
            tree.items[beside.first + beside.count + n] = tree.items[gone.first + n];
        for (Index n = 0; n < beside.count + gone.count; ++n)
            tree.leaf_of[tree.items[beside.first + n]] = parent;
    }
    tree.free_slots.push_back(gone.first);
    above.first = beside.first;
    above.count = beside.count == 0 ? 0 : beside.count + gone.count;
    free_pair(tree, left);
    tree.unfitted.push_back(parent);
}

}  // namespace

LiveTree live_tree(BoxTree&& from, Index room) {
    LiveTree tree;
    tree.room = room;
    tree.nodes = std::move(from.nodes);
    tree.parents.assign(tree.nodes.size(), no_index);
    tree.leaf_of.assign(from.items.size(), no_index);
    for (Index n = 0; n < tree.nodes.size(); ++n) {
        BoxTree::Node& node = tree.nodes[n];
        if (node.count == 0) {
            tree.parents[node.first] = tree.parents[node.first + 1] = n;
            continue;
        }
        const Index slots = new_slots(tree);
        for (Index k = 0; k < node.count; ++k) {
            tree.items[slots + k] = from.items[node.first + k];
            tree.leaf_of[tree.items[slots + k]] = n;
        }
        node.first = slots;
        tree.leaves += half_surface(node.box);
    }
    tree.built = tree.leaves;
    return tree;
}

void take_out(LiveTree& tree, Index item) {
    const Index leaf = std::exchange(tree.leaf_of[item], no_index);
    BoxTree::Node& node = tree.nodes[leaf];
    Index slot = node.first;
    while (tree.items[slot] != item) ++slot;
    tree.items[slot] = tree.items[node.first + --node.count];
    tree.unfitted.push_back(leaf);
    if (leaf == 0) {
        if (node.count > 0) return;
        tree.nodes.clear(), tree.parents.clear(), tree.items.clear(), tree.unfitted.clear(),
            tree.free_pairs.clear(), tree.free_slots.clear();
        tree.leaves = 0;
        return;
    }
    const Index left = tree.nodes[tree.parents[leaf]].first;
    const BoxTree::Node& beside = tree.nodes[leaf == left ? left + 1 : left];
    if (node.count == 0 || (beside.count > 0 && node.count + beside.count <= tree.room / 2))
        merge(tree, leaf);
}

void rename(LiveTree& tree, Index from, Index to) {
    const Index leaf = tree.leaf_of[to] = std::exchange(tree.leaf_of[from], no_index);
    if (leaf == no_index) return;
    Index slot = tree.nodes[leaf].first;
    while (tree.items[slot] != from) ++slot;
    tree.items[slot] = to;
}

namespace live_tree_parts {

void set_box(LiveTree& tree, Index n, const Box& box) {
    BoxTree::Node& node = tree.nodes[n];
    if (node.count > 0) tree.leaves += half_surface(box) - half_surface(node.box);
    node.box = box;
}

Index child_for(const LiveTree& tree, Index n, const Box& box) {
    const Index left = tree.nodes[n].first;
    const auto apart = [&](Index k) {
        const Box& other = tree.nodes[k].box;
        return ((other.lower / 2 + other.upper / 2) - (box.lower / 2 + box.upper / 2)).squaredNorm();
    };
    return apart(left) <= apart(left + 1) ? left : left + 1;
}

Index root_leaf(LiveTree& tree, const Box& box) {
    tree.nodes.push_back({box, new_slots(tree), 0});
    tree.parents.push_back(no_index);
    tree.leaves = half_surface(box);
    return 0;
}

Index split_leaf(LiveTree& tree, Index leaf) {
    Index left;
    if (tree.free_pairs.empty()) {
        left = Index(tree.nodes.size());
        tree.nodes.resize(tree.nodes.size() + 2);
        tree.parents.resize(tree.parents.size() + 2);
    } else {
        left = tree.free_pairs.back();
        tree.free_pairs.pop_back();
    }
    const BoxTree::Node full = tree.nodes[leaf];
    const Index half = full.count / 2, slots = new_slots(tree);
    tree.leaves -= half_surface(full.box);
    tree.nodes[leaf].first = left, tree.nodes[leaf].count = 0;
    tree.nodes[left] = {{}, full.first, half};
    tree.nodes[left + 1] = {{}, slots, full.count - half};
    tree.parents[left] = tree.parents[left + 1] = leaf;
    for (Index n = 0; n < full.count; ++n) {
        const Index item = tree.items[full.first + n];
        if (n >= half) tree.items[slots + n - half] = item;
        tree.leaf_of[item] = n < half ? left : left + 1;
    }
    int depth = 1;
    for (Index n = leaf; n != no_index; n = tree.parents[n]) ++depth;
    tree.deepest = std::max(tree.deepest, depth);
    return left;
}

void put(LiveTree& tree, Index leaf, Index item) {
    BoxTree::Node& node = tree.nodes[leaf];
    tree.items[node.first + node.count++] = item;
    if (tree.leaf_of.size() <= item) tree.leaf_of.resize(item + 1, no_index);
    tree.leaf_of[item] = leaf;
}

}  // namespace live_tree_parts

}  // namespace innerspring
