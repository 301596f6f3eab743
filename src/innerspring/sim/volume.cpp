#include "innerspring/sim/volume.h"

#include <algorithm>

namespace innerspring {

Index next_in_fan(const Body& body, Index i, Index edge) {
    const Index j = other_end(body.edges[edge], i);
    for (Index t : body.edge_triangles[edge]) {
        const Triangle& triangle = body.rest.triangles[t];
        for (int corner = 0; corner < 3; ++corner)
            if (triangle[corner] == i && triangle[(corner + 1) % 3] == j) return triangle[(corner + 2) % 3];
    }
    return j;
}

VolumeTerm::VolumeTerm(const Body& body) : body_(body) {
    adapt({});
}

void VolumeTerm::adapt(const BodyChange& change) {
    poisson_ = body_.material.poisson;
    compliance_ = active() && !hard() ? body_.volume / bulk_modulus(body_.material) : 0;
    if (change.everywhere) fan_.clear();
    if (fan_.empty()) return;
    fan_.resize(body_.spokes.size());
    for (Index i : change.touched) walk_around(i);
}

void VolumeTerm::walk_around(Index i) const {
    const std::span<const Spoke> spokes = body_.spokes_of(i);
    const Spoke* spoke = &spokes.front();
    for (std::size_t n = 0; n < spokes.size(); ++n) {
        fan_[body_.rows[i].first + n] = spoke->neighbour;
        const Index next = next_in_fan(body_, i, spoke->edge);
        spoke = std::find_if(spokes.data(), &spokes.back(),
                             [next](const Spoke& s) { return s.neighbour == next; });
    }
}

void VolumeTerm::prepare() const {
    if (!fan_.empty()) return;
    fan_.resize(body_.spokes.size());
    for (Index i = 0; i < body_.vertices(); ++i) walk_around(i);
}

double VolumeTerm::find(const Field& x, Field& a, std::size_t first, std::size_t last) const {
    const Vector origin = x[0];
    double sum = 0;
    for (std::size_t i = first; i < last; ++i) {
        // The ring of neighbours by quadrangles, two ways across each:
        //     6 a_i = sum over odd n of (x_{n+1} - x_0) x (x_{n+2} - x_n),   x_0 after the last.
        const Index* const fan = fan_.data() + body_.rows[i].first;
        const std::size_t count = body_.rows[i].count;
        const Vector x_0 = x[fan[0]];
        Vector area = Vector::Zero(), odd = x[fan[1]];
        std::size_t n = 2;
        for (; n + 1 < count; n += 2) {
            const Vector next = x[fan[n + 1]];
            area += (x[fan[n]] - x_0).cross(next - odd);
            odd = next;
        }
        if (n < count) area += (x[fan[n]] - x_0).cross(x_0 - odd);
        a[i] = 1.0 / 6 * area;
        sum += (x[i] - origin).dot(area);
    }
    return sum;
}

double VolumeTerm::find(const Field& x, Field& a, Team& team) const {
    const std::size_t n = body_.vertices();
    prepare();
    a.resize(n);
    blocks_.resize(block_count(n));
    team.run(blocks_.size(), [&](std::size_t block) {
        blocks_[block] = find(x, a, block * block_size, std::min(n, (block + 1) * block_size));
    });
    double sum = 0;
    for (double part : blocks_) sum += part;
    return sum / 18 - body_.volume;  // sum_i x_i . a_i = 3 V
}

void VolumeTerm::add_curvature(double P, const Field& x, const Field& p, const std::vector<bool>& fixed,
                               Field& out, Team& team) const {
    const std::size_t n = body_.vertices();
    team.run(block_count(n), [&](std::size_t block) {
        for (std::size_t i = block * block_size; i < std::min(n, (block + 1) * block_size); ++i) {
            if (fixed[i]) continue;
            const Index *fan = fan_.data() + body_.rows[i].first, *const end = fan + body_.rows[i].count;
            const Vector x_i = x[i], p_i = p[i];
            Vector sum = Vector::Zero(), d = x[end[-1]] - x_i, w = p[end[-1]] - p_i;
            for (; fan != end; ++fan) {
                const Vector d_next = x[*fan] - x_i, w_next = p[*fan] - p_i;
                sum += d.cross(w_next) + w.cross(d_next);
                d = d_next, w = w_next;
            }
            out[i] -= P / 6 * sum;
        }
    });
}

double pressure(const Body& body, const Loads& loads, const State& state,
                std::span<const VertexContact> touched) {
    const double nu = body.material.poisson;
    if (nu == 0) return 0;
    if (nu < 0.5)
        return -bulk_modulus(body.material) * (volume(state.x, body.rest.triangles) / body.volume - 1);
    std::vector<Vector> a(body.vertices(), Vector::Zero()), f = a;
    for (const Triangle& t : body.rest.triangles) {
        const Vector &x = state.x[t[0]], &y = state.x[t[1]], &z = state.x[t[2]];
        const Vector share = (y - x).cross(z - x) / 6;  // around each vertex the rest adds up to nothing
        for (Index i : t) a[i] += share;
    }
    Team alone(1);
    add_inner_forces(body, home_frame(body, state.x, alone), state.x, f);
    add_surface_forces(body, state.x, f);
    add_gravity(body, loads.gravity, f);
    add_loads(loads, state.time, f);
    for (const Pin& pin : loads.pins)
        for (Index i : pin.vertices) a[i].setZero();
    for (const VertexContact& c : touched) a[c.vertex].setZero();
    double fa = 0, aa = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        fa += f[i].dot(a[i]) / body.K[i], aa += a[i].squaredNorm() / body.K[i];
    return aa > 0 ? -fa / aa : 0;
}

void VolumePart::clear(const std::vector<bool>& fixed, Field& a) {
    for (std::size_t i = 0; i < a.size(); ++i)
        if (fixed[i]) a[i].setZero();
}

double VolumePart::add_gradient(const Field& x, const std::vector<bool>& fixed, Field& g, Team& team) {
    excess = term.find(x, now_, team);
    const double P = pressure();
    for (std::size_t i = 0; i < g.size(); ++i)
        if (!fixed[i]) g[i] -= P * now_[i];
    return -lambda * excess + stiffness * excess * excess / 2;
}

double VolumePart::add_product(const Field& p, const std::vector<bool>& fixed, Field& q, Team& team) {
    double ap = 0, before = 0, after = 0;
    for (std::size_t i = 0; i < p.size(); ++i) ap += a[i].dot(p[i]), before += p[i].dot(q[i]);
    add(stiffness * ap, a, q);
    term.add_curvature(pressure_, x_, p, fixed, q, team);
    for (std::size_t i = 0; i < p.size(); ++i) after += p[i].dot(q[i]);
    return after - before;
}

double VolumePart::correct(const Field& r, Field& z) const {
    double yr = 0;
    for (std::size_t i = 0; i < r.size(); ++i) yr += response[i].dot(r[i]);
    const double share = -stiffness * yr / (1 + stiffness * give);
    for (std::size_t i = 0; i < z.size(); ++i) z[i] += share * response[i];
    return share * yr;
}

}  // namespace innerspring
