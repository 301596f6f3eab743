#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "innerspring/body/body.h"
#include "innerspring/mesh/random.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/sim/forces.h"
#include "innerspring/sim/measure.h"
#include "innerspring/sim/step.h"

// Small bodies and measures that the tests share.
namespace innerspring::support {

inline constexpr double pi = std::numbers::pi;

/// Triangulations of the sphere of radius 1 m about the origin, from regular to very uneven.
inline const std::array<std::string, 3> spheres{"icosphere:vertices=642",
                                                "sphere:vertices=1000,irregularity=3,seed=1",
                                                "sphere:vertices=600,irregularity=5,seed=2"};

/// The exact centre of the spheres.
inline CentreOption origin() {
    return {CentreKind::given, Vector::Zero()};
}

struct BodyRecipe {
    Scheme scheme = Scheme::C;
    double young = 10;   ///< [Pa]
    double surface = 1;  ///< [N/m]
    double damping = 1;  ///< [1]
    bool free = false;
    double mass = 0.05;  ///< [kg]
    CentreOption centre{};
    double poisson = 0;  ///< [1]
    Anisotropy anisotropy{};
};

inline Body make_body(SurfaceMesh mesh, const BodyRecipe& r = {}) {
    Material material;
    material.mass = r.mass;
    material.young = r.young;
    material.surface = r.surface;
    material.damping = r.damping;
    material.poisson = r.poisson;
    material.anisotropy = r.anisotropy;
    BodyOptions options;
    options.scheme = r.scheme;
    options.centre = r.centre;
    options.free = r.free;
    return build_body(std::move(mesh), material, options);
}
inline Body make_body(std::string_view shape, const BodyRecipe& r = {}) {
    return make_body(make_shape(shape), r);
}

/// The same about the origin exactly.
inline Body make_sphere(std::string_view shape, BodyRecipe r = {}) {
    r.centre = origin();
    return make_body(shape, r);
}

inline Vector random_vector(Random& random) {
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1), z = random.uniform(-1, 1);
    return {x, y, z};
}

inline Eigen::Matrix3d random_rotation(Random& random) {
    return Eigen::AngleAxisd(random.uniform(0.5, 2.5), random_vector(random).normalized()).toRotationMatrix();
}

/// Every vertex displaced by up to `size` [m] and moving at up to `speed` [m/s], each component by itself.
inline State random_state(const Body& body, std::uint64_t seed, double size, double speed = 0) {
    Random random(seed);
    State state = rest_state(body);
    for (Vector& x : state.x) x += size * random_vector(random);
    for (Vector& v : state.v) v = speed * random_vector(random);
    return state;
}

inline Loads no_loads() {
    return {Vector::Zero(), {}, {}};
}
inline Loads gravity_only(const Vector& g = {0, -9.81, 0}) {
    return {g, {}, {}};
}
inline Loads one_force(Force force) {
    return {Vector::Zero(), {std::move(force)}, {}};
}

inline double sum(const std::vector<double>& values) {
    double total = 0;
    for (double value : values) total += value;
    return total;
}

inline double relative_volume_change(const Body& body, const State& state) {
    return volume(state.x, body.rest.triangles) / body.volume - 1;
}

inline Vector linear_momentum(const Body& body, const State& state) {
    Vector p = Vector::Zero();
    for (std::size_t i = 0; i < body.vertices(); ++i) p += body.m[i] * state.v[i];
    return p;
}

inline Vector angular_momentum(const Body& body, const State& state) {
    Vector l = Vector::Zero();
    for (std::size_t i = 0; i < body.vertices(); ++i) l += body.m[i] * state.x[i].cross(state.v[i]);
    return l;
}

/// Kinetic plus elastic energy [J].
inline double internal_energy(const Body& body, const State& state) {
    const Measures now = measure(body, no_loads(), state);
    return now.kinetic + now.elastic;
}

/// The vertex with the largest (coarsest place) or smallest (densest place) area.
inline Index coarsest_vertex(const Body& body) {
    const auto A = vertex_areas(body.rest.positions, body.rest.triangles);
    return Index(std::max_element(A.begin(), A.end()) - A.begin());
}
inline Index densest_vertex(const Body& body) {
    const auto A = vertex_areas(body.rest.positions, body.rest.triangles);
    return Index(std::min_element(A.begin(), A.end()) - A.begin());
}

inline Topology topology_of(const Body& body) {
    return build_topology(body.vertices(), body.rest.triangles);
}

/// Largest distance between two states' positions [m].
inline double distance(const State& a, const State& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.x.size(); ++i) largest = std::max(largest, (a.x[i] - b.x[i]).norm());
    return largest;
}

/// An axis-aligned box [-a,a] x [-b,b] x [-c,c], `size` = (2a, 2b, 2c), whose faces are grids of about
/// `spacing`.
inline SurfaceMesh box(const Vector& size, double spacing) {
    SurfaceMesh mesh;
    mesh.name = "box";
    std::array<int, 3> n;
    for (int axis = 0; axis < 3; ++axis) n[axis] = std::max(1, int(std::lround(size[axis] / spacing)));
    // Grid points that lie on the surface, numbered as they are first asked for.
    std::vector<Index> number(std::size_t(n[0] + 1) * std::size_t(n[1] + 1) * std::size_t(n[2] + 1),
                              no_index);
    auto vertex = [&](const std::array<int, 3>& at) {
        Index& index = number[std::size_t((at[0] * (n[1] + 1) + at[1]) * (n[2] + 1) + at[2])];
        if (index == no_index) {
            index = Index(mesh.positions.size());
            Vector p;
            for (int axis = 0; axis < 3; ++axis) p[axis] = size[axis] * (double(at[axis]) / n[axis] - 0.5);
            mesh.positions.push_back(p);
        }
        return index;
    };
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (int side : {0, 1})
            for (int i = 0; i < n[u]; ++i)
                for (int j = 0; j < n[v]; ++j) {
                    auto corner = [&](int di, int dj) {
                        std::array<int, 3> at{};
                        at[axis] = side * n[axis];
                        at[u] = i + di;
                        at[v] = j + dj;
                        return vertex(at);
                    };
                    const Index a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
                    if (side == 1) {
                        mesh.triangles.push_back({a, b, c});
                        mesh.triangles.push_back({a, c, d});
                    } else {
                        mesh.triangles.push_back({a, c, b});
                        mesh.triangles.push_back({a, d, c});
                    }
                }
    }
    return mesh;
}

/// A ball with a long tail towards +x: star-shaped about the origin, but its volume centroid lies in the
/// tail, which the ball's flanks do not see.
inline SurfaceMesh comet() {
    SurfaceMesh mesh = make_shape("icosphere:vertices=2562");
    mesh.name = "comet";
    for (Vector& p : mesh.positions) p *= 0.5 + 6 * std::exp(-12 * (1 - p.x()));
    return mesh;
}

inline SurfaceMesh moved(SurfaceMesh mesh, const Eigen::Matrix3d& rotation, double scale,
                         const Vector& shift) {
    for (Vector& p : mesh.positions) p = scale * (rotation * p) + shift;
    return mesh;
}

}  // namespace innerspring::support
