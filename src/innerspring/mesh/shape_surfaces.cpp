#include <algorithm>
#include <cmath>
#include <numbers>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/random.h"
#include "innerspring/mesh/shape_families.h"
#include "innerspring/mesh/shape_mesher.h"

namespace innerspring {

namespace {

constexpr double pi = std::numbers::pi;

/// A point of the plane (along the axis, distance from it).
using Profile = Eigen::Vector2d;
using Field = std::function<double(const Vector&)>;

Vector sphere_point(double u, double phi) {
    return {std::cos(pi * u), std::sin(pi * u) * std::cos(phi), std::sin(pi * u) * std::sin(phi)};
}

/// Where the ray from `origin` leaves the solid f < 0; f < 0 at the origin.
Vector ray_exit(const Field& f, const Vector& origin, const Vector& direction, double longest) {
    double inside = 0, outside = longest;
    for (int iteration = 0; iteration < 20; ++iteration) {
        const double middle = (inside + outside) / 2;
        (f(origin + middle * direction) < 0 ? inside : outside) = middle;
    }
    return origin + outside * direction;
}

/// (a + b) / 2 made smooth where they meet: max(a, b) rounded over a width of about k.
double smooth_max(double a, double b, double k) {
    return (a + b + std::sqrt((a - b) * (a - b) + k * k)) / 2;
}

double square(double x) {
    return x * x;
}

}  // namespace

SurfaceMesh ellipsoid(Index vertices, std::uint64_t seed, double a, double b, double c) {
    const Vector axes(a, b, c);
    if (axes.maxCoeff() > 20 * axes.minCoeff())
        throw InputError("shape 'ellipsoid': its longest semi-axis must be at most 20 times its shortest");
    // Pole to pole along the axis for which the rings are the nearest to circles.
    int pole = 0;
    auto flatness = [&](int axis) {
        const double p = axes[(axis + 1) % 3], q = axes[(axis + 2) % 3];
        return std::max(p, q) / std::min(p, q);
    };
    for (int axis : {1, 2})
        if (flatness(axis) < flatness(pole)) pole = axis;
    ShapeSurface s;
    s.place = [=](double u, double phi) {
        const Vector p = sphere_point(u, phi);
        Vector x;
        for (int k = 0; k < 3; ++k) x[(pole + k) % 3] = axes[(pole + k) % 3] * p[k];
        return x;
    };
    s.project = [=](Vector x) {
        for (int iteration = 0; iteration < 3; ++iteration) {
            const Vector y = x.cwiseQuotient(axes), gradient = y.cwiseQuotient(axes);
            x -= (y.squaredNorm() - 1) / (2 * gradient.squaredNorm()) * gradient;
        }
        return Vector(axes.cwiseProduct(x.cwiseQuotient(axes).normalized()));
    };
    return mesh_shape(s, vertices, seed);
}

SurfaceMesh capsule(Index vertices, std::uint64_t seed, double aspect) {
    const double half = aspect - 1;  // of the straight part, for radius 1
    auto core = [half](const Vector& x) { return Vector(std::clamp(x.x(), -half, half), 0, 0); };
    ShapeSurface s;
    s.place = [=](double u, double phi) {
        const double arc = u * (pi + 2 * half);  // length along the profile from the +x pole
        const double middle = std::clamp(arc - pi / 2, 0.0, 2 * half);
        const double angle = arc - middle;
        return Vector(half - middle + std::cos(angle), std::sin(angle) * std::cos(phi),
                      std::sin(angle) * std::sin(phi));
    };
    s.project = [=](const Vector& x) { return Vector(core(x) + (x - core(x)).normalized()); };
    return mesh_shape(s, vertices, seed);
}

SurfaceMesh torus(Index vertices, std::uint64_t seed, double ratio) {
    if (vertices < 5 * ratio - 0.5)  // fewer triangles than that cut through the tube
        throw InputError("shape 'torus': vertices must be at least 5 times ratio");
    ShapeSurface s;
    s.cyclic = true;
    s.place = [=](double u, double phi) {
        const double r = ratio + std::cos(2 * pi * u);
        return Vector(r * std::cos(phi), r * std::sin(phi), std::sin(2 * pi * u));
    };
    s.project = [=](const Vector& x) {
        const Vector core = ratio * Vector(x.x(), x.y(), 0).normalized();
        return Vector(core + (x - core).normalized());
    };
    return mesh_shape(s, vertices, seed);
}

SurfaceMesh dumbbell(Index vertices, std::uint64_t seed, double neck) {
    // Balls of radius 1 at x = -c and c, joined by a fillet: the circle round (0, neck + fillet) that touches
    // both.
    const double c = 1.4, fillet = (c * c + neck * neck - 1) / (2 * (1 - neck)), height = neck + fillet;
    const double arc = std::atan2(c, height);  // angle of the fillet from the neck to a ball
    const double ball = pi / 2 + arc;          // angle of a ball from its pole to the fillet
    const double total = 2 * (ball + fillet * arc);
    ShapeSurface s;
    s.place = [=](double u, double phi) {
        const double length = std::min(u, 1 - u) * total, side = u < 0.5 ? 1 : -1;
        Profile p;
        if (length < ball) {
            p = {c + std::cos(length), std::sin(length)};
        } else {
            const double angle = arc - (length - ball) / fillet;
            p = {fillet * std::sin(angle), height - fillet * std::cos(angle)};
        }
        return Vector(side * p.x(), p.y() * std::cos(phi), p.y() * std::sin(phi));
    };
    s.project = [=](const Vector& x) {
        const double side = x.x() < 0 ? -1 : 1, r = std::hypot(x.y(), x.z());
        Profile p(side * x.x(), r);
        if (p.x() / c + p.y() / height < 1) {
            const Profile centre(0, height);
            p = centre + fillet * (p - centre).normalized();
        } else {
            const Profile centre(c, 0);
            p = centre + (p - centre).normalized();
        }
        const double scale = r > 0 ? p.y() / r : 0;
        return Vector(side * p.x(), scale * x.y(), scale * x.z());
    };
    return mesh_shape(s, vertices, seed);
}

SurfaceMesh plate(Index vertices, std::uint64_t seed, double aspect) {
    const double flat = aspect - 1;  // radius of the flat part, for half thickness 1
    ShapeSurface s;
    s.place = [=](double u, double phi) {
        const double length = u * (2 * flat + pi);
        const double rim = std::clamp(length - flat, 0.0, pi);
        const double r = rim == 0    ? length
                         : rim == pi ? std::max(0.0, 2 * flat + pi - length)
                                     : flat + std::sin(rim);
        return Vector(r * std::cos(phi), std::cos(rim), r * std::sin(phi));
    };
    s.project = [=](const Vector& x) {
        const double r = std::hypot(x.x(), x.z());
        const double scale = r > flat ? flat / r : 1;
        const Vector core(scale * x.x(), 0, scale * x.z());
        return Vector(core + (x - core).normalized());
    };
    return mesh_shape(s, vertices, seed);
}

SurfaceMesh breast(Index vertices, std::uint64_t seed) {
    // Axis +z, chest wall z = 0, base radius about 1, gravity -y. The dome sags: its sections sink as z^2.
    const double top = 0.95, sag = 0.22, outward = 0.1, blend = 0.16;
    const Vector nipple(outward, -sag - 0.06, top);
    const double bump = 0.07, width = 0.085;
    const Field f = [=](const Vector& p) {
        const double z = p.z(), rise = square(z / top);
        const double x = p.x() - outward * rise, y = p.y() + (sag + 0.06) * rise;
        // Fuller below than above.
        const double below = y < 0 ? 0.98 : 1.06;
        const double dome = std::sqrt(square(x) + square(y / below) + rise) - 1;
        const double near = (p - nipple).squaredNorm() / square(width);
        return smooth_max(0.85 * dome - bump * std::exp(-near), -z, blend);
    };
    const Vector inside(0, -0.08, 0.35);
    ShapeSurface s;
    s.place = [=](double u, double phi) {
        const Vector d = sphere_point(u, phi);
        return ray_exit(f, inside, Vector(d.y(), d.z(), d.x()), 2.0);
    };
    s.project = implicit_projector(f);
    s.density = [=](const Vector& p) {
        return 1 + 4.5 * std::exp(-(p - nipple).squaredNorm() / square(0.38));
    };
    return mesh_shape(s, vertices, seed);
}

SurfaceMesh organ(Index vertices, std::uint64_t seed, double bumpiness) {
    // A bean: an ellipsoid with one thick and one thin lobe, its long axis bent to a circle of radius `bend`
    // about the origin, with bumps.
    const double bend = 0.85, length = 1.75, width = 0.49, depth = 0.46, taper = 0.22;
    struct Wave {
        Vector k;
        double phase;
    };
    std::vector<Wave> waves;
    Random random(seed ^ 0x6f7267616e);  // apart from the numbers that scatter the vertices
    for (int n = 0; n < 10; ++n) {
        const double z = random.uniform(-1, 1), angle = random.uniform(0, 2 * pi),
                     k = random.uniform(4.0, 6.5);
        const double r = std::sqrt(1 - z * z);
        waves.push_back({k * Vector(r * std::cos(angle), r * std::sin(angle), z), random.uniform(0, 2 * pi)});
    }
    auto bent = [=](double along, double across, double z) {
        const double angle = along / bend, r = bend + across;
        return Vector(r * std::sin(angle), r * std::cos(angle) - bend, z);
    };
    auto field = [=](double height, const Vector& p) {
        const double along = bend * std::atan2(p.x(), p.y() + bend),
                     across = std::hypot(p.x(), p.y() + bend) - bend;
        const double taper_here = 1 + taper * std::clamp(along / length, -1.2, 1.2);
        const Vector axes(length, width * taper_here, depth * taper_here);
        const Vector y = Vector(along, across, p.z()).cwiseQuotient(axes);
        // About the distance from the ellipsoid: its equation over the length of its gradient.
        const double q = y.norm(), bean = (q - 1) * q / y.cwiseQuotient(axes).norm();
        double bumps = 0;
        for (const Wave& w : waves) bumps += std::sin(w.k.dot(p) + w.phase);
        return bean + height * bumps;
    };
    ShapeSurface s;
    s.place = [=](double u, double phi) {
        const Vector d = sphere_point(u, phi);
        const double thick = 1 + taper * d.x();
        return bent(length * d.x(), width * thick * d.y(), depth * thick * d.z());
    };
    auto projector = [=](double height) {
        return implicit_projector([=](const Vector& p) { return field(height, p); });
    };
    const double bump_height = 0.016 * bumpiness;
    for (double part : {0.0, 0.25, 0.5, 0.75}) s.approach.push_back(projector(part * bump_height));
    s.project = projector(bump_height);
    return mesh_shape(s, vertices, seed);
}

}  // namespace innerspring
