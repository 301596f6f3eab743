#include "innerspring/sim/factor.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <type_traits>

#include "innerspring/sim/panel_simd.h"

namespace innerspring {

namespace {

/// Room for the panels from `down` and `up` on, and in it those of before that are still good.
template <class Real, class Panel>
void lay_out(LargeArray<Real>& kept, std::size_t size, const std::vector<Panel>& before,
             const std::vector<Panel>& panels, const std::vector<bool>& stays) {
    LargeArray<Real> old(size, Real(0));
    old.swap(kept);
    for (std::size_t n = 0; n < before.size(); ++n) {
        if (!stays[n]) continue;
        const Panel &from = before[n], &to = panels[n];
        std::copy_n(old.data() + from.down, to.r * to.s, kept.data() + to.down);
        std::copy_n(old.data() + from.up, to.s * (to.s + to.r), kept.data() + to.up);
    }
}

template <class Real, class Panel>
void keep(LargeArray<Real>& kept, const Panel& panel, const Eigen::MatrixXd& inverse,
          const Eigen::MatrixXd& below) {
    using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
    Eigen::Map<Matrix> up(kept.data() + panel.up, panel.s, panel.s + panel.r);
    up.leftCols(panel.s) = inverse.template cast<Real>();
    if (panel.r == 0) return;
    Eigen::Map<Matrix>(kept.data() + panel.down, panel.r, panel.s) = below.template cast<Real>();
    up.rightCols(panel.r) = -below.transpose().template cast<Real>();
}

}  // namespace

Factor::Factor(const Body& body) : tree_(dissect(body)) {}

std::size_t Factor::entries() const {
    return float_.size() + double_.size();
}

/// Where all goes that is kept for solving, for the tree as it is; `to_make` will be made anew.
void Factor::lay_out(const std::vector<int>& to_make) {
    const std::size_t nodes = tree_.nodes.size();
    std::vector<Panel> before(panels_.size());
    for (std::size_t n = 0; n < before.size(); ++n)
        before[n].down = panels_[n].down, before[n].up = panels_[n].up;
    std::vector<bool> stays(before.size(), true);
    for (int n : to_make)
        if (std::size_t(n) < stays.size()) stays[std::size_t(n)] = false;
    panels_.resize(nodes);
    places_.clear();
    widest_ = 0;
    std::size_t size = 0;
    for (std::size_t n = 0; n < nodes; ++n) {
        const Dissection::Node& node = tree_.nodes[n];
        Panel& panel = panels_[n];
        panel.s = int(node.columns.size()), panel.r = int(node.rows.size());
        widest_ = std::max({widest_, node.columns.size(), node.rows.size()});
        panel.places = places_.size();
        places_.insert(places_.end(), node.columns.begin(), node.columns.end());
        places_.insert(places_.end(), node.rows.begin(), node.rows.end());
        panel.down = size;
        size += std::size_t(panel.r) * std::size_t(panel.s);
    }
    for (std::size_t n = nodes; n-- > 0;) {
        Panel& panel = panels_[n];
        panel.up = size;
        size += std::size_t(panel.s) * std::size_t(panel.s + panel.r);
    }
    size += PanelProduct<float>::beyond;
    innerspring::lay_out(float_, in_float_ ? size : 0, in_float_ ? before : std::vector<Panel>(), panels_,
                         stays);
    innerspring::lay_out(double_, in_float_ ? 0 : size, in_float_ ? std::vector<Panel>() : before, panels_,
                         stays);
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
    return largest < 1e6 * least;
}

void Factor::factorize(const Body& body, std::span<const double> d, const std::vector<bool>& pinned) {
    double largest = 0;
    in_float_ = float_is_enough(body, d, largest);
    // A power of two: it changes no digit, and keeps floats in their range.
    scale_ = std::isnormal(largest) ? std::exp2(-std::ilogb(largest)) : 1.0;
    panels_.clear();
    lay_out({});
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
    lay_out(*nodes);
    nodes_made_ = int(nodes->size());
    for (int n : *nodes) make(body, d, pinned, n);
}

void Factor::make(const Body& body, std::span<const double> d, const std::vector<bool>& pinned, int n) {
    const Dissection::Node& node = tree_.nodes[std::size_t(n)];
    Panel& panel = panels_[std::size_t(n)];
    const int s = panel.s, r = panel.r;
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
        const auto A = theirs.L.block(theirs.s + segment.first, 0, rows, theirs.s);
        const auto top = A.topRows(columns);
        if (columns > 32) {  // of the square only the lower half
            product_.topRows(columns).template triangularView<Eigen::Lower>() = top * top.transpose();
            product_.bottomRows(rows - columns).noalias() = A.bottomRows(rows - columns) * top.transpose();
        } else {
            product_.noalias() = A * top.transpose();
        }
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
    Eigen::MatrixXd full = Eigen::MatrixXd::Zero(s, s);
    full.selfadjointView<Eigen::Lower>().rankUpdate(inverse.transpose());
    full.triangularView<Eigen::StrictlyUpper>() = full.transpose();
    Eigen::MatrixXd below(r, s);
    if (r > 0) below.noalias() = low * inverse.triangularView<Eigen::Lower>();
    if (in_float_)
        keep(float_, panel, full, below);
    else
        keep(double_, panel, full, below);
}

template <class Real>
void Factor::solve(Real* w) const {
    const Real* kept;
    if constexpr (std::is_same_v<Real, float>)
        kept = float_.data();
    else
        kept = double_.data();
    void (*multiply)(const PanelProduct<Real>&) = multiply_plain<Real>;
    if constexpr (std::is_same_v<Real, float>) multiply = vector_kernels().front()->multiply;
    Real* const out = w + 4 * tree_.node_of.size();
    // With A = (I + B) D (I + B)^T, B = L_RJ L_JJ^-1 below the nodes' dense D = L_JJ L_JJ^T:
    for (const Panel& panel : panels_) {  // (I + B)^-1, children first
        const int *columns = places_.data() + panel.places, *rows = columns + panel.s;
        multiply({kept + panel.down, panel.r, panel.s, columns, w, out});
        for (int i = 0; i < panel.r; ++i)
            for (int a = 0; a < 4; ++a) w[4 * std::ptrdiff_t(rows[i]) + a] -= out[4 * i + a];
    }
    for (std::size_t n = panels_.size(); n-- > 0;) {  // D^-1, then (I + B)^-T, parents first
        const Panel& panel = panels_[n];
        const int* columns = places_.data() + panel.places;
        multiply({kept + panel.up, panel.s, panel.s + panel.r, columns, w, out});
        for (int i = 0; i < panel.s; ++i) std::copy_n(out + 4 * i, 4, w + 4 * std::ptrdiff_t(columns[i]));
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
        run(std::vector<float>(solve_size()));
    else
        run(std::vector<double>(solve_size()));
}

}  // namespace innerspring
