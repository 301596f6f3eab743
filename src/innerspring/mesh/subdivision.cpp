#include "innerspring/mesh/subdivision.h"

#include <fmt/format.h>

#include <algorithm>

#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

Index take(std::vector<Index>& list) {
    const Index last = list.back();
    list.pop_back();
    return last;
}

}  // namespace

Subdivision::Subdivision(const SurfaceMesh& mesh, Placement placement) : placement_(placement) {
    const Topology topology = build_topology(mesh.positions.size(), mesh.triangles);
    edges_.reserve(topology.edges.size());
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
        const Edge& edge = topology.edges[e];
        const auto triangles = topology.edge_triangles[e];
        if (triangles.size() != 2)
            throw InputError(fmt::format(
                "{}: edge {}-{} has {} triangle{} where a closed surface has two; see innerspring "
                "check",
                mesh.name, edge.a, edge.b, triangles.size(), triangles.size() == 1 ? "" : "s"));
        edges_.push_back({edge.a, edge.b});
        edges_.back().nodes = {triangles[0], triangles[1]};
    }
    nodes_.reserve(mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (Index e : topology.triangle_edges[t])
            if (e == no_index)
                throw InputError(fmt::format("{}: triangle {} has two equal corners; see innerspring check",
                                             mesh.name, t));
        nodes_.push_back({mesh.triangles[t], topology.triangle_edges[t]});
        nodes_.back().shown[0] = Index(t);
        triangle_node_.push_back(Index(t));
    }
    index_.resize(mesh.positions.size());
    for (std::size_t i = 0; i < index_.size(); ++i) index_[i] = Index(i);
    number_ = index_;
    if (placement == Placement::pn) normals_ = vertex_normals(mesh.positions, mesh.triangles);
}

void Subdivision::reserve(std::size_t vertices) {
    // A vertex more is two triangles and three edges more; with the parents of all levels, some more.
    nodes_.reserve(nodes_.size() + 3 * vertices);
    edges_.reserve(edges_.size() + 5 * vertices);
    index_.reserve(index_.size() + vertices);
    number_.reserve(number_.size() + vertices);
    if (placement_ == Placement::pn) normals_.reserve(normals_.size() + vertices);
    triangle_node_.reserve(triangle_node_.size() + 2 * vertices);
    families_.reserve(families_.size() + vertices);
}

int Subdivision::depth(Index triangle) const {
    int depth = 0;
    for (Index node = nodes_[triangle_node_[triangle]].parent; node != no_index; node = nodes_[node].parent)
        ++depth;
    return depth;
}

int Subdivision::cut_sides(Index node) const {
    int cut = 0;
    for (Index e : nodes_[node].edges) cut += edges_[e].middle != no_index;
    return cut;
}

Index Subdivision::across(Index edge, Index node) const {
    const auto& n = edges_[edge].nodes;
    return n[0] == node ? n[1] : n[0];
}

void Subdivision::touch(Index node) {
    if (nodes_[node].touched) return;
    nodes_[node].touched = true;
    touched_.push_back(node);
}

void Subdivision::attach(Index edge, Index node) {
    auto& n = edges_[edge].nodes;
    n[n[0] == no_index ? 0 : 1] = node;
}

void Subdivision::detach(Index edge, Index node) {
    auto& n = edges_[edge].nodes;
    n[n[0] == node ? 0 : 1] = no_index;
}

Index Subdivision::new_edge(Index a, Index b, Index parent) {
    EdgeRecord record{a, b};
    record.parent = parent;
    if (free_edges_.empty()) {
        edges_.push_back(record);
        return Index(edges_.size() - 1);
    }
    const Index e = take(free_edges_);
    edges_[e] = record;
    return e;
}

Index Subdivision::half_at(Index edge, Index corner) const {
    return edges_[edge].halves[edges_[edge].a == corner ? 0 : 1];
}

/// The middle of the edge, or of the cubic that its end normals make of it (PN triangles, Vlachos et al.
/// 2001: control points (2 p_0 + p_1 - w_01 n_0)/3 and (2 p_1 + p_0 - w_10 n_1)/3, w_ij = (p_j - p_i).n_i).
Vector Subdivision::middle(const SurfaceMesh& mesh, Index a, Index b, Index number) {
    const Vector &p = mesh.positions[index_[a]], &q = mesh.positions[index_[b]];
    const Vector straight = 0.5 * (p + q);
    if (placement_ == Placement::in_plane) return straight;
    normals_.resize(std::max<std::size_t>(normals_.size(), number + 1));
    const Vector d = q - p, n = normals_[a], m = normals_[b];
    // The quadratic normal of the same scheme, halfway.
    const double turn = 2 * d.dot(n + m) / d.squaredNorm();
    normals_[number] = (n + m - turn * d).normalized();
    return straight - (d.dot(n) * n - d.dot(m) * m) / 8;
}

void Subdivision::halve(SurfaceMesh& mesh, Index edge, SurfaceChange& change) {
    if (edges_[edge].middle != no_index) return;
    const Index a = edges_[edge].a, b = edges_[edge].b;
    const Index vertex = Index(mesh.positions.size());
    const Index number = free_numbers_.empty() ? Index(index_.size()) : take(free_numbers_);
    if (number == index_.size()) index_.push_back(vertex);
    index_[number] = vertex;
    number_.push_back(number);
    mesh.positions.push_back(middle(mesh, a, b, number));
    change.created.push_back({vertex, {std::min(index_[a], index_[b]), std::max(index_[a], index_[b])}});
    edges_[edge].middle = number;
    const Index first = new_edge(a, number, edge), second = new_edge(number, b, edge);
    edges_[edge].halves = {first, second};
}

void Subdivision::split_node(SurfaceMesh& mesh, Index node, SurfaceChange& change) {
    if (!leaf(node)) return;
    // A side without a neighbour of this level is a half of a coarser triangle's side: that one first.
    const std::array<Index, 3> side = nodes_[node].edges;
    for (Index e : side)
        if (across(e, node) == no_index)
            split_node(mesh, across(edges_[e].parent, nodes_[node].parent), change);

    touch(node);
    const Triangle corner = nodes_[node].corners;
    Triangle m;
    for (int k = 0; k < 3; ++k) {
        halve(mesh, side[k], change);
        m[k] = edges_[side[k]].middle;
    }
    // Across corner k, from the middle of side k to that of the side before.
    std::array<Index, 3> inner;
    for (int k = 0; k < 3; ++k) inner[k] = new_edge(m[k], m[(k + 2) % 3], no_index);

    Index first;
    if (free_nodes_.empty()) {
        first = Index(nodes_.size());
        nodes_.resize(nodes_.size() + 4);
    } else {
        first = take(free_nodes_);
    }
    for (int k = 0; k < 3; ++k) {
        const int before = (k + 2) % 3;
        nodes_[first + k] = Node{{corner[k], m[k], m[before]},
                                 {half_at(side[k], corner[k]), inner[k], half_at(side[before], corner[k])}};
    }
    nodes_[first + 3] = Node{{m[0], m[1], m[2]}, {inner[1], inner[2], inner[0]}};
    for (Index child = first; child < first + 4; ++child) {
        nodes_[child].parent = node;
        for (Index e : nodes_[child].edges) attach(e, child);
        touch(child);
    }
    nodes_[node].children = first;
    families_.push_back(node);
    for (Index e : side) {
        const Index other = across(e, node);
        if (!leaf(other)) continue;
        touch(other);
        to_close_.push_back(other);
    }
}

/// Splits every leaf that two cuts have come to.
void Subdivision::close(SurfaceMesh& mesh, SurfaceChange& change) {
    while (!to_close_.empty()) {
        const Index node = take(to_close_);
        if (leaf(node) && cut_sides(node) >= 2) split_node(mesh, node, change);
    }
}

SurfaceChange Subdivision::split(SurfaceMesh& mesh, std::span<const Index> triangles, int levels) {
    SurfaceChange change;
    families_before_ = families_.size();
    std::vector<Index> chosen, children;
    for (Index t : triangles) chosen.push_back(triangle_node_[t]);
    make_set(chosen);  // both halves of a green pair mean their parent
    for (int level = 0; level < levels; ++level) {
        children.clear();
        for (Index node : chosen) {
            split_node(mesh, node, change);
            for (Index k = 0; k < 4; ++k) children.push_back(nodes_[node].children + k);
        }
        close(mesh, change);
        chosen.swap(children);
    }
    show(mesh, change);
    return change;
}

/// Whether the node, once it and all that are going are leaves, stands as one: not split again at once.
bool Subdivision::may_go(Index node) const {
    const auto stays = [&](Index n) { return n != no_index && !leaf(n) && !nodes_[n].going; };
    for (Index child = nodes_[node].children; child < nodes_[node].children + 4; ++child)
        if (stays(child)) return false;
    int cut = 0;
    for (Index e : nodes_[node].edges) {
        cut += stays(across(e, node));
        for (Index half : edges_[e].halves)
            for (Index n : edges_[half].nodes)
                if (stays(n)) return false;
    }
    return cut < 2;
}

void Subdivision::unsplit_node(Index node, SurfaceChange& change) {
    const Index first = nodes_[node].children;
    const std::array<Index, 3> inner = nodes_[first + 3].edges;
    for (Index child = first; child < first + 4; ++child) {
        for (Index e : nodes_[child].edges) detach(e, child);
        nodes_[child].dead = true;
        touch(child);
    }
    dying_.push_back(first);
    free_edges_.insert(free_edges_.end(), inner.begin(), inner.end());
    for (Index e : nodes_[node].edges) {
        const Index other = across(e, node);
        if (!leaf(other)) continue;
        touch(other);
        const Index a = index_[edges_[e].a], b = index_[edges_[e].b];
        change.retired.push_back({index_[edges_[e].middle], {std::min(a, b), std::max(a, b)}});
        edges_[e].middle = no_index;
        for (Index half : edges_[e].halves) free_edges_.push_back(half);
        edges_[e].halves = {no_index, no_index};
    }
    touch(node);
    nodes_[node].children = no_index;
    nodes_[node].going = false;
}

/// Of the families from `first` on, undoes the largest set of those chosen that can go together.
template <class Chosen>
SurfaceChange Subdivision::unsplit_families(SurfaceMesh& mesh, std::size_t first, const Chosen& chosen) {
    SurfaceChange change;
    const std::span<Index> families = std::span(families_).subspan(first);
    for (Index node : families) nodes_[node].going = chosen(nodes_[node].corners);
    for (bool changed = true; changed;) {
        changed = false;
        for (Index node : families)
            if (nodes_[node].going && !may_go(node)) nodes_[node].going = false, changed = true;
    }
    for (auto node = families.rbegin(); node != families.rend(); ++node) {  // children before parents
        if (!nodes_[*node].going) continue;
        unsplit_node(*node, change);
        *node = no_index;
    }
    std::erase(families_, no_index);
    show(mesh, change);
    return change;
}

SurfaceChange Subdivision::unsplit(SurfaceMesh& mesh, const Keep& keep) {
    auto at = [&](Index number) -> const Vector& { return mesh.positions[index_[number]]; };
    return unsplit_families(mesh, 0, [&](const Triangle& c) { return !keep(at(c[0]), at(c[1]), at(c[2])); });
}

SurfaceChange Subdivision::undo_split(SurfaceMesh& mesh) {
    return unsplit_families(mesh, families_before_, [](const Triangle&) { return true; });
}

/// Brings the mesh's triangles in line with the leaves that were touched.
void Subdivision::show(SurfaceMesh& mesh, SurfaceChange& change) {
    struct Wanted {
        Index node;
        int which;
        Triangle corners;  ///< numbers
    };
    std::vector<Index> holes;
    std::vector<Wanted> wanted;
    for (Index n : touched_) {
        Node& node = nodes_[n];
        node.touched = false;
        std::uint8_t green = 3;
        for (std::uint8_t k = 0; k < 3; ++k)
            if (edges_[node.edges[k]].middle != no_index) green = k;
        const bool wants = !node.dead && leaf(n), was = node.shown[0] != no_index;
        if (wants == was && (!wants || green == node.green)) continue;
        for (Index& t : node.shown) {
            if (t == no_index) continue;
            change.removed.push_back({t, mesh.triangles[t]});
            holes.push_back(t);
            t = no_index;
        }
        if (!wants) continue;
        node.green = green;
        const Triangle& c = node.corners;
        if (green == 3) {
            wanted.push_back({n, 0, c});
        } else {
            const Index a = c[green], b = c[(green + 1) % 3], apex = c[(green + 2) % 3];
            const Index m = edges_[node.edges[green]].middle;
            wanted.push_back({n, 0, {a, m, apex}});
            wanted.push_back({n, 1, {m, b, apex}});
        }
    }
    std::sort(holes.begin(), holes.end());
    std::size_t filled = 0;
    for (const Wanted& w : wanted) {
        Index t = Index(mesh.triangles.size());
        if (filled < holes.size()) {
            t = holes[filled++];
        } else {
            mesh.triangles.emplace_back();
            triangle_node_.emplace_back();
        }
        mesh.triangles[t] = {index_[w.corners[0]], index_[w.corners[1]], index_[w.corners[2]]};
        triangle_node_[t] = w.node;
        nodes_[w.node].shown[w.which] = t;
        change.added.push_back({t, mesh.triangles[t]});
    }
    // Holes that are left, all above those filled, are closed by the last triangles.
    for (std::size_t left = holes.size(); left > filled;) {
        const Index last = Index(mesh.triangles.size() - 1);
        if (holes[left - 1] == last) {
            --left;
        } else {
            const Index hole = holes[filled++];
            change.removed.push_back({last, mesh.triangles[last]});
            change.added.push_back({hole, mesh.triangles[last]});
            mesh.triangles[hole] = mesh.triangles[last];
            triangle_node_[hole] = triangle_node_[last];
            Node& node = nodes_[triangle_node_[last]];
            node.shown[node.shown[0] == last ? 0 : 1] = hole;
        }
        mesh.triangles.pop_back();
        triangle_node_.pop_back();
    }
    touched_.clear();
    free_nodes_.insert(free_nodes_.end(), dying_.begin(), dying_.end());
    dying_.clear();
}

void Subdivision::take_out(Index to, Index from) {
    free_numbers_.push_back(number_[to]);
    number_[to] = number_[from];
    index_[number_[to]] = to;
    number_.pop_back();
}

}  // namespace innerspring
