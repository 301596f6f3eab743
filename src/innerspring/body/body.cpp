#include "innerspring/body/body.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/body/distribution.h"
#include "innerspring/mesh/check.h"
#include "innerspring/mesh/error.h"

namespace innerspring {

std::string_view to_string(Scheme scheme) {
    return scheme == Scheme::A ? "A" : scheme == Scheme::B ? "B" : "C";
}

Scheme parse_scheme(std::string_view text) {
    if (text == "A" || text == "a") return Scheme::A;
    if (text == "B" || text == "b") return Scheme::B;
    if (text == "C" || text == "c") return Scheme::C;
    throw InputError(fmt::format("scheme '{}': expected A, B or C", text));
}

namespace {

/// A centre is taken by itself only if every vertex keeps this share of a full-height spring and mass.
constexpr double positive_margin = 0.05;

std::string coordinates(const Vector& p) {
    return fmt::format("({:.4g}, {:.4g}, {:.4g})", p.x(), p.y(), p.z());
}

void require_positive(const SurfaceMesh& mesh, const Distribution& d, std::string_view centre) {
    const LeastPositive least = least_positive(mesh, d);
    if (least.count == 0 && least.value > 0) return;
    throw InputError(
        fmt::format("{}: about the {} centre, {} of {} vertices get a mass or stiffness that is not positive "
                    "(the worst is vertex {} at {}); "
                    "use --centre local or auto",
                    mesh.name, centre, std::max<std::size_t>(least.count, 1), mesh.positions.size(),
                    least.vertex, coordinates(mesh.positions[least.vertex])));
}

/// docs/physics.md, section 2.
Distribution choose_centre(const SurfaceMesh& mesh, double radius, const CentreOption& option,
                           Centre& centre) {
    const Vector centroid = volume_centroid(mesh.positions, mesh.triangles);
    centre = {option.kind, centroid, ""};
    switch (option.kind) {
        case CentreKind::centroid:
        case CentreKind::given: {
            if (option.kind == CentreKind::given) centre.position = option.position;
            centre.reason = "asked for";
            Distribution d = distribute_about(mesh, centre.position);
            require_positive(mesh, d, to_string(option.kind));
            return d;
        }
        case CentreKind::kernel: {
            const auto point = kernel_point(mesh, centroid, 1e-6 * radius);
            if (!point)
                throw InputError(
                    fmt::format("{}: not star-shaped, so there is no kernel to put the centre in; use "
                                "--centre local or auto",
                                mesh.name));
            centre.position = *point;
            centre.reason = "asked for";
            Distribution d = distribute_about(mesh, *point);
            require_positive(mesh, d, "kernel");
            return d;
        }
        case CentreKind::local:
            centre.reason = "asked for";
            return distribute_locally(mesh);
        case CentreKind::automatic:
            break;
    }

    Distribution d = distribute_about(mesh, centroid);
    const LeastPositive about_centroid = least_positive(mesh, d);
    if (about_centroid.value >= positive_margin) {
        centre.kind = CentreKind::centroid;
        centre.reason = fmt::format(
            "every mass and stiffness about the centroid is positive (least {:.2f} of full height)",
            about_centroid.value);
        return d;
    }
    const std::string why = fmt::format(
        "about the centroid {} of {} vertices are not positive by a margin of {} (least {:.2f}, vertex {})",
        about_centroid.count, mesh.positions.size(), positive_margin, about_centroid.value,
        about_centroid.vertex);
    // The nearest point lies on the kernel's border; deeper ones are farther from the centroid but give
    // fuller springs.
    for (double depth : {0.02, 0.05, 0.1, 0.2}) {
        const auto point = kernel_point(mesh, centroid, depth * radius);
        if (!point) break;
        d = distribute_about(mesh, *point);
        if (least_positive(mesh, d).value >= positive_margin) {
            centre = {CentreKind::kernel, *point,
                      fmt::format("{}; a point of the kernel {:.3g} m away serves all", why,
                                  (*point - centroid).norm())};
            return d;
        }
    }
    centre.kind = CentreKind::local;
    centre.reason = why + "; no kernel point serves all";
    return distribute_locally(mesh);
}

/// k_e = E_s sum_{t at e} A_t / |e|^2 (Van Gelder 1998), and the spokes that the kernel gathers.
void add_surface_springs(Body& body) {
    const auto& x = body.rest.positions;
    const std::vector<double> A = triangle_areas(x, body.rest.triangles);
    const auto& edges = body.topology.edges;
    for (std::size_t e = 0; e < edges.size(); ++e) {
        double area = 0;
        for (Index t : body.topology.edge_triangles[e]) area += A[t];
        const double length2 = (x[edges[e].a] - x[edges[e].b]).squaredNorm();
        body.k.push_back(body.material.surface * area / length2);
        body.rest_length.push_back(std::sqrt(length2));
    }
    body.spoke_start.push_back(0);
    for (std::size_t v = 0; v < body.vertices(); ++v) {
        for (Index e : body.topology.vertex_edges[v])
            body.spokes.push_back({body.k[e], body.rest_length[e], other_end(edges[e], Index(v)), e});
        body.spoke_start.push_back(Index(body.spokes.size()));
    }
}

}  // namespace

Body build_body(SurfaceMesh mesh, const Material& material, const BodyOptions& options) {
    require_usable(mesh);
    Body body;
    body.volume = volume(mesh);
    body.radius = volume_radius(body.volume);
    // Beyond this, squares of areas leave the range of the numbers.
    if (!(body.radius > 1e-30 && body.radius < 1e30))
        throw InputError(fmt::format("{}: its volume is that of a ball of {:g} m; check the unit", mesh.name,
                                     body.radius));
    body.material = resolve(material, body.volume);
    body.scheme = options.scheme;
    body.free = options.free;

    Distribution d = choose_centre(mesh, body.radius, options.centre, body.centre);
    body.rest = std::move(mesh);
    body.topology = build_topology(body.vertices(), body.rest.triangles);

    const double N = double(body.vertices()), M = body.material.mass, E = body.material.young;
    double K_mean = 0;
    for (double K : d.K) K_mean += E * K / N;
    for (std::size_t i = 0; i < body.vertices(); ++i) {
        body.m.push_back(options.scheme == Scheme::A ? M / N : M * d.m[i]);
        body.K.push_back(options.scheme == Scheme::C ? E * d.K[i] : K_mean);
        body.c.push_back(2 * body.material.damping * std::sqrt(body.K[i] * body.m[i]));
        // Tiny bodies of extreme material may underflow: never let a zero or an infinity into a simulation.
        if (!std::isnormal(body.m[i]) || !std::isnormal(body.K[i]) || !std::isfinite(body.c[i]))
            throw InputError(
                fmt::format("{}: vertex {} would get mass {:g} kg and stiffness {:g} N/m; check the unit and "
                            "the material",
                            body.rest.name, i, body.m[i], body.K[i]));
    }
    body.L = std::move(d.L);
    add_surface_springs(body);
    for (std::size_t e = 0; e < body.k.size(); ++e)
        if (!std::isfinite(body.k[e]) || !(body.rest_length[e] > 0))
            throw InputError(
                fmt::format("{}: edge {}-{} would get a surface spring of {:g} N/m over {:g} m; check the "
                            "unit and the material",
                            body.rest.name, body.topology.edges[e].a, body.topology.edges[e].b, body.k[e],
                            body.rest_length[e]));
    return body;
}

}  // namespace innerspring
