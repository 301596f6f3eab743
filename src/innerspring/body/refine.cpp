#include "innerspring/body/refine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/body/distribution.h"
#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

/// C's K_i of a triangle summed over its corners, for E = 1 Pa [m]: what it adds to the sum of Eq. 3.
double stiffness_share(const Body& body, const Triangle& t) {
    double sum = 0;
    for (Index i : t) sum += 1 / (body.L[i] * body.L[i]);
    return sum * virtual_tetrahedron(body.centre, body.rest.positions, body.L, t);
}

Spoke* find_spoke(Body& body, Index vertex, Index neighbour) {
    Spoke* first = body.spokes.data() + body.rows[vertex].first;
    Spoke* last = first + body.rows[vertex].count;
    Spoke* found = std::find_if(first, last, [&](const Spoke& s) { return s.neighbour == neighbour; });
    return found == last ? nullptr : found;
}

void add_spoke(Body& body, Index vertex, const Spoke& spoke) {
    SpokeRow& row = body.rows[vertex];
    if (row.count == row.room) {
        // No room in place: the row moves to the end and leaves a gap.
        const Index first = Index(body.spokes.size());
        body.spokes.resize(first + row.count + 4u);
        std::copy_n(body.spokes.begin() + row.first, row.count, body.spokes.begin() + first);
        row = {first, row.count, std::uint16_t(row.count + 4)};
    }
    body.spokes[row.first + row.count++] = spoke;
}

void remove_spoke(Body& body, Index vertex, Index neighbour) {
    SpokeRow& row = body.rows[vertex];
    *find_spoke(body, vertex, neighbour) = body.spokes[row.first + row.count - 1u];
    --row.count;
}

/// Once the gaps outweigh what is in use, rows move together.
void close_gaps(Body& body) {
    if (body.spokes.size() < 6 * body.edges.size()) return;
    std::vector<Spoke> packed;
    packed.reserve(body.spokes.capacity());
    for (SpokeRow& row : body.rows) {
        const Index first = Index(packed.size());
        packed.insert(packed.end(), body.spokes.begin() + row.first,
                      body.spokes.begin() + row.first + row.count);
        row = {first, row.count, row.count};
    }
    body.spokes.swap(packed);
}

Index add_edge(Body& body, Index u, Index v) {
    const Index e = Index(body.edges.size());
    body.edges.push_back({std::min(u, v), std::max(u, v)});
    body.edge_triangles.push_back({no_index, no_index});
    body.k.push_back(0), body.rest_length.push_back(0);
    add_spoke(body, u, {0, 0, v, e});
    add_spoke(body, v, {0, 0, u, e});
    return e;
}

/// The last edge takes its place.
void remove_edge(Body& body, Index e) {
    const Edge gone = body.edges[e];
    remove_spoke(body, gone.a, gone.b);
    remove_spoke(body, gone.b, gone.a);
    const Index last = Index(body.edges.size() - 1);
    if (e != last) {
        body.edges[e] = body.edges[last], body.edge_triangles[e] = body.edge_triangles[last];
        body.k[e] = body.k[last], body.rest_length[e] = body.rest_length[last];
        find_spoke(body, body.edges[e].a, body.edges[e].b)->edge = e;
        find_spoke(body, body.edges[e].b, body.edges[e].a)->edge = e;
        for (Index t : body.edge_triangles[e])
            if (t != no_index) std::ranges::replace(body.triangle_edges[t], last, e);
    }
    body.edges.pop_back(), body.edge_triangles.pop_back(), body.k.pop_back(), body.rest_length.pop_back();
}

/// Puts the changed triangles' edges and their springs in order.
void relink(Body& body, const SurfaceChange& change) {
    std::vector<Index> loose;
    for (const auto& [t, corners] : change.removed)
        for (Index e : body.triangle_edges[t]) {
            std::ranges::replace(body.edge_triangles[e], t, no_index);
            loose.push_back(e);
        }
    body.triangle_edges.resize(body.rest.triangles.size());
    for (const auto& [t, corners] : change.added)
        for (int k = 0; k < 3; ++k) {
            const Index u = corners[k], v = corners[(k + 1) % 3];
            const Spoke* spoke = find_spoke(body, u, v);
            const Index e = spoke ? spoke->edge : add_edge(body, u, v);
            auto& sides = body.edge_triangles[e];
            sides[sides[0] == no_index ? 0 : 1] = t;
            body.triangle_edges[t][k] = e;
        }
    // Highest first, so that the edge that takes a place is never one to be removed.
    make_set(loose);
    for (auto e = loose.rbegin(); e != loose.rend(); ++e)
        if (body.edge_triangles[*e] == std::array{no_index, no_index}) remove_edge(body, *e);
    for (const auto& [t, corners] : change.added)
        for (Index e : body.triangle_edges[t]) {
            auto& sides = body.edge_triangles[e];
            if (sides[0] > sides[1]) std::swap(sides[0], sides[1]);
            set_surface_spring(body, e);
            const auto [a, b] = body.edges[e];
            for (Spoke* s : {find_spoke(body, a, b), find_spoke(body, b, a)})
                s->k = body.k[e], s->rest = body.rest_length[e];
        }
}

/// Triangles at a vertex, in increasing order.
void triangles_of(const Body& body, Index i, std::vector<Index>& found) {
    found.clear();
    for (const Spoke& s : body.spokes_of(i))
        for (Index t : body.edge_triangles[s.edge]) found.push_back(t);
    make_set(found);
}

/// m_i and K_i by Eqs. 1-3, added up in the order of build_body(), so that the same surface gives the same
/// bits.
void estimate_vertex(Body& body, Index i, std::vector<Index>& triangles) {
    triangles_of(body, i, triangles);
    double m = 0, K = 0;
    for (Index t : triangles) {
        const Triangle& c = body.rest.triangles[t];
        const double V_t = virtual_tetrahedron(body.centre, body.rest.positions, body.L, c);
        m += share(body.L[c[0]] + body.L[c[1]] + body.L[c[2]], body.L[i]) * V_t / body.volume;
        K += V_t / (body.L[i] * body.L[i]);
    }
    if (body.scheme != Scheme::A) body.m[i] = body.material.mass * m;
    if (body.scheme == Scheme::C) body.K[i] = mean_modulus(body.material) * K;
    body.c[i] = damping(body.material, body.m[i], body.K[i]);
    if (!body.N.empty()) set_deviation(body, i);
}

/// The last vertex, `from`, takes the place of `to`.
void move_vertex(Body& body, Index from, Index to) {
    if (from != to) {
        for (const Spoke& s : body.spokes_of(from)) {
            Edge& edge = body.edges[s.edge];
            edge = {std::min(to, s.neighbour), std::max(to, s.neighbour)};
            find_spoke(body, s.neighbour, from)->neighbour = to;
            for (Index t : body.edge_triangles[s.edge])
                std::ranges::replace(body.rest.triangles[t], from, to);
        }
        body.rest.positions[to] = body.rest.positions[from];
        body.rows[to] = body.rows[from];
        body.L[to] = body.L[from], body.m[to] = body.m[from];
        body.K[to] = body.K[from], body.c[to] = body.c[from];
        if (!body.N.empty()) body.N[to] = body.N[from];
    }
    body.rest.positions.pop_back(), body.rows.pop_back();
    body.L.pop_back(), body.m.pop_back(), body.K.pop_back(), body.c.pop_back();
    if (!body.N.empty()) body.N.pop_back();
}

}  // namespace

BodyChange restructure(Body& body, Subdivision& history, const SurfaceChange& change, MeanStiffness mean) {
    BodyChange result;
    if (change.removed.empty()) return result;
    double stiffness = 0;
    for (const auto& [t, corners] : change.removed) stiffness -= stiffness_share(body, corners);

    for (const auto& [vertex, halves] : change.created) {
        body.rows.emplace_back();
        body.L.push_back(body.centre.kind == CentreKind::local
                             ? (body.L[halves.a] + body.L[halves.b]) / 2
                             : (body.rest.positions[vertex] - body.centre.position).norm());
        body.m.push_back(body.m[0]), body.K.push_back(body.K[0]), body.c.push_back(0);
        if (!body.N.empty()) body.N.emplace_back();
    }
    relink(body, change);
    for (const auto& [t, corners] : change.added) {
        stiffness += stiffness_share(body, corners);
        result.touched.insert(result.touched.end(), corners.begin(), corners.end());
    }
    make_set(result.touched);

    // Retired vertices, the highest first: then the last one is never among them but for itself.
    std::vector<Index> retired;
    for (const SurfaceChange::Middle& r : change.retired) retired.push_back(r.vertex);
    std::sort(retired.begin(), retired.end(), std::greater<>());
    std::vector<Index> neighbours;
    for (Index to : retired) {
        const Index from = Index(body.vertices() - 1);
        for (const Spoke& s : body.spokes_of(from)) neighbours.push_back(s.neighbour);
        move_vertex(body, from, to);
        history.take_out(to, from);
        for (auto* list : {&result.touched, &neighbours}) std::ranges::replace(*list, from, to);
        result.touched.push_back(to);
        result.moved.push_back({from, to});
    }
    result.touched.insert(result.touched.end(), neighbours.begin(), neighbours.end());
    make_set(result.touched);
    std::erase_if(result.touched, [&](Index i) { return i >= body.vertices(); });

    body.stiffness_sum += mean_modulus(body.material) * stiffness;
    result.everywhere =
        body.scheme == Scheme::A || (body.scheme == Scheme::B && mean == MeanStiffness::recomputed);
    std::vector<Index> scratch;
    if (body.scheme != Scheme::C) {
        const double N = double(body.vertices());
        if (mean == MeanStiffness::recomputed) std::ranges::fill(body.K, body.stiffness_sum / N);
        if (body.scheme == Scheme::A) std::ranges::fill(body.m, body.material.mass / N);
        if (result.everywhere)
            for (std::size_t i = 0; i < body.vertices(); ++i)
                body.c[i] = damping(body.material, body.m[i], body.K[i]);
        if (result.everywhere) set_deviations(body);
    }
    for (Index i : result.touched) {
        const auto first = body.spokes.begin() + body.rows[i].first;
        std::sort(first, first + body.rows[i].count,
                  [](const Spoke& p, const Spoke& q) { return p.neighbour < q.neighbour; });
        estimate_vertex(body, i, scratch);
        if (!(body.m[i] > 0 && body.K[i] > 0)) result.not_positive = i;
    }
    close_gaps(body);
    return result;
}

void reserve(Body& body, std::size_t vertices) {
    const std::size_t n = body.vertices() + vertices, e = body.edges.size() + 3 * vertices,
                      t = body.rest.triangles.size() + 2 * vertices;
    body.rest.positions.reserve(n), body.rows.reserve(n);
    for (auto* list : {&body.L, &body.m, &body.K, &body.c}) list->reserve(n);
    if (!body.N.empty()) body.N.reserve(n);
    body.rest.triangles.reserve(t), body.triangle_edges.reserve(t);
    body.edges.reserve(e), body.edge_triangles.reserve(e), body.k.reserve(e), body.rest_length.reserve(e);
    body.spokes.reserve(body.spokes.size() + 16 * vertices);
}

Body refined(const Body& body, std::span<const Index> triangles, int levels, MeanStiffness mean) {
    require_refinable(body.rest, triangles, levels);
    Body fine = body;
    Subdivision history(fine.rest);
    const BodyChange change = restructure(fine, history, history.split(fine.rest, triangles, levels), mean);
    if (change.not_positive != no_index) refuse_refinement(fine, fine.rest.positions[change.not_positive]);
    return fine;
}

void refuse_refinement(const Body& body, const Vector& place) {
    throw InputError(fmt::format(
        "{}: refined at ({:.4g}, {:.4g}, {:.4g}) m, a vertex would get a mass or stiffness that is "
        "not positive, as the surface there is turned towards the {} centre; use --centre local",
        body.rest.name, place.x(), place.y(), place.z(), to_string(body.centre.kind)));
}

}  // namespace innerspring
