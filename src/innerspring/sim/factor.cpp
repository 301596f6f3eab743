#include "innerspring/sim/factor.h"

// Four doubles in one value are passed in memory or in a register as the machine has it: all of it is
// inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace innerspring {

namespace {

constexpr int lanes = 4;
template <class Real>
using Four [[gnu::vector_size(4 * sizeof(Real))]] = Real;

int padded(int n) {
    return (n + lanes - 1) / lanes * lanes;
}

template <class Real>
inline Four<Real> load(const Real* p) {
    Four<Real> v;
    std::memcpy(&v, p, sizeof v);
    return v;
}
template <class Real, class V>
inline void store(Real* p, const V& v) {
    std::memcpy(p, &v, sizeof v);
}
template <class Real>
inline Four<Real> all(Real x) {
    return Four<Real>{x, x, x, x};
}

/// Turns four points (x, y, z, 0) into (x x x x), (y y y y), (z z z z) and back.
template <class Four>
inline void transpose(Four& a, Four& b, Four& c, Four& d) {
    const Four ab = __builtin_shufflevector(a, b, 0, 4, 1, 5), cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
    const Four AB = __builtin_shufflevector(a, b, 2, 6, 3, 7), CD = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    a = __builtin_shufflevector(ab, cd, 0, 1, 4, 5), b = __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
    c = __builtin_shufflevector(AB, CD, 0, 1, 4, 5), d = __builtin_shufflevector(AB, CD, 2, 3, 6, 7);
}

/// to_a[i] = w[4 places[i] + a], zeros after the last.
template <class Real>
inline void gather(const Real* w, const std::vector<int>& places, Real* to, int ld) {
    const int n = int(places.size());
    const int* p = places.data();
    int i = 0;
    for (; i + 4 <= n; i += 4) {
        Four<Real> a = load(w + 4 * p[i]), b = load(w + 4 * p[i + 1]), c = load(w + 4 * p[i + 2]),
                   d = load(w + 4 * p[i + 3]);
        transpose(a, b, c, d);
        store(to + i, a), store(to + ld + i, b), store(to + 2 * ld + i, c);
    }
    if (i < n) {
        Four<Real> a = load(w + 4 * p[i]), b = i + 1 < n ? load(w + 4 * p[i + 1]) : Four<Real>{},
                   c = i + 2 < n ? load(w + 4 * p[i + 2]) : Four<Real>{}, d{};
        transpose(a, b, c, d);
        store(to + i, a), store(to + ld + i, b), store(to + 2 * ld + i, c);
    }
}

/// out_a = P y_a for the three coordinates; P is rows x columns with `rows` padded, y and out are [3][..].
template <class Real>
void multiply(const Real* P, int rows, int columns, const Real* y, int ld_y, Real* out, int ld_out) {
    int i = 0;
    for (; i + 8 <= rows; i += 8) {
        Four<Real> a0{}, a1{}, b0{}, b1{}, c0{}, c1{};
        const Real* p = P + i;
        for (int j = 0; j < columns; ++j, p += rows) {
            const Four<Real> v0 = load(p), v1 = load(p + 4);
            const Four<Real> ya = all(y[j]), yb = all(y[ld_y + j]), yc = all(y[2 * ld_y + j]);
            a0 += v0 * ya, a1 += v1 * ya;
            b0 += v0 * yb, b1 += v1 * yb;
            c0 += v0 * yc, c1 += v1 * yc;
        }
        store(out + i, a0), store(out + i + 4, a1);
        store(out + ld_out + i, b0), store(out + ld_out + i + 4, b1);
        store(out + 2 * ld_out + i, c0), store(out + 2 * ld_out + i + 4, c1);
    }
    if (i < rows) {
        Four<Real> a{}, b{}, c{};
        const Real* p = P + i;
        for (int j = 0; j < columns; ++j, p += rows) {
            const Four<Real> v = load(p);
            a += v * y[j], b += v * y[ld_y + j], c += v * y[2 * ld_y + j];
        }
        store(out + i, a), store(out + ld_out + i, b), store(out + 2 * ld_out + i, c);
    }
}

template <class Four>
inline auto sum(const Four& v) {
    return (v[0] + v[2]) + (v[1] + v[3]);
}

/// out_a -= P^T y_a.
template <class Real>
void subtract_transposed(const Real* P, int rows, int columns, const Real* y, int ld_y, Real* out,
                         int ld_out) {
    int j = 0;
    for (; j + 1 < columns; j += 2) {
        Four<Real> a{}, b{}, c{}, d{}, e{}, f{};
        const Real *p = P + j * rows, *q = p + rows;
        for (int i = 0; i < rows; i += 4) {
            const Four<Real> v = load(p + i), w = load(q + i);
            const Four<Real> y0 = load(y + i), y1 = load(y + ld_y + i), y2 = load(y + 2 * ld_y + i);
            a += v * y0, b += v * y1, c += v * y2;
            d += w * y0, e += w * y1, f += w * y2;
        }
        out[j] -= sum(a), out[ld_out + j] -= sum(b), out[2 * ld_out + j] -= sum(c);
        out[j + 1] -= sum(d), out[ld_out + j + 1] -= sum(e), out[2 * ld_out + j + 1] -= sum(f);
    }
    for (; j < columns; ++j) {
        Four<Real> a{}, b{}, c{};
        const Real* p = P + j * rows;
        for (int i = 0; i < rows; i += 4) {
            const Four<Real> v = load(p + i);
            a += v * load(y + i), b += v * load(y + ld_y + i), c += v * load(y + 2 * ld_y + i);
        }
        out[j] -= sum(a), out[ld_out + j] -= sum(b), out[2 * ld_out + j] -= sum(c);
    }
}

}  // namespace

Factor::Factor(const Body& body) : tree_(dissect(body)) {}

std::size_t Factor::entries() const {
    std::size_t n = 0;
    for (const Panel& p : panels_) n += std::size_t(p.s) * std::size_t(p.padded_r + p.padded_s);
    return n;
}

void Factor::make_room() {
    panels_.resize(tree_.nodes.size());
    local_.resize(tree_.node_of.size());
}

bool Factor::float_is_enough(const Body& body, std::span<const double> d, double& largest) const {
    double least = d[0];
    largest = 0;
    for (std::size_t i = 0; i < d.size(); ++i) {
        double diagonal = d[i];
        for (const Spoke& spoke : body.spokes_of(i)) diagonal += spoke.k;
        largest = std::max(largest, diagonal);
        least = std::min(least, d[i]);
    }
    return largest < 1e4 * least;
}

void Factor::factorize(const Body& body, std::span<const double> d, const std::vector<bool>& pinned) {
    make_room();
    double largest = 0;
    in_float_ = float_is_enough(body, d, largest);
    // A power of two: it changes no digit, and keeps floats in their range.
    scale_ = std::isnormal(largest) ? std::exp2(-std::ilogb(largest)) : 1.0;
    widest_ = 0;
    nodes_made_ = int(tree_.nodes.size());
    for (int n = 0; n < nodes_made_; ++n) make(body, d, pinned, n);
}

std::optional<std::vector<int>> Factor::adapt_tree(const Body& body, const SurfaceChange& surface,
                                                   const BodyChange& change) {
    auto nodes = update(tree_, body, surface, change);
    if (!nodes) tree_ = dissect(body);
    return nodes;
}

void Factor::adapt(const Body& body, std::span<const double> d, const std::vector<bool>& pinned,
                   const SurfaceChange& surface, const BodyChange& change) {
    const auto nodes = adapt_tree(body, surface, change);
    double largest = 0;
    if (!nodes || change.everywhere || float_is_enough(body, d, largest) != in_float_)
        return factorize(body, d, pinned);
    make_room();
    nodes_made_ = int(nodes->size());
    for (int n : *nodes) make(body, d, pinned, n);
}

template <class Real>
void Factor::keep(Panel& panel, const Eigen::MatrixXd& inverse, const Eigen::MatrixXd& below,
                  Kept<Real>& kept) {
    using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
    using Padded = Eigen::Map<Matrix, 0, Eigen::OuterStride<>>;
    kept.inverse.assign(std::size_t(panel.padded_s * panel.s), Real(0));
    kept.below.assign(std::size_t(panel.padded_r * panel.s), Real(0));
    Padded(kept.inverse.data(), panel.s, panel.s, Eigen::OuterStride<>(panel.padded_s)) =
        inverse.template cast<Real>();
    if (panel.r > 0)
        Padded(kept.below.data(), panel.r, panel.s, Eigen::OuterStride<>(panel.padded_r)) =
            below.template cast<Real>();
}

void Factor::make(const Body& body, std::span<const double> d, const std::vector<bool>& pinned, int n) {
    const Dissection::Node& node = tree_.nodes[std::size_t(n)];
    Panel& panel = panels_[std::size_t(n)];
    const int s = panel.s = int(node.columns.size()), r = panel.r = int(node.rows.size());
    panel.padded_s = padded(s), panel.padded_r = padded(r);
    widest_ = std::max({widest_, std::size_t(panel.padded_s), std::size_t(panel.padded_r)});
    Eigen::MatrixXd& L = panel.L;
    L.setZero(s + r, s);
    if (s == 0) return;
    for (int i = 0; i < s; ++i) local_[std::size_t(node.columns[std::size_t(i)])] = i;
    for (int i = 0; i < r; ++i) local_[std::size_t(node.rows[std::size_t(i)])] = s + i;
    for (int j = 0; j < s; ++j) {
        const Index v = tree_.vertex_of[std::size_t(node.columns[std::size_t(j)])];
        double diagonal = d[v];
        for (const Spoke& spoke : body.spokes_of(v)) {
            diagonal += spoke.k;
            const int place = tree_.place_of[spoke.neighbour];
            if (tree_.node_of[std::size_t(place)] >= n && !pinned[v] && !pinned[spoke.neighbour])
                L(local_[std::size_t(place)], j) = -spoke.k * scale_;
        }
        L(j, j) = pinned[v] ? 1.0 : diagonal * scale_;
    }
    for (const Dissection::Updater& from : node.updaters) {
        const Dissection::Node& other = tree_.nodes[std::size_t(from.node)];
        const Dissection::Segment& segment = other.segments[std::size_t(from.segment)];
        const Panel& theirs = panels_[std::size_t(from.node)];
        const int rows = theirs.r - segment.first, columns = segment.last - segment.first;
        product_.resize(rows, columns);
        product_.noalias() = theirs.L.block(theirs.s + segment.first, 0, rows, theirs.s) *
                             theirs.L.block(theirs.s + segment.first, 0, columns, theirs.s).transpose();
        const int* places = other.rows.data() + segment.first;
        for (int j = 0; j < columns; ++j) {
            double* target = L.col(local_[std::size_t(places[j])]).data();
            for (int i = j; i < rows; ++i) target[local_[std::size_t(places[i])]] -= product_(i, j);
        }
    }
    Eigen::Ref<Eigen::MatrixXd> top = L.topRows(s);
    Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> in_place(top);
    const auto triangle = L.topRows(s).triangularView<Eigen::Lower>();
    auto low = L.bottomRows(r);
    if (r > 0) triangle.transpose().solveInPlace<Eigen::OnTheRight>(low);

    Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(s, s);
    triangle.solveInPlace(inverse);
    const Eigen::MatrixXd full = inverse.transpose() * inverse, below = low * inverse;
    if (in_float_)
        keep(panel, full, below, panel.f), panel.d = {};
    else
        keep(panel, full, below, panel.d), panel.f = {};
}

template <class Real>
void Factor::solve(Real* w) const {
    auto kept = [](const Panel& panel) -> const Kept<Real>& {
        if constexpr (std::is_same_v<Real, float>)
            return panel.f;
        else
            return panel.d;
    };
    // Scratch for one node, x, y and z apart.
    constexpr std::size_t most = 256;
    Real small[9 * most];
    std::vector<Real> large(widest_ > most ? 9 * widest_ : 0);
    Real *y = large.empty() ? small : large.data(), *z = y + 3 * std::max(most, widest_),
         *t = z + 3 * std::max(most, widest_);
    // With A = (I + B) D (I + B)^T, B = L_RJ L_JJ^-1 below the nodes' dense D = L_JJ L_JJ^T:
    for (std::size_t n = 0; n < panels_.size(); ++n) {  // (I + B)^-1, children first
        const Panel& panel = panels_[n];
        if (panel.r == 0 || panel.s == 0) continue;
        const Dissection::Node& node = tree_.nodes[n];
        gather(w, node.columns, y, panel.padded_s);
        multiply(kept(panel).below.data(), panel.padded_r, panel.s, y, panel.padded_s, z, panel.padded_r);
        const int* p = node.rows.data();
        for (int i = 0; i < panel.r; i += 4) {
            Four<Real> a = load(z + i), b = load(z + panel.padded_r + i),
                       c = load(z + 2 * panel.padded_r + i), d{};
            transpose(a, b, c, d);
            const int left = panel.r - i;
            auto subtract = [&](int k, const Four<Real>& v) {
                if (k >= left) return;
                Real* to = w + 4 * std::ptrdiff_t(p[i + k]);
                store(to, load(to) - v);
            };
            subtract(0, a), subtract(1, b), subtract(2, c), subtract(3, d);
        }
    }
    for (std::size_t n = panels_.size(); n-- > 0;) {  // D^-1, then (I + B)^-T, parents first
        const Panel& panel = panels_[n];
        if (panel.s == 0) continue;
        const Dissection::Node& node = tree_.nodes[n];
        gather(w, node.columns, y, panel.padded_s);
        multiply(kept(panel).inverse.data(), panel.padded_s, panel.s, y, panel.padded_s, z, panel.padded_s);
        if (panel.r > 0) {
            gather(w, node.rows, t, panel.padded_r);
            subtract_transposed(kept(panel).below.data(), panel.padded_r, panel.s, t, panel.padded_r, z,
                                panel.padded_s);
        }
        for (int i = 0; i < panel.s; ++i) {
            Real* to = w + 4 * std::ptrdiff_t(node.columns[std::size_t(i)]);
            to[0] = z[i], to[1] = z[panel.padded_s + i], to[2] = z[2 * panel.padded_s + i];
        }
    }
}

template void Factor::solve<float>(float*) const;
template void Factor::solve<double>(double*) const;

void Factor::solve(const Vector* b, Vector* x) const {
    double largest = 0;
    for (std::size_t i = 0; i < tree_.place_of.size(); ++i)
        largest = std::max(largest, b[i].cwiseAbs().maxCoeff());
    if (!(largest > 0)) largest = 1;
    auto run = [&]<class Real>(std::vector<Real> w) {
        for (std::size_t i = 0; i < tree_.place_of.size(); ++i)
            for (std::size_t a = 0; a < 3; ++a)
                w[4 * std::size_t(tree_.place_of[i]) + a] = Real(b[i][int(a)] / largest);
        solve(w.data());
        for (std::size_t i = 0; i < tree_.place_of.size(); ++i)
            for (std::size_t a = 0; a < 3; ++a)
                x[i][int(a)] = largest * scale_ * double(w[4 * std::size_t(tree_.place_of[i]) + a]);
    };
    if (in_float_)
        run(std::vector<float>(4 * tree_.node_of.size()));
    else
        run(std::vector<double>(4 * tree_.node_of.size()));
}

}  // namespace innerspring
