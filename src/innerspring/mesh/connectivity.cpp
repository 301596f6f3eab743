#include "innerspring/mesh/connectivity.h"

#include <algorithm>
#include <numeric>
#include <tuple>

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
std::vector<std::vector<Index>> find_equal_triangles(std::size_t vertices, Triangles triangles,
                                                     std::vector<Flaw>& flaws) {
    std::vector<std::vector<Index>> cancelled;
    // Bucket by the lowest vertex, where a handful of triangles meet, and sort within a bucket.
    const auto lowest = [&](std::size_t t) {
        return flaws[t] == Flaw::none ? *std::ranges::min_element(triangles[t]) : no_index;
    };
    const Rows buckets = rows_by_key(vertices, triangles.size(), lowest);
    struct Key {
        Index middle, highest, index;
        bool even;
        bool same_vertices(const Key& k) const { return middle == k.middle && highest == k.highest; }
    };
    std::vector<Key> keys;
    for (std::size_t v = 0; v < vertices; ++v) {
        keys.clear();
        for (Index t : buckets[v]) {
            const auto [corners, even] = sorted(triangles[t]);
            keys.push_back({corners[1], corners[2], t, even});
        }
        std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
            return std::tie(a.middle, a.highest, a.index) < std::tie(b.middle, b.highest, b.index);
        });
        for (auto first = keys.begin(); first != keys.end();) {
            const auto last =
                std::find_if(first, keys.end(), [&](const Key& k) { return !k.same_vertices(*first); });
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
    const auto cancelled = find_equal_triangles(x.size(), triangles, flaws);
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
    // Sets of triangles, joined edge by edge, with the first as their root; `against`: 1 if a triangle faces
    // against its parent.
    std::vector<Index> parent(triangles.size()), rim;
    std::iota(parent.begin(), parent.end(), Index(0));
    std::vector<std::uint8_t>& against = found.against;
    against.assign(triangles.size(), 0);
    const auto root = [&](Index t) {
        std::uint8_t turned = 0;
        while (parent[t] != t) {
            const Index up = parent[t];
            against[t] ^= against[up];  // 0 at a root
            parent[t] = parent[up];
            turned ^= against[t];
            t = parent[t];
        }
        return std::pair(t, turned);
    };
    std::vector<Index> one_sided;
    for (Index e = 0; e < topology.edges.size(); ++e) {
        const auto pair = topology.edge_triangles[e];
        if (pair.size() != 2) {
            rim.insert(rim.end(), pair.begin(), pair.end());
            continue;
        }
        const Edge& edge = topology.edges[e];
        const bool opposed = along(triangles[pair[0]], edge) == along(triangles[pair[1]], edge);
        const auto [p, p_turned] = root(pair[0]);
        const auto [q, q_turned] = root(pair[1]);
        const std::uint8_t turned = p_turned ^ q_turned ^ std::uint8_t(opposed);
        if (p != q)
            parent[std::max(p, q)] = std::min(p, q), against[std::max(p, q)] = turned;
        else if (turned)
            one_sided.push_back(p);
    }
    // In increasing order a triangle's parent is done before it.
    found.piece_of.resize(triangles.size());
    for (Index t = 0; t < triangles.size(); ++t) {
        if (parent[t] == t) {
            found.piece_of[t] = Index(found.pieces.size());
            found.pieces.push_back({.first = t});
        } else {
            found.piece_of[t] = found.piece_of[parent[t]];
            against[t] ^= against[parent[t]];
        }
        Piece& piece = found.pieces[found.piece_of[t]];
        ++piece.triangles;
        piece.against += against[t];
        if (std::ranges::count(topology.triangle_edges[t], no_index) > 0) piece.closed = false;
    }
    for (Index t : rim) found.pieces[found.piece_of[t]].closed = false;
    for (Index t : one_sided) found.pieces[found.piece_of[t]].one_sided = true;
    // From "against the first" to "against the majority"; on a piece with one side no way round is better
    // than that of the file.
    std::vector<std::uint8_t> turn;
    for (Piece& piece : found.pieces) {
        turn.push_back(2 * std::size_t(piece.against) > piece.triangles);
        if (piece.one_sided)
            piece.against = 0, turn.back() = 0;
        else if (turn.back())
            piece.against = piece.triangles - piece.against;
    }
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        Piece& piece = found.pieces[found.piece_of[t]];
        if (piece.one_sided) found.against[t] = 0;
        if (turn[found.piece_of[t]]) found.against[t] = !found.against[t];
        const Vector& o = x[triangles[piece.first][0]];
        const auto& [i, j, k] = triangles[t];
        const double six_v = (x[i] - o).dot((x[j] - o).cross(x[k] - o));
        piece.volume += found.against[t] ? -six_v : six_v;
    }
    for (Piece& piece : found.pieces) piece.volume /= 6;
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
