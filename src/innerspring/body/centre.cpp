#include "innerspring/body/centre.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

#include "innerspring/mesh/error.h"

namespace innerspring {

std::string_view to_string(CentreKind kind) {
    switch (kind) {
        case CentreKind::automatic:
            return "auto";
        case CentreKind::centroid:
            return "centroid";
        case CentreKind::given:
            return "given";
        case CentreKind::kernel:
            return "kernel";
        case CentreKind::local:
            return "local";
    }
    return "?";
}

CentreOption parse_centre(std::string_view text) {
    for (CentreKind kind :
         {CentreKind::automatic, CentreKind::centroid, CentreKind::kernel, CentreKind::local})
        if (text == to_string(kind)) return {kind, Vector::Zero()};
    CentreOption option{CentreKind::given, Vector::Zero()};
    const char *p = text.data(), *end = text.data() + text.size();
    for (int axis = 0; axis < 3; ++axis) {
        const auto [next, error] = std::from_chars(p, end, option.position[axis]);
        if (error != std::errc() || !std::isfinite(option.position[axis]) ||
            (axis < 2 ? next == end || *next != ',' : next != end))
            throw InputError(
                fmt::format("centre '{}': expected auto, centroid, kernel, local or X,Y,Z in metres", text));
        p = next + 1;
    }
    return option;
}

namespace {

/// The half-space a . x <= b, |a| = 1.
template <int D>
struct HalfSpace {
    Eigen::Matrix<double, D, 1> a;
    double b;
};

/// The point nearest to the origin in the intersection of half-spaces (Seidel 1991, Megiddo): taken in turn,
/// a half-space that the point so far violates must be tight in the answer, which reduces the problem by a
/// dimension. Expected O(n) for a shuffled list.
template <int D>
std::optional<Eigen::Matrix<double, D, 1>> nearest_to_origin(const std::vector<HalfSpace<D>>& spaces,
                                                             double slack) {
    using Point = Eigen::Matrix<double, D, 1>;
    if constexpr (D == 1) {
        double low = -INFINITY, high = INFINITY;
        for (const auto& h : spaces) {
            if (h.a[0] > 0)
                high = std::min(high, h.b / h.a[0]);
            else if (h.a[0] < 0)
                low = std::max(low, h.b / h.a[0]);
            else if (h.b < -slack)
                return std::nullopt;
        }
        if (low > high + slack) return std::nullopt;
        return Point(std::clamp(0.0, std::min(low, high), high));
    } else {
        Point x = Point::Zero();
        for (std::size_t n = 0; n < spaces.size(); ++n) {
            const auto& h = spaces[n];
            if (h.a.dot(x) <= h.b + slack) continue;
            // An orthonormal basis of the plane a . x = b, with origin at its point nearest to ours.
            const Point origin = h.b * h.a;
            Point w = h.a;  // Householder: I - 2 w w^T / w.w maps the first axis to -+a, so its other columns
                            // span the plane
            w[0] += h.a[0] < 0 ? -1 : 1;
            const Eigen::Matrix<double, D, D> Q =
                Eigen::Matrix<double, D, D>::Identity() - 2 / w.squaredNorm() * w * w.transpose();
            const Eigen::Matrix<double, D, D - 1> basis = Q.template rightCols<D - 1>();
            std::vector<HalfSpace<D - 1>> lower;
            lower.reserve(n);
            for (std::size_t j = 0; j < n; ++j) {
                HalfSpace<D - 1> g{basis.transpose() * spaces[j].a, spaces[j].b - spaces[j].a.dot(origin)};
                const double length = g.a.norm();
                if (length < 1e-12) {
                    if (g.b < -slack) return std::nullopt;
                    continue;
                }
                lower.push_back({g.a / length, g.b / length});
            }
            const auto y = nearest_to_origin<D - 1>(lower, slack);
            if (!y) return std::nullopt;
            x = origin + basis * *y;
        }
        return x;
    }
}

}  // namespace

std::optional<Vector> kernel_point(const SurfaceMesh& mesh, const Vector& target, double margin) {
    const auto [lower, upper] = bounding_box(mesh.positions);
    const double slack = 1e-9 * (upper - lower).norm();
    // Of every `stride`-th triangle.
    const auto nearest = [&](std::size_t stride) {
        std::vector<HalfSpace<3>> spaces;
        for (std::size_t n = 0; n < mesh.triangles.size(); n += stride) {
            const Triangle& t = mesh.triangles[n];
            const Vector by = double_area_vector(mesh.positions, t);
            const double length = by.norm();
            if (length > 0)
                spaces.push_back({by / length, by.dot(mesh.positions[t[0]] - target) / length - margin});
        }
        std::uint64_t random = 88172645463325252u;  // xorshift: any fixed shuffle serves
        for (std::size_t n = spaces.size(); n > 1; --n) {
            random ^= random << 13, random ^= random >> 7, random ^= random << 17;
            std::swap(spaces[n - 1], spaces[random % n]);
        }
        return nearest_to_origin<3>(spaces, slack);
    };
    // Where no point serves some of them, none serves all.
    const std::size_t some = 1 + mesh.triangles.size() / 4000;
    if (some > 1 && !nearest(some)) return std::nullopt;
    const auto x = nearest(1);
    if (!x) return std::nullopt;
    return Vector(*x + target);
}

}  // namespace innerspring
