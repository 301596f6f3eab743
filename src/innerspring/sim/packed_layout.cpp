#include <algorithm>
#include <cmath>

#include "innerspring/body/anisotropy.h"
#include "innerspring/sim/packed.h"
#include "innerspring/sim/volume.h"

// How a body is laid out for the vector kernels, and how the layout follows its changes.
namespace innerspring {

namespace {

/// Vertices sorted by their number of spokes among themselves: slices then have few empty slots, and
/// neighbours are still near.
constexpr std::size_t sorting_window = 256;

/// A walk over the surface, ring by ring, from the vertex farthest along the longest axis: a vertex's
/// neighbours are at most two rings away.
std::vector<Index> walk(const Body& body) {
    const auto& q = body.rest.positions;
    const std::size_t n = body.vertices();
    Vector low = q[0], high = q[0];
    for (const Vector& p : q) low = low.cwiseMin(p), high = high.cwiseMax(p);
    Eigen::Index axis;
    (high - low).maxCoeff(&axis);
    const auto start = std::min_element(
        q.begin(), q.end(), [axis](const Vector& a, const Vector& b) { return a[axis] < b[axis]; });
    std::vector<Index> order;
    order.reserve(n);
    std::vector<bool> seen(n, false);
    auto visit = [&](Index i) {
        if (!seen[i]) order.push_back(i), seen[i] = true;
    };
    visit(Index(start - q.begin()));
    for (std::size_t next = 0, unseen = 0; order.size() < n || next < n;) {
        if (next == order.size()) {  // another closed part
            while (seen[unseen]) ++unseen;
            visit(Index(unseen));
        }
        for (const Spoke& spoke : body.spokes_of(order[next++])) visit(spoke.neighbour);
    }
    for (std::size_t first = 0; first < n; first += sorting_window)
        std::stable_sort(order.begin() + std::ptrdiff_t(first),
                         order.begin() + std::ptrdiff_t(std::min(n, first + sorting_window)),
                         [&](Index a, Index b) { return body.rows[a].count > body.rows[b].count; });
    return order;
}

void set_matrix(PackedStiffness& to, std::size_t lane, const Symmetric& K, double inverse_m) {
    to.xx[lane] = float(K.xx * inverse_m), to.xy[lane] = float(K.xy * inverse_m);
    to.xz[lane] = float(K.xz * inverse_m), to.yy[lane] = float(K.yy * inverse_m);
    to.yz[lane] = float(K.yz * inverse_m), to.zz[lane] = float(K.zz * inverse_m);
}

/// Writes all that does not move of the vertex at a place. The slice must have slots enough.
void fill(Packed& p, const Body& body, std::size_t place) {
    const std::size_t slice = place / slice_width, lane = place % slice_width;
    PackedCoefficients& c = p.coefficients[slice];
    PackedSlot* const slots = p.slots.data() + p.ranges[slice].first;
    const std::size_t count = p.ranges[slice].count;
    const Index i = p.vertex_at[place];
    if (i == no_index) {  // held by an enormous drag
        for (auto& rows : p.rows) rows[place] = {};
        c.inverse_m[lane] = c.K_m[lane] = 0, c.c_m[lane] = 1e30f;
        if (!p.stiffness_matrix.empty()) set_matrix(p.stiffness_matrix[slice], lane, {}, 0);
        for (std::size_t n = 0; n < count; ++n) slots[n].offset[lane] = 0, slots[n].k[lane] = 0;
        return;
    }
    const Vector q = p.scale * (body.rest.positions[i] - p.origin);
    for (auto& rows : p.rows)
        for (int axis = 0; axis < 3; ++axis) rows[place].q[axis] = float(q[axis]);
    c.inverse_m[lane] = float(p.stiffness / body.m[i]);
    c.K_m[lane] = float(body.K[i] / body.m[i]);
    c.c_m[lane] = float(body.c[i] / body.m[i]);
    if (!p.stiffness_matrix.empty()) {
        const auto& [xx, xy, xz, yy, yz, zz] = body.N[i];
        const double K = body.K[i];
        set_matrix(p.stiffness_matrix[slice], lane, {K + xx, xy, xz, K + yy, yz, K + zz}, 1 / body.m[i]);
    }
    const std::span<const Spoke> spokes = body.spokes_of(i);
    const Spoke* spoke = &spokes.front();
    for (std::size_t n = 0; n < count; ++n) {
        slots[n].offset[lane] = std::uint32_t(p.place_of[spoke->neighbour] * sizeof(PackedRow));
        slots[n].k[lane] = n < spokes.size() ? float(spoke->k / p.stiffness) : 0;
        if (n + 1 < spokes.size()) {
            const Index next = next_in_fan(body, i, spoke->edge);
            spoke = std::find_if(spokes.data(), spokes.data() + spokes.size(),
                                 [next](const Spoke& s) { return s.neighbour == next; });
        } else {
            spoke = &spokes.front();
        }
    }
}

std::size_t most_spokes(const Packed& p, const Body& body, std::size_t slice) {
    std::size_t most = 0;
    for (std::size_t place = slice * slice_width; place < (slice + 1) * slice_width; ++place)
        if (p.vertex_at[place] != no_index)
            most = std::max<std::size_t>(most, body.rows[p.vertex_at[place]].count);
    return most;
}

void append_slice(Packed& p) {
    for (auto& rows : p.rows) rows.resize(rows.size() + slice_width);
    p.v.emplace_back();
    p.coefficients.emplace_back();
    if (!p.stiffness_matrix.empty()) p.stiffness_matrix.emplace_back();
    p.ranges.push_back({0, 0});
    p.vertex_at.resize(p.vertex_at.size() + slice_width, no_index);
}

/// Slots at the end, for so many spokes.
void give_slots(Packed& p, std::size_t slice, std::size_t count) {
    p.ranges[slice] = {std::uint32_t(p.slots.size()), std::uint32_t(count)};
    p.slots.resize(p.slots.size() + count);
}

}  // namespace

bool packable(const Body& body) {
    if (body.free || body.vertices() > (std::size_t(1) << 26)) return false;
    // So few vertices do not average the rounding of positions out to 1e-8 of the volume.
    if (body.material.poisson == 0.5 && body.vertices() < 4000) return false;
    const double k = *std::max_element(body.k.begin(), body.k.end());
    const auto fits = [](double number) { return number < 1e30; };
    const double share = stiffest_share(body.material);
    for (std::size_t i = 0; i < body.vertices(); ++i)
        if (!fits(k / body.m[i]) || !fits(share * body.K[i] / body.m[i]) || !fits(body.c[i] / body.m[i]))
            return false;
    return std::isnormal(body.radius) && (k == 0 || std::isnormal(k)) && body.radius > 1e-100 &&
           body.radius < 1e100;
}

Packed pack(const Body& body) {
    const auto& q = body.rest.positions;
    Packed p;
    p.scale = std::exp2(-std::ilogb(body.radius));
    const double k = *std::max_element(body.k.begin(), body.k.end());
    p.stiffness = k > 0 ? std::exp2(std::ilogb(k)) : 1;
    Vector low = q[0], high = q[0];
    for (const Vector& x : q) low = low.cwiseMin(x), high = high.cwiseMax(x);
    p.origin = (low + high) / 2;
    const std::size_t slices = (body.vertices() + slice_width - 1) / slice_width;
    for (auto& rows : p.rows) rows.resize(slices * slice_width);
    p.v.resize(slices), p.coefficients.resize(slices), p.ranges.resize(slices);
    if (!body.N.empty()) p.stiffness_matrix.resize(slices);
    p.vertex_at = walk(body);
    p.vertex_at.resize(slices * slice_width, no_index);
    p.place_of.resize(body.vertices());
    for (std::size_t place = 0; place < body.vertices(); ++place)
        p.place_of[p.vertex_at[place]] = Index(place);
    std::size_t slots = 0;
    for (std::size_t slice = 0; slice < slices; ++slice) slots += most_spokes(p, body, slice);
    p.slots.reserve(slots);
    for (std::size_t slice = 0; slice < slices; ++slice) give_slots(p, slice, most_spokes(p, body, slice));
    for (std::size_t place = 0; place < p.vertex_at.size(); ++place) fill(p, body, place);
    prepare_volume(p, body);
    return p;
}

void adapt(Packed& p, const Body& body, const SurfaceChange& surface, const BodyChange& change) {
    std::size_t used = 0;
    for (const SlotRange& range : p.ranges) used += range.count;
    if (change.everywhere || p.slots.size() > 2 * used) {  // half of the slots are left behind
        p = pack(body);
        return;
    }
    std::vector<Index> slices;  // with a vertex that is other than before
    for (std::size_t n = 0; n < surface.created.size(); ++n) {
        if (p.vacant.empty()) {
            append_slice(p);
            for (std::size_t place = p.vertex_at.size(); place-- > p.vertex_at.size() - slice_width;)
                p.vacant.push_back(Index(place));
        }
        const Index place = p.vacant.back();
        p.vacant.pop_back();
        p.vertex_at[place] = Index(p.place_of.size());
        p.place_of.push_back(place);
        slices.push_back(place / slice_width);
    }
    for (const auto& [from, to] : change.moved) {
        const Index left = p.place_of[to];
        p.vertex_at[left] = no_index;
        p.vacant.push_back(left);
        slices.push_back(left / slice_width);
        if (from != to) {
            p.place_of[to] = p.place_of[from];
            p.vertex_at[p.place_of[to]] = to;
        }
        p.place_of.pop_back();
    }
    for (Index i : change.touched) slices.push_back(p.place_of[i] / slice_width);
    make_set(slices);
    for (Index slice : slices) {
        const std::size_t most = most_spokes(p, body, slice);
        if (most > p.ranges[slice].count) give_slots(p, slice, most);
        for (std::size_t lane = 0; lane < slice_width; ++lane) fill(p, body, slice * slice_width + lane);
    }
    prepare_volume(p, body);
}

}  // namespace innerspring
