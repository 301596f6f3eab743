#include "innerspring/sim/refine.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "innerspring/sim/kernel.h"

namespace innerspring {

namespace {

/// Part of a body: what a change looks at.
struct Part {
    std::vector<Index> vertices, edges;
};

/// The corners and sides of triangles as body.rest and body.triangle_edges have them, or the whole body.
Part part_of(const Body& body, std::span<const SurfaceChange::Slot> slots, bool corners_as_recorded,
             bool everything) {
    Part part;
    if (everything) {
        part.vertices.resize(body.m.size());
        part.edges.resize(body.edges.size());
        for (std::size_t i = 0; i < part.vertices.size(); ++i) part.vertices[i] = Index(i);
        for (std::size_t e = 0; e < part.edges.size(); ++e) part.edges[e] = Index(e);
        return part;
    }
    for (const auto& [t, corners] : slots) {
        const Triangle& c = corners_as_recorded ? corners : body.rest.triangles[t];
        part.vertices.insert(part.vertices.end(), c.begin(), c.end());
        part.edges.insert(part.edges.end(), body.triangle_edges[t].begin(), body.triangle_edges[t].end());
    }
    make_set(part.vertices);
    make_set(part.edges);
    return part;
}

struct Tally {
    Moments moments;  ///< weighted by mass, about `about`
    double kinetic = 0, elastic = 0;
};

Tally tally(const Body& body, const State& state, const HomeFrame& frame, const Part& part,
            const Vector& about) {
    Tally sum;
    for (Index i : part.vertices) {
        sum.moments.add(body.m[i], state.x[i] - about, state.v[i]);
        sum.kinetic += body.m[i] * state.v[i].squaredNorm() / 2;
        const Vector u = state.x[i] - (frame.R * body.rest.positions[i] + frame.t);
        sum.elastic -= u.dot(inner_force(body, frame, i, u)) / 2;
    }
    for (Index e : part.edges) {
        const double stretch =
            (state.x[body.edges[e].a] - state.x[body.edges[e].b]).norm() - body.rest_length[e];
        sum.elastic += body.k[e] * stretch * stretch / 2;
    }
    return sum;
}

/// Sum of the signed tetrahedra of triangles about a point [m^3].
double volume_about(const Vector& about, Positions x, std::span<const SurfaceChange::Slot> slots) {
    double sum = 0;
    for (const auto& [t, c] : slots)
        sum += (x[c[0]] - about).dot((x[c[1]] - about).cross(x[c[2]] - about)) / 6;
    return sum;
}

/// Everything after the surface has been changed and before anything else has.
Transfer transfer(Body& body, Subdivision& history, State& state, SurfaceChange surface, MeanStiffness mean) {
    Transfer result{std::move(surface), {}, 0, 0, 0};
    if (result.surface.removed.empty()) return result;
    const bool everything =
        body.scheme == Scheme::A || (body.scheme == Scheme::B && mean == MeanStiffness::recomputed);
    Team alone(1);
    const HomeFrame frame = home_frame(body, state.x, alone);
    const Vector about = state.x[result.surface.removed.front().corners[0]];
    const Tally before =
        tally(body, state, frame, part_of(body, result.surface.removed, true, everything), about);
    const double volume_before = volume_about(about, state.x, result.surface.removed);
    for (const auto& [vertex, halves] : result.surface.created) {
        state.x.push_back(0.5 * (state.x[halves.a] + state.x[halves.b]));
        state.v.push_back(0.5 * (state.v[halves.a] + state.v[halves.b]));
    }
    result.volume_change_m3 = volume_about(about, state.x, result.surface.added) - volume_before;

    result.body = restructure(body, history, result.surface, mean);
    for (const auto& [from, to] : result.body.moved) {
        state.x[to] = state.x[from], state.v[to] = state.v[from];
        state.x.pop_back(), state.v.pop_back();
    }
    const Part part = part_of(body, result.surface.added, false, everything);
    const Tally after = tally(body, state, frame, part, about);
    // The rigid motion that brings what the new masses miss of the momenta.
    Moments missing = after.moments;
    missing.v = before.moments.v - after.moments.v;
    missing.xv = before.moments.xv - after.moments.xv;
    const RigidMotion motion = rigid_motion(missing);
    double kinetic = 0;
    for (Index i : part.vertices) {
        state.v[i] += motion.linear + motion.angular.cross(state.x[i] - about - motion.centre);
        kinetic += body.m[i] * state.v[i].squaredNorm() / 2;
    }
    result.kinetic_change_j = kinetic - before.kinetic;
    result.elastic_change_j = after.elastic - before.elastic;
    return result;
}

}  // namespace

Transfer refine(Body& body, Subdivision& history, State& state, std::span<const Index> triangles, int levels,
                MeanStiffness mean) {
    require_refinable(body.rest, triangles, levels);
    Transfer result = transfer(body, history, state, history.split(body.rest, triangles, levels), mean);
    if (const Index bad = result.body.not_positive; bad != no_index) {
        const Vector place = body.rest.positions[bad];
        transfer(body, history, state, history.undo_split(body.rest), mean);
        refuse_refinement(body, place);
    }
    return result;
}

Transfer coarsen(Body& body, Subdivision& history, State& state, const Subdivision::Keep& keep,
                 MeanStiffness mean) {
    return transfer(body, history, state, history.unsplit(body.rest, keep), mean);
}

void carry_over(Loads& loads, const Body& body, const Transfer& transfer) {
    // Where each vertex with a changed index is now.
    auto renumber = [&](Index i) {
        for (const auto& [from, to] : transfer.body.moved)
            if (i == from) i = to;
        return i;
    };
    for (Force& force : loads.forces) {
        if (force.radius > 0) {
            Force anew = patch_force(body, renumber(force.centre), force.radius, force.newton);
            force.vertices = std::move(anew.vertices), force.weights = std::move(anew.weights);
            force.centre = anew.centre;
            continue;
        }
        auto add = [&](Index vertex, double weight) {
            const auto at = std::ranges::find(force.vertices, vertex);
            if (at != force.vertices.end()) {
                force.weights[std::size_t(at - force.vertices.begin())] += weight;
            } else {
                force.vertices.push_back(vertex);
                force.weights.push_back(weight);
            }
        };
        for (const auto& [vertex, halves] : transfer.surface.retired) {
            const auto at = std::ranges::find(force.vertices, vertex);
            if (at == force.vertices.end()) continue;
            const auto n = at - force.vertices.begin();
            const double half = force.weights[std::size_t(n)] / 2;
            force.vertices.erase(at);
            force.weights.erase(force.weights.begin() + n);
            add(halves.a, half);
            add(halves.b, half);
        }
        for (Index& i : force.vertices) i = renumber(i);
        if (force.centre != no_index)
            force.centre = force.vertices.empty() ? no_index : renumber(force.centre);
    }
    for (Pin& pin : loads.pins) {
        std::unordered_set<Index> pinned(pin.vertices.begin(), pin.vertices.end());
        for (const auto& [vertex, halves] : transfer.surface.created)
            if (pinned.contains(halves.a) && pinned.contains(halves.b) && pinned.insert(vertex).second)
                pin.vertices.push_back(vertex);
        for (const auto& [vertex, halves] : transfer.surface.retired) pinned.erase(vertex);
        std::erase_if(pin.vertices, [&](Index i) { return !pinned.contains(i); });
        for (Index& i : pin.vertices) i = renumber(i);
    }
}

std::vector<Index> coarse_triangles(const Body& body, Index vertex, double radius, double longest) {
    const auto coarse = [&](Index t) {
        return std::ranges::any_of(body.triangle_edges[t],
                                   [&](Index e) { return body.rest_length[e] > longest; });
    };
    std::vector<Index> found;
    for (Index i : vertices_around(body, vertex, radius))
        for (const Spoke& spoke : body.spokes_of(i))
            for (Index t : body.edge_triangles[spoke.edge])
                if (coarse(t)) found.push_back(t);
    make_set(found);
    return found;
}

}  // namespace innerspring
