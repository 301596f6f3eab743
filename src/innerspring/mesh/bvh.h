#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

struct Box {
    Vector lower = Vector::Zero(), upper = Vector::Zero();
};

/// True if the closed boxes have a point in common.
inline bool overlap(const Box& a, const Box& b) {
    return (a.lower.array() <= b.upper.array()).all() && (b.lower.array() <= a.upper.array()).all();
}

inline Box join(const Box& a, const Box& b) {
    return {a.lower.cwiseMin(b.lower), a.upper.cwiseMax(b.upper)};
}

/// A tree of boxes in flat arrays, the same on every machine: halved in space down to 2^-21 of its width, by
/// the number of boxes beyond that. So it is at most 63 + 33 levels deep, whatever the boxes.
struct BoxTree {
    struct Node {
        Box box;
        Index first = 0;  ///< leaf: first of its items; inner node: its left child, the right one follows
        Index count = 0;  ///< items of a leaf; 0: inner node
    };
    std::vector<Node> nodes;   ///< root first; empty for no items
    std::vector<Index> items;  ///< per slot, the item's number in the array the tree was built from
    std::vector<Box> boxes;    ///< per slot, the item's box; none for points
};

/// Linear time, but for boxes that lie closer together than 2^-21 of the whole. The boxes must be finite.
BoxTree build_box_tree(std::span<const Box> boxes);

/// The same over points, the boxes of leaves left out.
BoxTree build_point_tree(std::span<const Vector> points, Index leaf_size);

/// Calls fn(item) for every item whose box overlaps `box`, until fn returns false. False if it was stopped.
template <class Function>
bool for_each_overlap(const BoxTree& tree, const Box& box, Function&& fn) {
    std::array<Index, 128> stack;
    std::size_t top = 0;
    if (!tree.nodes.empty()) stack[top++] = 0;
    while (top > 0) {
        const BoxTree::Node& node = tree.nodes[stack[--top]];
        if (!overlap(node.box, box)) continue;
        if (node.count == 0) {
            stack[top++] = node.first + 1;
            stack[top++] = node.first;
        }
        for (Index slot = node.first; slot < node.first + node.count; ++slot)
            if (overlap(tree.boxes[slot], box) && !fn(tree.items[slot])) return false;
    }
    return true;
}

/// Calls fn(item) for every item in a leaf whose box, and those around it, are near(box).
template <class Near, class Function>
void for_each_near(const BoxTree& tree, Near&& near, Function&& fn) {
    std::array<Index, 128> stack;
    std::size_t top = 0;
    if (!tree.nodes.empty()) stack[top++] = 0;
    while (top > 0) {
        const BoxTree::Node& node = tree.nodes[stack[--top]];
        if (!near(node.box)) continue;
        if (node.count == 0) {
            stack[top++] = node.first + 1;
            stack[top++] = node.first;
        }
        for (Index slot = node.first; slot < node.first + node.count; ++slot) fn(tree.items[slot]);
    }
}

/// Calls fn(item, other) once for every pair of items whose boxes overlap, until fn returns false. False if
/// it was stopped.
template <class Function>
bool for_each_self_overlap(const BoxTree& tree, Function&& fn) {
    std::vector<std::pair<Index, Index>> stack;
    if (!tree.nodes.empty()) stack.emplace_back(0, 0);
    while (!stack.empty()) {
        const auto [p, q] = stack.back();
        stack.pop_back();
        const BoxTree::Node &a = tree.nodes[p], &b = tree.nodes[q];
        if (p != q && !overlap(a.box, b.box)) continue;
        if (a.count > 0 && b.count > 0) {
            for (Index i = a.first; i < a.first + a.count; ++i)
                for (Index j = p == q ? i + 1 : b.first; j < b.first + b.count; ++j)
                    if (overlap(tree.boxes[i], tree.boxes[j]) && !fn(tree.items[i], tree.items[j]))
                        return false;
        } else if (p == q) {
            stack.insert(stack.end(),
                         {{a.first, a.first}, {a.first + 1, a.first + 1}, {a.first, a.first + 1}});
        } else if (a.count == 0 &&
                   (b.count > 0 || p < q)) {  // the lower number is the larger or as large a node
            stack.insert(stack.end(), {{a.first, q}, {a.first + 1, q}});
        } else {
            stack.insert(stack.end(), {{p, b.first}, {p, b.first + 1}});
        }
    }
    return true;
}

}  // namespace innerspring
