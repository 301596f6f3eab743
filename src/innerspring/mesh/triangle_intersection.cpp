#include "innerspring/mesh/triangle_intersection.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace innerspring {

namespace {

constexpr double eps = 0x1p-53;  // half a unit in the last place of 1

int sign(double v) {
    return (v > 0) - (v < 0);
}

/// An exact sum of doubles, held as parts that do not overlap, in increasing size (J. R. Shewchuk, Adaptive
/// Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates, 1997: grow-expansion with zeros
/// left out).
class ExactSum {
  public:
    void add(double b) {
        int kept = 0;
        for (int i = 0; i < count_; ++i) {
            const double s = b + part_[i], v = s - b, rest = (b - (s - v)) + (part_[i] - v);
            if (rest != 0) part_[kept++] = rest;
            b = s;
        }
        if (b != 0) part_[kept++] = b;
        count_ = kept;
    }
    void add_product(double p, double q) {
        const double product = p * q;
        add(product);
        add(std::fma(p, q, -product));
    }
    int sign_of_sum() const { return count_ == 0 ? 0 : sign(part_[count_ - 1]); }

  private:
    std::array<double, 200> part_;  // at most 6 * 8 * 4 summands below
    int count_ = 0;
};

using Parts = std::array<double, 2>;

/// a - b as rounded difference and rest.
Parts difference(double a, double b) {
    const double d = a - b, v = a - d;
    return {d, (a - (d + v)) + (v - b)};
}

void add_product(ExactSum& sum, const Parts& p, const Parts& q, double factor) {
    for (double i : p)
        for (double j : q)
            if (i != 0 && j != 0) sum.add_product(factor * i, j);
}

void add_product(ExactSum& sum, const Parts& p, const Parts& q, const Parts& r, double factor) {
    for (double i : p)
        for (double j : q)
            for (double k : r) {
                if (i == 0 || j == 0 || k == 0) continue;
                const double ij = i * j;
                sum.add_product(factor * ij, k);
                sum.add_product(factor * std::fma(i, j, -ij), k);
            }
}

int exact_orientation(const Vector& a, const Vector& b, const Vector& c, const Vector& d) {
    std::array<Parts, 3> u, v, w;
    for (int i = 0; i < 3; ++i) {
        u[i] = difference(b[i], a[i]);
        v[i] = difference(c[i], a[i]);
        w[i] = difference(d[i], a[i]);
    }
    ExactSum sum;
    for (int i = 0; i < 3; ++i) {
        add_product(sum, u[i], v[(i + 1) % 3], w[(i + 2) % 3], 1);
        add_product(sum, u[i], v[(i + 2) % 3], w[(i + 1) % 3], -1);
    }
    return sum.sign_of_sum();
}

/// d . (p - o), or 0 where its rounding error could change the sign.
double safe_projection(const Vector& d, const Vector& p, const Vector& o) {
    const double x = d[0] * (p[0] - o[0]), y = d[1] * (p[1] - o[1]), z = d[2] * (p[2] - o[2]);
    const double sum = x + y + z;
    return std::abs(sum) > 8 * eps * (std::abs(x) + std::abs(y) + std::abs(z)) ? sum : 0;
}

bool apart(const Vector* a, const Vector* b, const Vector* shared) {
    // Proof of the common case without determinants: a plane, here across the line of the middles, has one
    // triangle strictly on each side (but for the shared vertex, which lies on it).
    if (shared) {
        Vector d = (b[0] - *shared).normalized() + (b[1] - *shared).normalized() -
                   (a[0] - *shared).normalized() - (a[1] - *shared).normalized();
        return safe_projection(d, a[0], *shared) < 0 && safe_projection(d, a[1], *shared) < 0 &&
               safe_projection(d, b[0], *shared) > 0 && safe_projection(d, b[1], *shared) > 0;
    }
    const Vector d = (b[0] + b[1] + b[2]) - (a[0] + a[1] + a[2]),
                 o = (a[0] + a[1] + a[2] + b[0] + b[1] + b[2]) / 6;
    for (int i = 0; i < 3; ++i)
        if (!(safe_projection(d, a[i], o) < 0 && safe_projection(d, b[i], o) > 0)) return false;
    return true;
}

bool segments_meet(int axis, const Vector& p, const Vector& q, const Vector& a, const Vector& b) {
    const int pa = orientation_along(axis, p, q, a), pb = orientation_along(axis, p, q, b);
    const int ap = orientation_along(axis, a, b, p), aq = orientation_along(axis, a, b, q);
    if (pa * pb > 0 || ap * aq > 0) return false;
    if (pa != 0 || pb != 0 || ap != 0 || aq != 0) return true;
    for (int k = 0; k < 3; ++k)  // on one line
        if (k != axis &&
            (std::max(p[k], q[k]) < std::min(a[k], b[k]) || std::max(a[k], b[k]) < std::min(p[k], q[k])))
            return false;
    return true;
}

/// All five in one plane.
bool segment_meets_triangle_in_plane(const Vector& p, const Vector& q, const Vector& a, const Vector& b,
                                     const Vector& c) {
    int axis = 0, turn = 0;
    while (axis < 3 && (turn = orientation_along(axis, a, b, c)) == 0) ++axis;
    if (turn == 0) return false;
    const bool p_inside = turn * orientation_along(axis, a, b, p) >= 0 &&
                          turn * orientation_along(axis, b, c, p) >= 0 &&
                          turn * orientation_along(axis, c, a, p) >= 0;
    return p_inside || segments_meet(axis, p, q, a, b) || segments_meet(axis, p, q, b, c) ||
           segments_meet(axis, p, q, c, a);
}

/// Triangles (u, v, a) and (u, v, b).
bool folded(const Vector& u, const Vector& v, const Vector& a, const Vector& b) {
    const Vector e = v - u, p = a - u, q = b - u;
    // The normals e x p and q x e of a surface that goes on smoothly look the same way; folded, they are
    // opposite.
    if (e.cross(p).dot(e.cross(q)) < -64 * eps * e.squaredNorm() * p.norm() * q.norm()) return false;
    if (orientation(u, v, a, b) != 0) return false;
    for (int axis = 0; axis < 3; ++axis)
        if (const int side = orientation_along(axis, u, v, a); side != 0)
            return side == orientation_along(axis, u, v, b);
    return false;
}

/// True if all of t lies strictly on one side of the plane of s.
bool clear_of_plane(const Vector* s, const Vector* t) {
    const int side = orientation(s[0], s[1], s[2], t[0]);
    return side != 0 && side == orientation(s[0], s[1], s[2], t[1]) &&
           side == orientation(s[0], s[1], s[2], t[2]);
}

}  // namespace

int orientation(const Vector& a, const Vector& b, const Vector& c, const Vector& d) {
    const double ux = b[0] - a[0], uy = b[1] - a[1], uz = b[2] - a[2];
    const double vx = c[0] - a[0], vy = c[1] - a[1], vz = c[2] - a[2];
    const double wx = d[0] - a[0], wy = d[1] - a[1], wz = d[2] - a[2];
    const double yz = uy * vz, zy = uz * vy, zx = uz * vx, xz = ux * vz, xy = ux * vy, yx = uy * vx;
    const double det = wx * (yz - zy) + wy * (zx - xz) + wz * (xy - yx);
    const double size = std::abs(wx) * (std::abs(yz) + std::abs(zy)) +
                        std::abs(wy) * (std::abs(zx) + std::abs(xz)) +
                        std::abs(wz) * (std::abs(xy) + std::abs(yx));
    const double bound = (7 + 56 * eps) * eps * size;  // Shewchuk's A bound
    if (det > bound || -det > bound) return sign(det);
    return size == 0 ? 0 : exact_orientation(a, b, c, d);
}

int orientation_along(int axis, const Vector& a, const Vector& b, const Vector& c) {
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    const double left = (b[i] - a[i]) * (c[j] - a[j]), right = (b[j] - a[j]) * (c[i] - a[i]);
    const double det = left - right, bound = (3 + 16 * eps) * eps * (std::abs(left) + std::abs(right));
    if (det > bound || -det > bound) return sign(det);
    if (left == 0 && right == 0) return 0;
    ExactSum sum;
    add_product(sum, difference(b[i], a[i]), difference(c[j], a[j]), 1);
    add_product(sum, difference(b[j], a[j]), difference(c[i], a[i]), -1);
    return sum.sign_of_sum();
}

bool segment_meets_triangle(const Vector& p, const Vector& q, const Vector& a, const Vector& b,
                            const Vector& c) {
    const int side_p = orientation(a, b, c, p), side_q = orientation(a, b, c, q);
    if (side_p * side_q > 0) return false;
    if (side_p == 0 && side_q == 0) return segment_meets_triangle_in_plane(p, q, a, b, c);
    // The line pq crosses the plane once, within the segment: inside the triangle if it passes all three
    // sides the same way round.
    const int ab = orientation(p, q, a, b), bc = orientation(p, q, b, c), ca = orientation(p, q, c, a);
    return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

bool triangles_cross(Positions x, const Triangle& s, const Triangle& t) {
    // Shared vertices to the front, in both.
    Triangle p = s, q = t;
    int shared = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = shared; j < 3; ++j)
            if (p[i] == q[j]) {
                std::swap(p[i], p[shared]);
                std::swap(q[j], q[shared]);
                ++shared;
                break;
            }
    if (shared == 3) return true;
    const Vector a[3] = {x[p[0]], x[p[1]], x[p[2]]}, b[3] = {x[q[0]], x[q[1]], x[q[2]]};
    if (shared == 2) return folded(a[0], a[1], a[2], b[2]);
    if (shared == 1) {
        // Were there a common point besides the vertex, follow the ray through it to where it leaves one of
        // the two: on the far side.
        return !apart(a + 1, b + 1, a) && (segment_meets_triangle(a[1], a[2], b[0], b[1], b[2]) ||
                                           segment_meets_triangle(b[1], b[2], a[0], a[1], a[2]));
    }
    if (apart(a, b, nullptr) || clear_of_plane(a, b) || clear_of_plane(b, a)) return false;
    for (int i = 0; i < 3; ++i)
        if (segment_meets_triangle(a[i], a[(i + 1) % 3], b[0], b[1], b[2]) ||
            segment_meets_triangle(b[i], b[(i + 1) % 3], a[0], a[1], a[2]))
            return true;
    return false;
}

}  // namespace innerspring
