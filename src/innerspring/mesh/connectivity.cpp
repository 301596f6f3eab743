#include "innerspring/mesh/connectivity.h"

#include <algorithm>
#include <numeric>

#include "innerspring/mesh/bvh.h"
#include "innerspring/mesh/triangle_intersection.h"

namespace innerspring {

namespace {

bool repeats_a_vertex(const Triangle& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

bool has_no_area(Positions x, const Triangle& t) {
    const double longest = std::max({(x[t[1]] - x[t[0]]).squaredNorm(), (x[t[2]] - x[t[1]]).squaredNorm(),
                                     (x[t[0]] - x[t[2]]).squaredNorm()});
    return double_area_vector(x, t).norm() <= 1e-12 * longest;
}

/// The vertices in increasing order; true if that took an even permutation.
std::pair<Triangle, bool> sorted(Triangle t) {
    bool even = true;
    for (auto [i, j] : {std::pair{0, 1}, {1, 2}, {0, 1}})
        if (t[i] > t[j]) {
            std::swap(t[i], t[j]);
            even = !even;
        }
    return {t, even};
}

/// True if triangle `t` runs along edge `e` from its lower to its higher vertex.
bool along(const Triangle& t, const Edge& e) {
    return (t[0] == e.a && t[1] == e.b) || (t[1] == e.a && t[2] == e.b) || (t[2] == e.a && t[0] == e.b);
}

/// Marks all but one of the triangles that share all vertices. Returns the sets of which as many face one way
/// as the other.
std::vector<std::vector<Index>> find_equal_triangles(Triangles triangles, std::vector<Flaw>& flaws) {
    std::vector<std::vector<Index>> cancelled;
    struct Key {
        Triangle vertices;
        Index index;
        bool even;
    };
    std::vector<Key> keys;
    keys.reserve(triangles.size());
    for (Index t = 0; t < triangles.size(); ++t) {
        if (flaws[t] != Flaw::none) continue;
        const auto [vertices, even] = sorted(triangles[t]);
        keys.push_back({vertices, t, even});
    }
    std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
        return a.vertices != b.vertices ? a.vertices < b.vertices : a.index < b.index;
    });
    for (auto first = keys.begin(); first != keys.end();) {
        const auto last =
            std::find_if(first, keys.end(), [&](const Key& k) { return k.vertices != first->vertices; });
        const auto even = std::count_if(first, last, [](const Key&k) { return k.even; }),
                   odd = last - first - even;
        auto stays = first;
        if (even != odd)
            stays = std::find_if(first, last, [&](const Key& k) { return k.even == (even > odd); });
        for (auto k = first; k != last; ++k)
            if (k != stays) flaws[k->index] = Flaw::duplicate;
        if (even == odd) {
            cancelled.emplace_back();
            for (auto k = first; k != last; ++k) cancelled.back().push_back(k->index);
        }
        first = last;
    }
    return cancelled;
}

/// The triangles without a flaw; `old` gets their numbers.
std::vector<Triangle> without_flaw(Triangles triangles, const std::vector<Flaw>& flaws,
                                   std::vector<Index>& old) {
    std::vector<Triangle> kept;
    for (Index t = 0; t < triangles.size(); ++t)
        if (flaws[t] == Flaw::none) {
            kept.push_back(triangles[t]);
            old.push_back(t);
        }
    return kept;
}

/// Two balls glued along a double wall lose the wall, a fin on a ball is cut off, but a surface given twice,
/// back to back, stays once: sheets of cancelling triangles are folded if they touch an edge that would not
/// have exactly two triangles with them in place.
void find_folded_sheets(std::size_t vertices, Triangles triangles,
                        const std::vector<std::vector<Index>>& cancelled, std::vector<Flaw>& flaws) {
    std::vector<Index> old, queue;
    const std::vector<Triangle> kept = without_flaw(triangles, flaws, old);
    const Topology topology = build_topology(vertices, kept);
    std::vector<std::uint8_t> cancels(triangles.size(), 0);
    for (const auto& set : cancelled) cancels[set[0]] = 1;
    const auto two = [&](Index e) { return topology.edge_triangles[e].size() == 2; };
    for (Index n = 0; n < kept.size(); ++n)
        if (cancels[old[n]] && !std::ranges::all_of(topology.triangle_edges[n], two)) queue.push_back(n);
    while (!queue.empty()) {
        const Index n = queue.back();
        queue.pop_back();
        if (!cancels[old[n]]) continue;
        cancels[old[n]] = 0;
        flaws[old[n]] = Flaw::folded;
        for (Index e : topology.triangle_edges[n])
            if (two(e))
                queue.insert(queue.end(), topology.edge_triangles[e].begin(),
                             topology.edge_triangles[e].end());
    }
    for (const auto& set : cancelled)
        for (Index t : set) flaws[t] = flaws[set[0]] == Flaw::folded ? Flaw::folded : flaws[t];
}

/// True if the ray from `p` towards +x passes through the triangle. Points right below an edge in the
/// projection along x belong to one side only and an edge is computed the same way for both its triangles, so
/// a closed surface is met the right number of times.
bool ray_meets(Positions x, const Triangle& t, const Vector& p) {
    bool inside = false;
    for (int k = 0; k < 3; ++k) {
        const Index i = std::min(t[k], t[(k + 1) % 3]), j = std::max(t[k], t[(k + 1) % 3]);
        const Vector &a = x[i], &b = x[j];
        if ((a[2] > p[2]) == (b[2] > p[2])) continue;
        if ((orientation_along(0, a, b, p) > 0) == (b[2] > a[2])) inside = !inside;
    }
    if (!inside) return false;
    const Vector &a = x[t[0]], &b = x[t[1]], &c = x[t[2]];
    return orientation(a, b, c, p) * orientation_along(0, a, b, c) < 0;
}

void find_nested(Positions x, Triangles triangles, Pieces& found) {
    std::vector<Box> boxes;
    std::vector<Index> closed;  // per box, its triangle
    for (Index t = 0; t < triangles.size(); ++t) {
        const auto& [i, j, k] = triangles[t];
        if (!found.pieces[found.piece_of[t]].closed || !(x[i] + x[j] + x[k]).allFinite()) continue;
        boxes.push_back({x[i].cwiseMin(x[j]).cwiseMin(x[k]), x[i].cwiseMax(x[j]).cwiseMax(x[k])});
        closed.push_back(t);
    }
    if (boxes.empty()) return;
    const BoxTree tree = build_box_tree(boxes);
    std::size_t tests = 100'000'000;  // for heaps of nested pieces: those after are taken as not nested
    for (Index n = 0; n < found.pieces.size(); ++n) {
        Piece& piece = found.pieces[n];
        if (!piece.closed) continue;
        const Vector p = x[triangles[piece.first][0]];
        Box ray{p, p};
        ray.upper[0] = tree.nodes[0].box.upper[0];
        const bool done = for_each_overlap(tree, ray, [&](Index item) {
            const Index t = closed[item];
            if (found.piece_of[t] != n && ray_meets(x, triangles[t], p)) piece.nested = !piece.nested;
            return --tests > 0;
        });
        if (!done) {
            piece.nested = false;
            return;
        }
    }
}

}  // namespace

std::vector<Flaw> find_flaws(Positions x, Triangles triangles) {
    std::vector<Flaw> flaws(triangles.size(), Flaw::none);
    for (Index t = 0; t < triangles.size(); ++t)
        if (repeats_a_vertex(triangles[t])) flaws[t] = Flaw::degenerate;
    const auto cancelled = find_equal_triangles(triangles, flaws);
    if (!cancelled.empty()) find_folded_sheets(x.size(), triangles, cancelled, flaws);

    const auto flat = [&](Index t) { return flaws[t] == Flaw::none && has_no_area(x, triangles[t]); };
    bool any_flat = false;
    for (Index t = 0; t < triangles.size() && !any_flat; ++t) any_flat = flat(t);
    if (!any_flat) return flaws;
    std::vector<Index> old;
    const std::vector<Triangle> kept = without_flaw(triangles, flaws, old);
    const Topology topology = build_topology(x.size(), kept);
    for (std::size_t n = 0; n < kept.size(); ++n) {
        if (!flat(old[n])) continue;
        const bool needed = std::ranges::any_of(
            topology.triangle_edges[n], [&](Index e) { return topology.edge_triangles[e].size() == 2; });
        flaws[old[n]] = needed ? Flaw::flat : Flaw::degenerate;
    }
    return flaws;
}

Pieces find_pieces(Positions x, Triangles triangles, const Topology& topology) {
    Pieces found;
    found.piece_of.assign(triangles.size(), no_index);
    found.against.assign(triangles.size(), 0);
    std::vector<Index> members;
    for (Index start = 0; start < triangles.size(); ++start) {
        if (found.piece_of[start] != no_index) continue;
        const Index number = Index(found.pieces.size());
        Piece piece{.first = start};
        members.assign(1, start);
        found.piece_of[start] = number;
        for (std::size_t n = 0; n < members.size(); ++n) {  // against: 1 if facing against `start`, for now
            const Index t = members[n];
            piece.against += found.against[t];
            for (Index e : topology.triangle_edges[t]) {
                if (e == no_index || topology.edge_triangles[e].size() != 2) {
                    piece.closed = false;
                    continue;
                }
                const auto pair = topology.edge_triangles[e];
                const Index other = pair[0] == t ? pair[1] : pair[0];
                const Edge& edge = topology.edges[e];
                const bool agree = along(triangles[t], edge) != along(triangles[other], edge);
                const std::uint8_t against = agree ? found.against[t] : !found.against[t];
                if (found.piece_of[other] == no_index) {
                    found.piece_of[other] = number;
                    found.against[other] = against;
                    members.push_back(other);
                } else if (found.against[other] != against) {
                    piece.one_sided = true;
                }
            }
        }
        piece.triangles = Index(members.size());
        if (piece.one_sided) {  // no way round is better than that of the file
            piece.against = 0;
            for (Index t : members) found.against[t] = 0;
        }
        const bool turn = 2 * std::size_t(piece.against) > members.size();
        if (turn) piece.against = piece.triangles - piece.against;
        const Vector o = x[triangles[start][0]];
        double six_v = 0;
        for (Index t : members) {
            if (turn) found.against[t] = !found.against[t];
            const auto& [i, j, k] = triangles[t];
            const double v = (x[i] - o).dot((x[j] - o).cross(x[k] - o));
            six_v += found.against[t] ? -v : v;
        }
        piece.volume = six_v / 6;
        found.pieces.push_back(piece);
    }
    if (std::ranges::count_if(found.pieces, &Piece::closed) > 1) find_nested(x, triangles, found);
    return found;
}

std::vector<Triangle> oriented(Triangles triangles, const Pieces& pieces) {
    std::vector<Triangle> turned(triangles.begin(), triangles.end());
    for (std::size_t t = 0; t < turned.size(); ++t)
        if (bool(pieces.against[t]) != inside_out(pieces.pieces[pieces.piece_of[t]]))
            turned[t] = reversed(turned[t]);
    return turned;
}

std::vector<Index> component_starts(Triangles triangles, const Topology& topology) {
    std::vector<Index> parent(triangles.size());
    std::iota(parent.begin(), parent.end(), Index(0));
    const auto root = [&](Index t) {
        while (parent[t] != t) t = parent[t] = parent[parent[t]];
        return t;
    };
    for (std::size_t e = 0; e < topology.edges.size(); ++e)
        for (Index t : topology.edge_triangles[e]) {
            const Index a = root(topology.edge_triangles[e][0]), b = root(t);
            parent[std::max(a, b)] = std::min(a, b);  // the root is the first triangle
        }
    std::vector<Index> starts;
    for (Index t = 0; t < triangles.size(); ++t)
        if (parent[t] == t) starts.push_back(t);
    return starts;
}

std::vector<Index> non_manifold_vertices(Triangles triangles, const Topology& topology) {
    // From the first triangle at a vertex go on across the edges that end there; marks keep this linear even
    // if many share an edge.
    std::vector<Index> triangle_mark(triangles.size(), no_index), edge_mark(topology.edges.size(), no_index),
        queue, found;
    for (Index v = 0; v < topology.vertex_triangles.size(); ++v) {
        const auto fan = topology.vertex_triangles[v];
        if (fan.empty()) continue;
        queue.assign(1, fan[0]);
        triangle_mark[fan[0]] = v;
        for (std::size_t n = 0; n < queue.size(); ++n)
            for (Index e : topology.triangle_edges[queue[n]]) {
                if (e == no_index || edge_mark[e] == v ||
                    (topology.edges[e].a != v && topology.edges[e].b != v))
                    continue;
                edge_mark[e] = v;
                for (Index t : topology.edge_triangles[e]) {
                    if (triangle_mark[t] == v) continue;
                    triangle_mark[t] = v;
                    queue.push_back(t);
                }
            }
        if (queue.size() < fan.size()) found.push_back(v);
    }
    return found;
}

}  // namespace innerspring
