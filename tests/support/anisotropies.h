#pragma once
#include <Eigen/Geometry>

#include "support/bodies.h"

// Materials that are stiffer in some directions than in others.
namespace innerspring::support {

inline Anisotropy straight_fibres(double along, double across, const Vector& direction) {
    Anisotropy a;
    a.kind = Anisotropy::Kind::fibres;
    a.along = along, a.across = across, a.direction = direction;
    return a;
}

inline Anisotropy orthotropic(const Vector& moduli, const Eigen::Matrix3d& axes) {
    Anisotropy a;
    a.kind = Anisotropy::Kind::orthotropic;
    a.moduli = moduli, a.axes = axes;
    return a;
}

inline Eigen::Matrix3d tilted_axes() {
    return Eigen::AngleAxisd(0.8, Vector(1, -2, 0.5).normalized()).toRotationMatrix();
}

/// One of each kind and course, E = 10 Pa.
inline std::vector<std::pair<std::string, Anisotropy>> anisotropies() {
    Anisotropy radial, around = straight_fibres(40, 8, Vector(1, 1, 3)),
                       field = straight_fibres(5, 12, Vector::UnitX());
    radial.kind = Anisotropy::Kind::radial;
    around.course = Anisotropy::Course::around, around.pitch_deg = 20;
    field.course = Anisotropy::Course::field;
    field.field = [](const Vector& q) { return Vector(1 + q.y(), std::sin(3 * q.z()), 0.4); };
    return {{"radial", radial},
            {"straight fibres", straight_fibres(40, 10, Vector(2, -1, 0.5))},
            {"fibres around an axis", around},
            {"field", field},
            {"orthotropic", orthotropic({20, 5, 11}, tilted_axes())}};
}

/// D_i by its definition [Pa].
inline Eigen::Matrix3d modulus_at(const Body& body, const Anisotropy& a, Index i) {
    using Kind = Anisotropy::Kind;
    const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
    const Vector& q = body.rest.positions[i];
    const double E = body.material.young;
    if (a.kind == Kind::orthotropic) return a.axes * a.moduli.asDiagonal() * a.axes.transpose();
    if (a.kind == Kind::radial) {
        const Vector n = (q - body.centre.position).normalized();
        const double G = E / (2 * (1 + body.material.poisson));
        return E * n * n.transpose() + G * (I - n * n.transpose());
    }
    Vector d = a.direction.normalized();
    if (a.course == Anisotropy::Course::around) {
        const double pitch = a.pitch_deg * pi / 180;
        d = std::cos(pitch) * d.cross(q - a.through).normalized() + std::sin(pitch) * d;
    }
    if (a.course == Anisotropy::Course::field) d = a.field(q).normalized();
    return a.along * d * d.transpose() + a.across.value_or(E) * (I - d * d.transpose());
}

}  // namespace innerspring::support
