#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "innerspring/mesh/surface_mesh.h"

namespace innerspring {

struct Body;
struct Material;

/// A symmetric 3 x 3 matrix.
struct Symmetric {
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
    Vector operator*(const Vector& v) const {
        return Vector(xx * v.x() + xy * v.y() + xz * v.z(), xy * v.x() + yy * v.y() + yz * v.z(),
                      xz * v.x() + yz * v.y() + zz * v.z());
    }
};

/// How the inner stiffness depends on direction (ours). Eq. 3 with a modulus that is a matrix,
///     K_i = sum_{t at i} V_t / L_i^2  D_i   [N/m],
/// D_i symmetric and positive definite, in the frame of the body at rest:
///     isotropic    E I, the paper
///     radial       E n n^T + G (I - n n^T), n the direction to the vertex's centre, G = E / (2 (1 + nu))
///     fibres       E_f a a^T + E_p (I - a a^T), a the direction of the fibre at q_i
///     orthotropic  E_1 e_1 e_1^T + E_2 e_2 e_2^T + E_3 e_3 e_3^T
/// Body::K holds its mean over directions, tr(K_i)/3, and Body::N what is left.
struct Anisotropy {
    enum class Kind { isotropic, radial, fibres, orthotropic };
    enum class Course {
        straight,  ///< along `direction` everywhere
        around,   ///< around the axis `direction` through `through`, rising by `pitch_deg`; on the axis along
                  ///< it
        outward,  ///< away from `through`
        field     ///< what `field` says
    };

    Kind kind = Kind::isotropic;
    double along = 0;              ///< E_f [Pa]
    std::optional<double> across;  ///< E_p [Pa]; E where it is not given
    Course course = Course::straight;
    Vector direction = Vector::UnitX();  ///< [1], of any length
    Vector through = Vector::Zero();     ///< [m]
    double pitch_deg = 0;                ///< angle against the circles around the axis [degree]
    /// Direction of the fibre at a place of the body at rest [m]: [1], of any length but 0.
    std::function<Vector(const Vector&)> field;
    std::string file;                                    ///< that `field` was read from, if any
    Vector moduli = Vector::Zero();                      ///< E_1, E_2, E_3 [Pa]
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< e_1, e_2, e_3 in columns, at right angles
};

std::string_view to_string(Anisotropy::Kind kind);
Anisotropy::Kind parse_anisotropy(std::string_view text);  ///< throws InputError

/// The eigenvalues of D [Pa], the same at every vertex; the first is along the fibre or towards the centre.
Vector moduli(const Material& material);

/// tr(D)/3 [Pa], the same at every vertex; E to the bit where all moduli are equal.
double mean_modulus(const Material& material);

/// The largest eigenvalue of D over mean_modulus(), at least 1.
double stiffest_share(const Material& material);

/// Whether all moduli are equal: then nothing depends on direction, and Body::N is empty.
bool isotropic(const Material& material);

/// All moduli that are given times `by`: for another E with the same proportions.
void scale_moduli(Anisotropy& anisotropy, double by);

/// Checks and puts in order: `across` is given, directions are of length 1. Throws InputError for a modulus
/// that is not positive, moduli more than 1e8 times apart, or a direction that is none.
void resolve_anisotropy(Material& material);

/// The direction of the fibre, towards the centre, or of the stiffest axis [1], in the frame at rest; zero
/// where there is none.
Vector fibre_direction(const Body& body, Index i);

/// Throws InputError naming a vertex that has no direction by `material` (of the body's surface or another).
void require_directions(const Body& body, const Material& material);

/// N_i = K_i (D_i / mean_modulus() - I) of one vertex, from K_i and the surface around it. Without a
/// direction the vertex gets the modulus across.
void set_deviation(Body& body, Index i);
/// Of all; empty if isotropic.
void set_deviations(Body& body);

}  // namespace innerspring
