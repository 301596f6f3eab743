#include "innerspring/mesh/weld.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

/// Maps coordinates to cells of a grid, monotonically, so that whatever lies in [x - tolerance, x +
/// tolerance] lies in the cells from cell(x - tolerance) to cell(x + tolerance): rounding cannot lose a
/// neighbour. Those are a handful at most.
struct Grid {
    double size;     // two tolerances: then that range touches two cells, seldom three
    double uniform;  // from here on numbers are no denser than half a tolerance, and each is a cell of its
                     // own; no index overflows
    explicit Grid(double tolerance) : size(2 * tolerance), uniform(std::ldexp(size, 51)) {}

    std::int64_t cell(double x) const {
        const double a = std::min(std::abs(x), std::numeric_limits<double>::max());
        const std::int64_t n = a < uniform ? std::int64_t(a / size)
                                           : (std::int64_t(1) << 51) + std::bit_cast<std::int64_t>(a) -
                                                 std::bit_cast<std::int64_t>(uniform);
        return x < 0 ? -n : n;
    }
};

using Cell = std::array<std::int64_t, 3>;

std::uint64_t hash(const Cell& cell) {
    std::uint64_t h = 0;
    for (const std::int64_t c : cell) {
        h = (h ^ std::uint64_t(c)) * 0x9e3779b97f4a7c15u;
        h ^= h >> 32;
    }
    return h;
}

/// The vertices kept so far, chained by the hash of their cell.
struct Kept {
    std::vector<Vector> positions;
    std::vector<Index> next;
    std::vector<Index> head;

    explicit Kept(std::size_t expected) : head(std::bit_ceil(expected + 1), no_index) {}

    Index& bucket(const Cell& cell) { return head[hash(cell) & (head.size() - 1)]; }

    /// The earliest vertex within the tolerance of p; if there is none, p itself, which is now kept.
    Index find_or_keep(const Grid& grid, const Vector& p, double tolerance) {
        Cell low, high;
        for (int i = 0; i < 3; ++i) {
            low[std::size_t(i)] = grid.cell(p[i] - tolerance);
            high[std::size_t(i)] = grid.cell(p[i] + tolerance);
        }
        Index found = no_index;
        Cell c;
        for (c[0] = low[0]; c[0] <= high[0]; ++c[0])
            for (c[1] = low[1]; c[1] <= high[1]; ++c[1])
                for (c[2] = low[2]; c[2] <= high[2]; ++c[2])
                    for (Index k = bucket(c); k != no_index; k = next[k])
                        if (k < found && is_near(positions[k], p, tolerance)) found = k;
        if (found != no_index) return found;
        found = Index(positions.size());
        Index& first = bucket({grid.cell(p[0]), grid.cell(p[1]), grid.cell(p[2])});
        positions.push_back(p);
        next.push_back(first);
        first = found;
        return found;
    }

    /// The same for a tolerance of 0, where a point has one cell, for all `points` in turn. Far apart in
    /// memory as they lie, what one looks up is asked for some points ahead.
    void find_or_keep_all(const Grid& grid, const std::vector<Vector>& points, std::vector<Index>& found) {
        constexpr std::size_t ahead = 32;
        std::array<Index*, ahead> buckets;
        for (std::size_t start = 0; start < points.size(); start += ahead) {
            const std::size_t count = std::min(ahead, points.size() - start);
            for (std::size_t n = 0; n < count; ++n) {
                const Vector& p = points[start + n];
                buckets[n] = &bucket({grid.cell(p[0]), grid.cell(p[1]), grid.cell(p[2])});
                __builtin_prefetch(buckets[n]);
            }
            for (std::size_t n = 0; n < count; ++n)
                if (*buckets[n] != no_index) {
                    __builtin_prefetch(&positions[*buckets[n]]);
                    __builtin_prefetch(&next[*buckets[n]]);
                }
            for (std::size_t n = 0; n < count; ++n) {
                const Vector& p = points[start + n];
                Index k = *buckets[n];
                while (k != no_index && !(positions[k] == p)) k = next[k];
                if (k == no_index) {  // of equal points only one is kept, so no matter in which order
                    k = Index(positions.size());
                    positions.push_back(p);
                    next.push_back(std::exchange(*buckets[n], k));
                }
                found.push_back(k);
            }
        }
    }

    static bool is_near(const Vector& a, const Vector& b, double tolerance) {
        if (a == b) return true;
        return tolerance > 0 && std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) <= tolerance;
    }
};

}  // namespace

Welded weld(const SurfaceMesh& mesh, const WeldOptions& options) {
    if (!(options.tolerance >= 0 && std::isfinite(options.tolerance)))
        throw InputError(fmt::format("weld: tolerance {} is not a length; give a finite number, 0 or more",
                                     options.tolerance));
    Welded welded;
    welded.mesh.name = mesh.name;
    welded.new_from_old.reserve(mesh.positions.size());
    const Grid grid(options.tolerance);
    // A closed surface has half as many vertices as triangles, however often the file repeats them.
    Kept kept(std::min(mesh.positions.size(), mesh.triangles.size()));
    if (options.tolerance == 0)
        kept.find_or_keep_all(grid, mesh.positions, welded.new_from_old);
    else
        for (const Vector& p : mesh.positions)
            welded.new_from_old.push_back(kept.find_or_keep(grid, p, options.tolerance));
    welded.merged = Index(mesh.positions.size() - kept.positions.size());

    // Number the kept vertices that are used; `next` has served and takes the numbers.
    std::vector<Index>& number = kept.next;
    number.assign(kept.positions.size(), no_index);
    for (const Triangle& t : mesh.triangles)
        for (const Index v : t) number[welded.new_from_old[v]] = 0;
    Index used = 0;
    for (std::size_t k = 0; k < number.size(); ++k) {
        if (number[k] == no_index) continue;
        kept.positions[used] = kept.positions[k];
        number[k] = used++;
    }
    welded.unused = Index(number.size()) - used;
    kept.positions.resize(used);
    welded.mesh.positions = std::move(kept.positions);
    for (Index& v : welded.new_from_old) v = number[v];
    welded.mesh.triangles.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles)
        welded.mesh.triangles.push_back(
            {welded.new_from_old[t[0]], welded.new_from_old[t[1]], welded.new_from_old[t[2]]});
    return welded;
}

}  // namespace innerspring
