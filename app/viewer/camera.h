#pragma once
#include <Eigen/Core>
#include <optional>
#include <string_view>

#include "innerspring/mesh/geometry.h"

namespace innerspring::viewer {

struct Ray {
    Vector from, along;  ///< [m]; along has length 1
};

/// Looks at `focus` from `distance` away, y up.
struct Camera {
    Vector focus = Vector::Zero();  ///< [m]
    double distance = 5;            ///< [m]
    double azimuth = 30;            ///< [degree] about y; 0 looks along -z
    double elevation = 20;          ///< [degree] above the horizon
    double field = 30;              ///< [degree] of view, over the smaller side
    double extent = 1;              ///< [m] what it was fitted to; sets the depth range
    double aside = 0;               ///< the focus is seen so far left of the middle, in halves of the width

    Vector back() const;   ///< from the focus to the eye, length 1
    Vector right() const;  ///< length 1
    Vector up() const;     ///< length 1
    Vector eye() const { return focus + distance * back(); }
    Eigen::Matrix4d view() const;
    Eigen::Matrix4d projection(double aspect) const;  ///< width / height
    /// Of half the picture's height, at the focus [m].
    double half_height(double aspect) const;
    /// Through a point of the picture: x from -1 (left) to 1, y from -1 (bottom) to 1.
    Ray ray(double x, double y, double aspect) const;
};

/// Looks at the whole box; keeps the direction.
void fit(Camera& camera, const Vector& lower, const Vector& upper);
void orbit(Camera& camera, double right_degrees, double up_degrees);
/// By shares of half the picture's height.
void pan(Camera& camera, double right, double up, double aspect);
/// Nearer by a factor.
void zoom(Camera& camera, double factor);
/// How much nearer it is than where everything was seen [1].
double zoomed(const Camera& camera);

/// "AZIMUTH,ELEVATION[,ZOOM]" [degree, degree, 1]. Throws InputError. The zoom is applied after fitting.
struct CameraOption {
    double azimuth = 30, elevation = 20, zoom = 1;
};
CameraOption parse_camera(std::string_view text);

/// Where a ray meets a surface first.
struct Hit {
    Index triangle;
    Index vertex;        ///< nearest corner
    double distance;     ///< [m] along the ray
    Vector point;        ///< [m]
    Vector barycentric;  ///< of the three corners
};
/// Looks at every triangle: a moving surface would need a new tree for each ray, which costs more.
std::optional<Hit> first_hit(const Ray& ray, Positions x, Triangles triangles);

}  // namespace innerspring::viewer
