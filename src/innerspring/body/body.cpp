#include "innerspring/body/body.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "innerspring/body/distribution.h"
#include "innerspring/mesh/check.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/team.h"

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

double damping(const Material& material, double m, double K) {
    return 2 * material.damping * std::sqrt(K * m);
}

std::vector<Index> vertices_around(const Body& body, Index vertex, double radius) {
    const auto& q = body.rest.positions;
    std::unordered_set<Index> seen{vertex};
    std::vector<Index> open{vertex}, found;
    while (!open.empty()) {
        const Index i = open.back();
        open.pop_back();
        if (i != vertex && (q[i] - q[vertex]).squaredNorm() >= radius * radius) continue;
        found.push_back(i);
        for (const Spoke& spoke : body.spokes_of(i))
            if (seen.insert(spoke.neighbour).second) open.push_back(spoke.neighbour);
    }
    return found;
}

void set_surface_spring(Body& body, Index e) {
    const auto& q = body.rest.positions;
    double area = 0;
    for (Index t : body.edge_triangles[e]) area += double_area_vector(q, body.rest.triangles[t]).norm() / 2;
    const double length2 = (q[body.edges[e].a] - q[body.edges[e].b]).squaredNorm();
    body.k[e] = body.material.surface * area / length2;
    body.rest_length[e] = std::sqrt(length2);
}

namespace {

/// What a SpokeRow can count.
constexpr std::size_t most_spokes = 60000;

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

/// Edges with their triangles, surface springs, and the spokes that the kernel gathers.
void add_surface_springs(Body& body, Topology topology) {
    const std::size_t n = topology.edges.size();
    body.edges = std::move(topology.edges);
    body.triangle_edges = std::move(topology.triangle_edges);
    body.edge_triangles.resize(n), body.k.resize(n), body.rest_length.resize(n);
    for (Index e = 0; e < n; ++e)
        std::copy_n(topology.edge_triangles[e].begin(), 2, body.edge_triangles[e].begin());
    Team team(body.vertices() < 8000 ? 1 : 0);  // waking others is not worth it for a few
    const auto share_out = [&](std::size_t count, auto&& work) {
        team.run(block_count(count), [&](std::size_t block) {
            for (std::size_t i = block * block_size; i < std::min(count, (block + 1) * block_size); ++i)
                work(i);
        });
    };
    share_out(n, [&](std::size_t e) { set_surface_spring(body, Index(e)); });
    body.rows.reserve(body.vertices());
    Index first = 0;
    for (std::size_t v = 0; v < body.vertices(); ++v) {
        const auto edges = topology.vertex_edges[v];
        if (edges.size() > most_spokes)
            throw InputError(fmt::format("{}: vertex {} has {} edges; at most {} are allowed", body.rest.name,
                                         v, edges.size(), most_spokes));
        body.rows.push_back({first, std::uint16_t(edges.size()), std::uint16_t(edges.size())});
        first += Index(edges.size());
    }
    body.spokes.resize(first);
    share_out(body.vertices(), [&](std::size_t v) {
        Spoke* spoke = body.spokes.data() + body.rows[v].first;
        for (Index e : topology.vertex_edges[v])
            *spoke++ = {body.k[e], body.rest_length[e], other_end(body.edges[e], Index(v)), e};
    });
}

}  // namespace

Body build_body(SurfaceMesh mesh, const Material& material, const BodyOptions& options) {
    Topology topology = require_usable(mesh);
    topology.vertex_triangles = {};
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
    body.centre.scale = d.scale;

    const double N = double(body.vertices()), M = body.material.mass, E = mean_modulus(body.material);
    for (double K : d.K) body.stiffness_sum += E * K;
    if (!std::isfinite(3 * body.stiffness_sum))
        throw InputError(fmt::format(
            "{}: young (E) of {:g} Pa: the springs' sum is beyond the numbers; check the unit and "
            "the material",
            body.rest.name, E));
    for (auto* list : {&body.m, &body.K, &body.c}) list->reserve(body.vertices());
    for (std::size_t i = 0; i < body.vertices(); ++i) {
        body.m.push_back(options.scheme == Scheme::A ? M / N : M * d.m[i]);
        body.K.push_back(options.scheme == Scheme::C ? E * d.K[i] : body.stiffness_sum / N);
        body.c.push_back(damping(body.material, body.m[i], body.K[i]));
        // Tiny bodies of extreme material may underflow: never let a zero or an infinity into a simulation.
        if (!std::isnormal(body.m[i]) || !std::isnormal(body.K[i]) || !std::isfinite(body.c[i]))
            throw InputError(
                fmt::format("{}: vertex {} would get mass {:g} kg and stiffness {:g} N/m; check the unit and "
                            "the material",
                            body.rest.name, i, body.m[i], body.K[i]));
    }
    body.L = std::move(d.L);
    d = {};  // room for the springs
    add_surface_springs(body, std::move(topology));
    require_directions(body, body.material);
    set_deviations(body);
    for (std::size_t e = 0; e < body.k.size(); ++e)
        if (!std::isfinite(body.k[e]) || !(body.rest_length[e] > 0))
            throw InputError(fmt::format(
                "{}: edge {}-{} would get a surface spring of {:g} N/m over {:g} m; check the "
                "unit and the material",
                body.rest.name, body.edges[e].a, body.edges[e].b, body.k[e], body.rest_length[e]));
    return body;
}

}  // namespace innerspring
