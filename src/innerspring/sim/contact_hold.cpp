#include "innerspring/sim/contact_hold.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace innerspring {

namespace {

/// D of sliding points, in units of what resists there: with more their direction is found in fewer rounds,
/// each of which takes longer.
constexpr double firm = 3;

}  // namespace

void ContactHold::reserve(std::size_t vertices) {
    single_.reserve(vertices), uses_.reserve(vertices);
    now_.sliding.reserve(vertices), kept_.sliding.reserve(vertices);
}

void ContactHold::take(const Contact& contact, std::span<const Candidate> candidates, double h) {
    clear();
    uses_.assign(candidates.size(), 0);
    for (const Contact::Point& p : contact.points())
        if (p.jn > 0)
            for (int n = 0; n < p.count; ++n) ++uses_[p.corners[n]];
    for (const Contact::Point& p : contact.points()) {
        if (!(p.jn > 0)) continue;
        std::array<Index, 3> vertices{};
        std::array<double, 3> weights{};  // none for what is pinned
        double square = 0;
        for (int n = 0; n < p.count; ++n) {
            const Candidate& c = candidates[p.corners[n]];
            vertices[n] = c.vertex, weights[n] = c.inverse_mass > 0 ? p.weights[n] : 0;
            square += weights[n] * weights[n];
        }
        if (const double most = p.jt.norm() / h; !p.sticks && most > 0) {
            now_.sliding.push_back({vertices, weights, p.count, p.normal, p.jt / h, p.x + h * p.velocity,
                                    most, firm / (h * h * p.inverse_mass), Vector::Zero()});
        }
        if (p.radius > 0 && p.known) take_slope(p, candidates, h);
        if (p.count == 1 && uses_[p.corners[0]] == 1) {
            single_.push_back({vertices[0], p.sticks, p.normal});
            continue;
        }
        Row row{vertices, weights, p.count, p.normal};
        for (double& w : row.weights) w /= std::sqrt(square);
        rows_.push_back(row);
        if (!p.sticks) continue;
        row.direction = p.normal.unitOrthogonal();
        rows_.push_back(row);
        row.direction = p.normal.cross(row.direction);
        rows_.push_back(row);
    }
    if (!rows_.empty()) factorize();
}

/// grad w_k = n x (the side across from k) / twice the area; along a side ab, grad w_b = (b - a) / |b - a|^2.
void ContactHold::take_slope(const Contact::Point& p, std::span<const Candidate> candidates, double h) {
    Slope slope{{}, {}, p.normal, p.jn / h * p.radius};
    std::array<Vector, 3> y;  // in the plane
    for (int k = 0; k < 3; ++k) {
        const Candidate& c = candidates[p.corners[k]];
        if (c.inverse_mass == 0) return;  // held by a pin
        slope.vertices[k] = c.vertex, slope.gradients[k] = Vector::Zero();
        y[k] = c.x - p.normal.dot(c.x) * p.normal;
    }
    const auto none = std::find(p.weights.begin(), p.weights.end(), 0.0);
    if (none == p.weights.end()) {
        const double area = p.normal.dot((y[1] - y[0]).cross(y[2] - y[0]));
        if (!(std::abs(area) > 1e-3 * (y[1] - y[0]).norm() * (y[2] - y[0]).norm())) return;
        for (int k = 0; k < 3; ++k)
            slope.gradients[k] = p.normal.cross(y[(k + 2) % 3] - y[(k + 1) % 3]) / area;
    } else {
        const std::size_t k = std::size_t(none - p.weights.begin()), a = (k + 1) % 3, b = (k + 2) % 3;
        const Vector side = y[b] - y[a];
        if (!(side.squaredNorm() > 0)) return;
        slope.gradients[b] = side / side.squaredNorm(), slope.gradients[a] = -slope.gradients[b];
    }
    now_.slopes.push_back(slope);
}

/// C C^T of the coupled rows, which need not be independent: with a little on the diagonal.
void ContactHold::factorize() {
    constexpr double little = 1e-10;
    struct Use {
        Index vertex, row;
        int corner;
    };
    std::vector<Use> uses;
    for (Index r = 0; r < rows_.size(); ++r)
        for (int n = 0; n < rows_[r].count; ++n)
            if (rows_[r].weights[n] != 0) uses.push_back({rows_[r].vertices[n], r, n});
    std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) {
        return std::tie(a.vertex, a.row) < std::tie(b.vertex, b.row);
    });
    std::vector<Eigen::Triplet<double>> entries;
    for (int r = 0; r < int(rows_.size()); ++r) entries.emplace_back(r, r, little);
    for (std::size_t first = 0, last; first < uses.size(); first = last) {
        for (last = first; last < uses.size() && uses[last].vertex == uses[first].vertex;) ++last;
        for (std::size_t i = first; i < last; ++i)
            for (std::size_t j = first; j < last; ++j) {
                const Row &a = rows_[uses[i].row], &b = rows_[uses[j].row];
                entries.emplace_back(
                    int(uses[i].row), int(uses[j].row),
                    a.weights[uses[i].corner] * b.weights[uses[j].corner] * a.direction.dot(b.direction));
            }
    }
    Eigen::SparseMatrix<double> products{Eigen::Index(rows_.size()), Eigen::Index(rows_.size())};
    products.setFromTriplets(entries.begin(), entries.end());
    factor_.compute(products);
    b_.resize(Eigen::Index(rows_.size()));
}

Vector ContactHold::pull_at(const Sliding& s, const Field& x) {
    Vector by = -s.stuck;
    for (int n = 0; n < s.count; ++n) by += s.weights[n] * x[s.vertices[n]];
    return s.force - s.stiffness * (by - s.normal.dot(by) * s.normal);
}

Vector ContactHold::Slope::at(const Field& x) const {
    Vector t = Vector::Zero();
    for (int k = 0; k < 3; ++k) t += normal.dot(x[vertices[k]]) * gradients[k];
    return t;
}

double ContactHold::Energies::add_gradient(const Field& x, Field* g) const {
    double value = 0;
    for (const Slope& s : slopes) {
        const Vector t = s.at(x);
        value += s.stiffness / 2 * t.squaredNorm();
        for (int k = 0; g && k < 3; ++k)
            (*g)[s.vertices[k]] += s.stiffness * s.gradients[k].dot(t) * s.normal;
    }
    for (const Sliding& s : sliding) {
        Vector f = pull_at(s, x);
        const double size = f.norm(), left = std::min(size, s.most);
        value += left * (size - left / 2) / s.stiffness;
        if (size > s.most) f *= s.most / size;
        for (int n = 0; g && n < s.count; ++n) (*g)[s.vertices[n]] -= s.weights[n] * f;
    }
    return value;
}

void ContactHold::linearise(const Field& x) {
    for (Sliding& s : now_.sliding) s.pull = pull_at(s, x);
}

double ContactHold::multiply(const Field& p, Field& q) const {
    double sum = 0;
    for (const Slope& s : now_.slopes) {
        const Vector t = s.at(p);
        sum += s.stiffness * t.squaredNorm();
        for (int k = 0; k < 3; ++k) q[s.vertices[k]] += s.stiffness * s.gradients[k].dot(t) * s.normal;
    }
    for (const Sliding& s : now_.sliding) {
        Vector by = Vector::Zero();
        for (int n = 0; n < s.count; ++n) by += s.weights[n] * p[s.vertices[n]];
        by -= s.normal.dot(by) * s.normal;
        const double size = s.pull.norm();
        Vector f = s.stiffness * by;
        if (size > s.most) f = s.most / size * (f - s.pull.dot(f) / (size * size) * s.pull);
        sum += by.dot(f);
        for (int n = 0; n < s.count; ++n) q[s.vertices[n]] += s.weights[n] * f;
    }
    return sum;
}

void ContactHold::project(Field& v) const {
    for (const Single& s : single_) {
        Vector& a = v[s.vertex];
        if (s.sticks)
            a.setZero();
        else
            a -= s.normal.dot(a) * s.normal;
    }
    if (rows_.empty()) return;
    project_rows(v), project_rows(v);  // the second time for what little leaves
}

void ContactHold::project_rows(Field& v) const {
    for (std::size_t r = 0; r < rows_.size(); ++r) {
        const Row& row = rows_[r];
        double sum = 0;
        for (int n = 0; n < row.count; ++n) sum += row.weights[n] * row.direction.dot(v[row.vertices[n]]);
        b_[Eigen::Index(r)] = sum;
    }
    y_ = factor_.solve(b_);
    for (std::size_t r = 0; r < rows_.size(); ++r) {
        const Row& row = rows_[r];
        for (int n = 0; n < row.count; ++n)
            v[row.vertices[n]] -= row.weights[n] * y_[Eigen::Index(r)] * row.direction;
    }
}

}  // namespace innerspring
