#include "solids.h"

#include <cmath>
#include <numbers>

namespace innerspring::viewer {

void revolve(const Vector& from, const Vector& axis, std::span<const std::pair<double, double>> profile,
             std::vector<Vector>& corners, std::vector<Vector>& normals) {
    constexpr int around = 32;
    const Vector side = axis.unitOrthogonal(), other = axis.cross(side);
    auto radial = [&](int n) -> Vector {
        const double a = 2 * std::numbers::pi * n / around;
        return std::cos(a) * side + std::sin(a) * other;
    };
    for (std::size_t p = 0; p + 1 < profile.size(); ++p) {
        const double z0 = profile[p].first, r0 = profile[p].second, z1 = profile[p + 1].first,
                     r1 = profile[p + 1].second;
        const double length = std::hypot(z1 - z0, r1 - r0);
        if (!(length > 0)) continue;
        for (int n = 0; n < around; ++n) {
            const Vector a = radial(n), b = radial(n + 1);
            auto normal = [&](const Vector& out) -> Vector {
                return ((z1 - z0) * out - (r1 - r0) * axis) / length;
            };
            const Vector p00 = from + z0 * axis + r0 * a, p01 = from + z0 * axis + r0 * b,
                         p10 = from + z1 * axis + r1 * a, p11 = from + z1 * axis + r1 * b;
            for (const Vector& corner : {p00, p01, p11, p00, p11, p10}) corners.push_back(corner);
            for (const Vector* out : {&a, &b, &b, &a, &b, &a}) normals.push_back(normal(*out));
        }
    }
}

std::vector<std::pair<double, double>> capsule(double radius, double length) {
    constexpr int pieces = 12;  // of a quarter
    std::vector<std::pair<double, double>> profile;
    for (int end : {-1, 1})
        for (int n = 0; n <= pieces; ++n) {
            const double a = std::numbers::pi / 2 * (end < 0 ? n : pieces - n) / pieces;
            profile.push_back({end * (length / 2 + radius * std::cos(a)), radius * std::sin(a)});
        }
    return profile;
}

}  // namespace innerspring::viewer
