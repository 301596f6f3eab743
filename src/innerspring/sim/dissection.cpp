#include "innerspring/sim/dissection.h"

#include <algorithm>
namespace innerspring {

namespace {

/// Parts of at most so many vertices are not cut any more.
constexpr std::size_t leaf_size = 24;

class Cutter {
  public:
    Cutter(const Body& body, Dissection& tree) : body_(body), tree_(tree), side_(body.vertices(), 0) {
        tree_.place_of.resize(body.vertices());
        tree_.vertex_of.reserve(body.vertices());
    }

    /// Dissects the vertices of `part` and returns the node on top.
    int cut(std::vector<Index> part) {
        if (part.size() <= leaf_size) return add_node(part, {});
        std::vector<Index> best;
        int best_axis = 0;
        for (int axis = 0; axis < 3; ++axis) {
            halve(part, axis);
            for (signed char side : {1, 2}) {
                std::vector<Index> border = border_of(part, side);
                if (best.empty() || border.size() < best.size()) best = std::move(border), best_axis = axis;
                if (best.empty()) return split(part, {});  // two components
            }
        }
        halve(part, best_axis);
        return split(part, best);
    }

  private:
    int split(const std::vector<Index>& part, const std::vector<Index>& border) {
        for (Index i : border) side_[i] = 3;
        std::vector<Index> low, high;
        for (Index i : part) {
            if (side_[i] == 1) low.push_back(i);
            if (side_[i] == 2) high.push_back(i);
            side_[i] = 0;
        }
        std::vector<int> children;
        for (const auto* half : {&low, &high})
            if (!half->empty()) children.push_back(cut(*half));
        return add_node(border, children);
    }

    void halve(std::vector<Index>& part, int axis) {
        const auto& q = body_.rest.positions;
        const auto middle = part.begin() + std::ptrdiff_t(part.size() / 2);
        std::nth_element(part.begin(), middle, part.end(), [&](Index a, Index b) {
            return q[a][axis] < q[b][axis] || (q[a][axis] == q[b][axis] && a < b);
        });
        for (auto i = part.begin(); i != part.end(); ++i) side_[*i] = i < middle ? 1 : 2;
    }

    /// The vertices on one side with a neighbour on the other.
    std::vector<Index> border_of(const std::vector<Index>& part, signed char side) const {
        std::vector<Index> border;
        for (Index i : part) {
            if (side_[i] != side) continue;
            for (const Spoke& spoke : body_.spokes_of(i))
                if (side_[spoke.neighbour] == 3 - side) {
                    border.push_back(i);
                    break;
                }
        }
        return border;
    }

    int add_node(const std::vector<Index>& vertices, std::vector<int> children) {
        const int node = int(tree_.nodes.size());
        tree_.nodes.emplace_back();
        for (int child : children) tree_.nodes[std::size_t(child)].parent = node;
        tree_.nodes.back().children = std::move(children);
        for (Index i : vertices) {
            const int place = int(tree_.vertex_of.size());
            tree_.vertex_of.push_back(i);
            tree_.node_of.push_back(node);
            tree_.place_of[i] = place;
            tree_.nodes.back().columns.push_back(place);
        }
        return node;
    }

    const Body& body_;
    Dissection& tree_;
    std::vector<signed char> side_;  ///< 1, 2: the halves of the part at hand; 3: its border; 0: elsewhere
};

/// Rows and segments from the children's.
void find_rows(Dissection& tree, const Body& body, int n, std::vector<int>& mark) {
    Dissection::Node& node = tree.nodes[std::size_t(n)];
    node.rows.clear(), node.segments.clear();
    mark.resize(tree.node_of.size(), -1);
    auto take = [&](int place) {
        if (tree.node_of[std::size_t(place)] <= n || mark[std::size_t(place)] == n) return;
        mark[std::size_t(place)] = n;
        node.rows.push_back(place);
    };
    for (int place : node.columns)
        for (const Spoke& spoke : body.spokes_of(tree.vertex_of[std::size_t(place)]))
            take(tree.place_of[spoke.neighbour]);
    for (int child : node.children)
        for (int place : tree.nodes[std::size_t(child)].rows) take(place);
    for (int place : node.rows) mark[std::size_t(place)] = -1;
    std::sort(node.rows.begin(), node.rows.end(), [&](int a, int b) {
        const int node_a = tree.node_of[std::size_t(a)], node_b = tree.node_of[std::size_t(b)];
        return node_a < node_b || (node_a == node_b && a < b);
    });
    for (int i = 0; i < int(node.rows.size()); ++i) {
        const int owner = tree.node_of[std::size_t(node.rows[std::size_t(i)])];
        if (node.segments.empty() || node.segments.back().node != owner)
            node.segments.push_back({owner, i, i});
        node.segments.back().last = i + 1;
    }
}

}  // namespace

Dissection dissect(const Body& body) {
    Dissection tree;
    std::vector<Index> all(body.vertices());
    for (Index i = 0; i < all.size(); ++i) all[i] = i;
    Cutter(body, tree).cut(std::move(all));
    std::vector<int> mark;
    for (int n = 0; n < int(tree.nodes.size()); ++n) {
        find_rows(tree, body, n, mark);
        tree.nodes[std::size_t(n)].cut = tree.nodes[std::size_t(n)].columns.size();
    }
    for (int n = 0; n < int(tree.nodes.size()); ++n)
        for (int s = 0; s < int(tree.nodes[std::size_t(n)].segments.size()); ++s)
            tree.nodes[std::size_t(tree.nodes[std::size_t(n)].segments[std::size_t(s)].node)]
                .updaters.push_back({n, s});
    return tree;
}

std::optional<std::vector<int>> update(Dissection& tree, const Body& body, const SurfaceChange& surface,
                                       const BodyChange& change) {
    std::vector<int> nodes;
    auto concern = [&](int place) { nodes.push_back(tree.node_of[std::size_t(place)]); };
    // Indices first as they were during the change: new vertices at the end, then the last ones moving.
    tree.place_of.resize(tree.place_of.size() + surface.created.size(), -1);
    for (const auto& created : surface.created) {
        const int a = tree.node_of[std::size_t(tree.place_of[created.halves.a])],
                  b = tree.node_of[std::size_t(tree.place_of[created.halves.b])];
        const int place = int(tree.vertex_of.size()), node = std::min(a, b);
        tree.place_of[created.vertex] = place;
        tree.vertex_of.push_back(created.vertex);
        tree.node_of.push_back(node);
        tree.nodes[std::size_t(node)].columns.push_back(place);
        concern(place);
    }
    for (const auto& [from, to] : change.moved) {
        const int gone = tree.place_of[to];
        concern(gone);
        auto& columns = tree.nodes[std::size_t(tree.node_of[std::size_t(gone)])].columns;
        std::erase(columns, gone);
        tree.vertex_of[std::size_t(gone)] = no_index;
        tree.node_of[std::size_t(gone)] = -1;
        if (from != to) {
            tree.place_of[to] = tree.place_of[from];
            tree.vertex_of[std::size_t(tree.place_of[to])] = to;
        }
        tree.place_of.pop_back();
    }
    for (Index i : change.touched) concern(tree.place_of[i]);
    // All above, and their rows in order; the others keep theirs.
    std::vector<char> concerned(tree.nodes.size(), 0);
    for (std::size_t k = 0; k < nodes.size(); ++k)
        for (int n = nodes[k]; n >= 0 && !concerned[std::size_t(n)]; n = tree.nodes[std::size_t(n)].parent)
            concerned[std::size_t(n)] = 1;
    nodes.clear();
    std::vector<int> mark;
    for (int n = 0; n < int(tree.nodes.size()); ++n) {
        if (!concerned[std::size_t(n)]) continue;
        nodes.push_back(n);
        find_rows(tree, body, n, mark);
        std::erase_if(tree.nodes[std::size_t(n)].updaters,
                      [&](const Dissection::Updater& u) { return concerned[std::size_t(u.node)]; });
    }
    for (int n : nodes) {
        for (int s = 0; s < int(tree.nodes[std::size_t(n)].segments.size()); ++s)
            tree.nodes[std::size_t(tree.nodes[std::size_t(n)].segments[std::size_t(s)].node)]
                .updaters.push_back({n, s});
    }
    for (int n : nodes) {
        auto& node = tree.nodes[std::size_t(n)];
        if (node.columns.size() > std::max(8 * leaf_size, 4 * node.cut)) return std::nullopt;
        std::ranges::sort(node.updaters, {}, &Dissection::Updater::node);
    }
    return nodes;
}

}  // namespace innerspring
