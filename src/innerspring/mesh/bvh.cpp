#include "innerspring/mesh/bvh.h"

#include <algorithm>
#include <numeric>

namespace innerspring {

BoxTree build_box_tree(std::span<const Box> boxes) {
    constexpr Index leaf_size = 4;
    BoxTree tree;
    if (boxes.empty()) return tree;
    struct Item {
        Vector middle;
        Index index;
    };
    std::vector<Item> items(boxes.size());
    for (Index i = 0; i < boxes.size(); ++i) items[i] = {boxes[i].lower / 2 + boxes[i].upper / 2, i};

    // Breadth first: a node's items are items[first .. first + count) until it is split at the median of its
    // widest axis.
    tree.nodes.reserve(boxes.size());
    tree.nodes.push_back({{}, 0, Index(boxes.size())});
    for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
        const Index first = tree.nodes[n].first, count = tree.nodes[n].count;
        if (count <= leaf_size) continue;
        const auto begin = items.begin() + first, end = begin + count, median = begin + count / 2;
        Box range{begin->middle, begin->middle};
        for (auto it = begin; it != end; ++it) range = join(range, {it->middle, it->middle});
        Index axis = 0;
        (range.upper - range.lower).maxCoeff(&axis);
        std::nth_element(begin, median, end, [axis](const Item& a, const Item& b) {
            return a.middle[axis] != b.middle[axis] ? a.middle[axis] < b.middle[axis] : a.index < b.index;
        });
        tree.nodes[n].first = Index(tree.nodes.size());
        tree.nodes[n].count = 0;
        tree.nodes.push_back({{}, first, count / 2});
        tree.nodes.push_back({{}, first + count / 2, count - count / 2});
    }

    tree.items.resize(items.size());
    tree.boxes.resize(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) {
        tree.items[i] = items[i].index;
        tree.boxes[i] = boxes[items[i].index];
    }
    for (std::size_t n = tree.nodes.size(); n-- > 0;) {  // children come after their parent
        BoxTree::Node& node = tree.nodes[n];
        if (node.count == 0) {
            node.box = join(tree.nodes[node.first].box, tree.nodes[node.first + 1].box);
        } else {
            node.box = tree.boxes[node.first];
            for (Index i = 1; i < node.count; ++i) node.box = join(node.box, tree.boxes[node.first + i]);
        }
    }
    return tree;
}

}  // namespace innerspring
