#include "innerspring/body/anisotropy.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

#include "innerspring/body/body.h"
#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

/// The largest modulus over the least.
constexpr double most_apart = 1e8;

constexpr std::array<std::string_view, 4> names{"isotropic", "radial", "fibres", "orthotropic"};

/// Towards the vertex's centre, of any length: where each has its own, against the normal that is exact on
/// spheres (Max 1999).
Vector to_centre(const Body& body, Index i) {
    const auto& q = body.rest.positions;
    if (body.centre.kind != CentreKind::local) return body.centre.position - q[i];
    Vector normal = Vector::Zero();
    for (const Spoke& spoke : body.spokes_of(i)) {
        const Vector a = q[spoke.neighbour] - q[i];
        for (Index t : body.edge_triangles[spoke.edge]) {
            // Each triangle once: where the spoke is its side after i.
            const Triangle& c = body.rest.triangles[t];
            const int corner = c[0] == i ? 0 : c[1] == i ? 1 : 2;
            if (c[std::size_t(corner + 1) % 3] != spoke.neighbour) continue;
            const Vector b = q[c[std::size_t(corner + 2) % 3]] - q[i];
            normal += a.cross(b) / (a.squaredNorm() * b.squaredNorm());
        }
    }
    return -normal;
}

Vector fibre(const Anisotropy& a, const Vector& q) {
    switch (a.course) {
        case Anisotropy::Course::straight:
            return a.direction;
        case Anisotropy::Course::around: {
            const Vector circle = a.direction.cross(q - a.through);
            const double r = circle.stableNorm();
            if (!(r > 1e-9 * (q - a.through).stableNorm())) return a.direction;
            const double pitch = a.pitch_deg * std::numbers::pi / 180;
            return std::cos(pitch) / r * circle + std::sin(pitch) * a.direction;
        }
        case Anisotropy::Course::outward:
            return q - a.through;
        case Anisotropy::Course::field:
            return a.field(q);
    }
    return a.direction;
}

Vector direction_at(const Body& body, const Anisotropy& a, Index i) {
    Vector v = Vector::Zero();
    if (a.kind == Anisotropy::Kind::orthotropic) {
        Eigen::Index most;
        a.moduli.maxCoeff(&most);
        return a.axes.col(most);
    }
    if (a.kind == Anisotropy::Kind::fibres)
        v = fibre(a, body.rest.positions[i]);
    else
        v = to_centre(body, i);
    v.stableNormalize();
    return v.allFinite() ? v : Vector(Vector::Zero());
}

}  // namespace

std::string_view to_string(Anisotropy::Kind kind) {
    return names[std::size_t(kind)];
}

Anisotropy::Kind parse_anisotropy(std::string_view text) {
    for (std::size_t k = 0; k < names.size(); ++k)
        if (text == names[k]) return Anisotropy::Kind(k);
    throw InputError(fmt::format("anisotropy '{}': expected isotropic, radial, fibres or orthotropic", text));
}

Vector moduli(const Material& m) {
    const Anisotropy& a = m.anisotropy;
    const double E = m.young, G = E / (2 * (1 + m.poisson)), across = a.across.value_or(E);
    switch (a.kind) {
        case Anisotropy::Kind::isotropic:
            break;
        case Anisotropy::Kind::radial:
            return {E, G, G};
        case Anisotropy::Kind::fibres:
            return {a.along, across, across};
        case Anisotropy::Kind::orthotropic:
            return a.moduli;
    }
    return {E, E, E};
}

double mean_modulus(const Material& material) {
    const Vector D = moduli(material);
    return isotropic(material) ? D[0] : D.sum() / 3;
}

double stiffest_share(const Material& material) {
    return isotropic(material) ? 1 : moduli(material).maxCoeff() / mean_modulus(material);
}

bool isotropic(const Material& material) {
    const Vector D = moduli(material);
    return D[0] == D[1] && D[1] == D[2];
}

void scale_moduli(Anisotropy& a, double by) {
    a.along *= by, a.moduli *= by;
    if (a.across) *a.across *= by;
}

void resolve_anisotropy(Material& material) {
    Anisotropy& a = material.anisotropy;
    const auto direction = [](Vector& v, const char* what) {
        if (!(v.stableNorm() > 0 && v.allFinite()))
            throw InputError(fmt::format("{} must be a direction, not zero", what));
        v.stableNormalize();
    };
    if (a.kind == Anisotropy::Kind::fibres) {
        if (!a.across) a.across = material.young;
        direction(a.direction, "direction of the fibres");
        if (!a.through.allFinite() || !std::isfinite(a.pitch_deg))
            throw InputError("the course of the fibres must be of finite numbers");
        if (a.course == Anisotropy::Course::field && !a.field)
            throw InputError("fibres along a field: the field is missing");
    }
    if (a.kind == Anisotropy::Kind::orthotropic) {
        for (int k = 0; k < 3; ++k) {
            Vector axis = a.axes.col(k);
            direction(axis, "an axis of orthotropy");
            a.axes.col(k) = axis;
        }
        if (!((a.axes.transpose() * a.axes - Eigen::Matrix3d::Identity()).norm() < 1e-6))
            throw InputError("the axes of orthotropy must stand at right angles to each other");
        // To rounding, so that the sums of the moduli are exact.
        a.axes.col(1) = (a.axes.col(1) - a.axes.col(0).dot(a.axes.col(1)) * a.axes.col(0)).normalized();
        const Vector third = a.axes.col(0).cross(a.axes.col(1));
        a.axes.col(2) = third.dot(a.axes.col(2)) < 0 ? Vector(-third) : third;
    }
    const Vector D = moduli(material);
    for (const double E : D)
        if (!(E > 0 && std::isfinite(E)))
            throw InputError(fmt::format("anisotropy ({}): a modulus is {:g} Pa; all must be positive",
                                         to_string(a.kind), E));
    // The least is what is left of the mean and the deviation: of its 16 digits half.
    if (!(D.maxCoeff() / D.minCoeff() <= most_apart))
        throw InputError(
            fmt::format("anisotropy ({}): moduli of {:g} and {:g} Pa are more than {:g} times apart",
                        to_string(a.kind), D.minCoeff(), D.maxCoeff(), most_apart));
}

Vector fibre_direction(const Body& body, Index i) {
    return direction_at(body, body.material.anisotropy, i);
}

void require_directions(const Body& body, const Material& material) {
    if (isotropic(material)) return;
    for (Index i = 0; i < body.vertices(); ++i) {
        if (std::abs(direction_at(body, material.anisotropy, i).squaredNorm() - 1) < 1e-6) continue;
        const Vector& q = body.rest.positions[i];
        throw InputError(fmt::format("{}: vertex {} at ({:.4g}, {:.4g}, {:.4g}) m has no direction of {}",
                                     body.rest.name, i, q.x(), q.y(), q.z(),
                                     to_string(material.anisotropy.kind)));
    }
}

void set_deviation(Body& body, Index i) {
    const Anisotropy& a = body.material.anisotropy;
    const Vector D = moduli(body.material);
    const double mean = mean_modulus(body.material);
    Eigen::Matrix3d sum;  // D_i / mean - I; the parts of D_i that are equal come as a multiple of I
    if (a.kind == Anisotropy::Kind::orthotropic) {
        sum = a.axes * (D / mean).asDiagonal() * a.axes.transpose() - Eigen::Matrix3d::Identity();
    } else {
        const Vector v = fibre_direction(body, i);
        sum = (D[0] - D[1]) / mean * v * v.transpose() + (D[1] / mean - 1) * Eigen::Matrix3d::Identity();
    }
    sum *= body.K[i];
    body.N[i] = {sum(0, 0), sum(0, 1), sum(0, 2), sum(1, 1), sum(1, 2), sum(2, 2)};
}

void set_deviations(Body& body) {
    body.N.clear();
    if (isotropic(body.material)) return;
    body.N.resize(body.vertices());
    for (Index i = 0; i < body.vertices(); ++i) set_deviation(body, i);
}

}  // namespace innerspring
