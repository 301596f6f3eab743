#include "camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "innerspring/mesh/error.h"

namespace innerspring::viewer {

namespace {

constexpr double radian = std::numbers::pi / 180;

/// From where a ball of the size it was fitted to fills the field of view [m].
double fitted(const Camera& camera) {
    return camera.extent / std::sin(camera.field * radian / 2);
}

}  // namespace

Vector Camera::back() const {
    const double a = azimuth * radian, e = elevation * radian;
    return {std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e)};
}
Vector Camera::right() const {
    const double a = azimuth * radian;
    return {std::cos(a), 0, -std::sin(a)};
}
Vector Camera::up() const {
    return back().cross(right());
}

Eigen::Matrix4d Camera::view() const {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.block<1, 3>(0, 0) = right().transpose();
    m.block<1, 3>(1, 0) = up().transpose();
    m.block<1, 3>(2, 0) = back().transpose();
    m.block<3, 1>(0, 3) = -(m.block<3, 3>(0, 0) * eye());
    return m;
}

double Camera::half_height(double aspect) const {
    return distance * std::tan(field * radian / 2) / std::min(1.0, aspect);
}

Eigen::Matrix4d Camera::projection(double aspect) const {
    // Everything within 20 extents is kept; depth stays exact near the body.
    const double far = distance + 20 * extent, near = std::max(distance - 20 * extent, 0.01 * distance);
    const double f = distance / half_height(aspect);
    Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
    m(0, 0) = f / aspect;
    m(0, 2) = aside;  // over w = -z
    m(1, 1) = f;
    m(2, 2) = (far + near) / (near - far);
    m(2, 3) = 2 * far * near / (near - far);
    m(3, 2) = -1;
    return m;
}

Ray Camera::ray(double x, double y, double aspect) const {
    const double t = half_height(aspect) / distance;
    return {eye(), ((x + aside) * t * aspect * right() + y * t * up() - back()).normalized()};
}

void fit(Camera& camera, const Vector& lower, const Vector& upper) {
    camera.focus = (lower + upper) / 2;
    camera.extent = std::max((upper - lower).norm() / 2, 1e-30);
    camera.distance = fitted(camera);
}

void orbit(Camera& camera, double right_degrees, double up_degrees) {
    camera.azimuth = std::remainder(camera.azimuth - right_degrees, 360.0);
    camera.elevation = std::clamp(camera.elevation - up_degrees, -89.9, 89.9);
}

void pan(Camera& camera, double right, double up, double aspect) {
    camera.focus -= camera.half_height(aspect) * (right * camera.right() + up * camera.up());
}

void zoom(Camera& camera, double factor) {
    camera.distance = std::clamp(camera.distance / factor, 0.05 * camera.extent, 100 * camera.extent);
}

double zoomed(const Camera& camera) {
    return fitted(camera) / camera.distance;
}

CameraOption parse_camera(std::string_view text) {
    CameraOption option;
    double* const values[] = {&option.azimuth, &option.elevation, &option.zoom};
    const char *p = text.data(), *end = p + text.size();
    for (std::size_t n = 0; n < 3; ++n) {
        const auto [next, error] = std::from_chars(p, end, *values[n]);
        const bool done = error == std::errc() && next == end && n > 0;
        if (!done && (error != std::errc() || next == end || *next != ',' || n == 2))
            throw InputError(
                fmt::format("camera '{}': expected AZIMUTH,ELEVATION[,ZOOM] in degrees", text.substr(0, 60)));
        if (done) break;
        p = next + 1;
    }
    if (!(std::abs(option.elevation) <= 90) || !std::isfinite(option.azimuth) || !(option.zoom >= 0.05) ||
        !(option.zoom <= 100))
        throw InputError(
            fmt::format("camera '{}': the elevation must be within 90 degrees, the zoom from 0.05 to 100",
                        text.substr(0, 60)));
    option.elevation = std::clamp(option.elevation, -89.9, 89.9);
    return option;
}

std::optional<Hit> first_hit(const Ray& ray, Positions x, Triangles triangles) {
    // Moeller and Trumbore 1997.
    std::optional<Hit> first;
    for (Index t = 0; t < triangles.size(); ++t) {
        const Triangle& c = triangles[t];
        const Vector e1 = x[c[1]] - x[c[0]], e2 = x[c[2]] - x[c[0]], s = ray.from - x[c[0]];
        const Vector p = ray.along.cross(e2);
        const double det = e1.dot(p);
        if (!(det > 0)) continue;  // seen from behind, or from the edge
        const double u = s.dot(p);
        if (u < 0 || u > det) continue;
        const Vector q = s.cross(e1);
        const double v = ray.along.dot(q);
        if (v < 0 || u + v > det) continue;
        const double distance = e2.dot(q) / det;
        if (!(distance > 0) || (first && distance >= first->distance)) continue;
        const Vector b(1 - (u + v) / det, u / det, v / det);
        Index nearest = 0;
        b.maxCoeff(&nearest);
        first = Hit{t, c[nearest], distance, ray.from + distance * ray.along, b};
    }
    return first;
}

}  // namespace innerspring::viewer
