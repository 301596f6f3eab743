#include "innerspring/sim/stability.h"

#include <algorithm>
#include <cmath>

namespace innerspring {

namespace {

/// (B w)_i, w = 1 where it is null. `share` is stiffest_share().
double row(const Body& body, double share, const double* w, std::size_t i) {
    const double w_i = w ? w[i] : 1.0;
    double sum = share * body.K[i] * w_i;
    for (const Spoke& spoke : body.spokes_of(i)) sum += spoke.k * (w_i + (w ? w[spoke.neighbour] : 1.0));
    return sum / body.m[i];
}

/// Iteration n at vertex i; the last one is the ratio.
void iterate(StabilityBound& bound, const Body& body, int n, std::size_t i) {
    const double* before = n > 0 ? bound.w[n - 1].data() : nullptr;
    if (n < StabilityBound::iterations)
        bound.w[n][i] = bound.scale * row(body, bound.stiffest, before, i);
    else
        bound.ratio[i] = row(body, bound.stiffest, before, i) / before[i];
}

void find_worst(StabilityBound& bound) {
    const auto worst = std::max_element(bound.ratio.begin(), bound.ratio.end());
    bound.worst = Index(worst - bound.ratio.begin());
    bound.value = *worst;
}

void add_neighbours(const Body& body, std::vector<Index>& vertices) {
    const std::size_t n = vertices.size();
    for (std::size_t k = 0; k < n; ++k)
        for (const Spoke& spoke : body.spokes_of(vertices[k])) vertices.push_back(spoke.neighbour);
    make_set(vertices);
}

}  // namespace

StabilityBound stability_bound(const Body& body) {
    StabilityBound bound;
    bound.stiffest = stiffest_share(body.material);
    // Keeps w near 1 without changing a bit of the ratios.
    double gershgorin = 0;
    for (std::size_t i = 0; i < body.vertices(); ++i)
        gershgorin = std::max(gershgorin, row(body, bound.stiffest, nullptr, i));
    bound.scale = std::isnormal(gershgorin) ? std::exp2(-std::ilogb(gershgorin)) : 1.0;
    for (auto& w : bound.w) w.resize(body.vertices());
    bound.ratio.resize(body.vertices());
    for (int n = 0; n <= StabilityBound::iterations; ++n)
        for (std::size_t i = 0; i < body.vertices(); ++i) iterate(bound, body, n, i);
    find_worst(bound);
    return bound;
}

void update(StabilityBound& bound, const Body& body, const SurfaceChange& surface, const BodyChange& change) {
    if (change.everywhere) {
        bound = stability_bound(body);
        return;
    }
    std::array<std::vector<double>*, StabilityBound::iterations + 1> lists{&bound.ratio};
    for (int n = 0; n < StabilityBound::iterations; ++n) lists[std::size_t(n) + 1] = &bound.w[std::size_t(n)];
    bool worst_moved = false;
    for (auto* list : lists) list->resize(list->size() + surface.created.size());
    for (const auto& [from, to] : change.moved) {
        worst_moved |= bound.worst == from || bound.worst == to;
        for (auto* list : lists) (*list)[to] = (*list)[from], list->pop_back();
    }
    std::vector<Index> changed = change.touched;
    for (int n = 0; n <= StabilityBound::iterations; ++n) {
        for (Index i : changed) iterate(bound, body, n, i);
        if (n < StabilityBound::iterations) add_neighbours(body, changed);
    }
    double value = 0;
    Index worst = 0;
    for (Index i : changed) {
        worst_moved |= i == bound.worst;
        if (bound.ratio[i] > value) value = bound.ratio[i], worst = i;
    }
    if (worst_moved)
        find_worst(bound);
    else if (value > bound.value)
        bound.value = value, bound.worst = worst;
}

double largest_stable_step(const StabilityBound& bound) {
    return 2 / std::sqrt(bound.value);
}

}  // namespace innerspring
