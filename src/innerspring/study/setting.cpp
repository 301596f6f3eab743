#include "innerspring/study/setting.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/geometry.h"
#include "innerspring/record/setup.h"
#include "innerspring/record/state_file.h"

namespace innerspring {

std::string_view to_string(LoadKind load) {
    return load == LoadKind::patch ? "patch" : "point";
}

std::string_view to_string(DensityClass density) {
    return density == DensityClass::sampled    ? "sampled"
           : density == DensityClass::coarsest ? "coarsest"
                                               : "densest";
}

double Setting::force_n(double group) const {
    return group * body().material.young * body().radius * body().radius;
}

const std::vector<Index>& Setting::vertices(DensityClass density) const {
    return density == DensityClass::sampled    ? sampled
           : density == DensityClass::coarsest ? coarsest
                                               : densest;
}

std::vector<Index> spread_vertices(const SurfaceMesh& mesh, std::span<const Index> among, std::size_t count) {
    const Vector mean = vertex_mean(mesh.positions);
    std::vector<double> distance2;
    for (const Index i : among) distance2.push_back((mesh.positions[i] - mean).squaredNorm());
    std::vector<Index> spread;
    while (spread.size() < std::min(count, among.size())) {
        const auto farthest =
            std::size_t(std::max_element(distance2.begin(), distance2.end()) - distance2.begin());
        const Vector& chosen = mesh.positions[among[farthest]];
        const bool first = spread.empty();
        spread.push_back(among[farthest]);
        for (std::size_t n = 0; n < among.size(); ++n) {
            const double d2 = (mesh.positions[among[n]] - chosen).squaredNorm();
            distance2[n] = first ? d2 : std::min(distance2[n], d2);
        }
    }
    return spread;
}

std::vector<double> log_spaced_groups(int count) {
    std::vector<double> exponents;
    for (int n = 0; n < count; ++n) exponents.push_back(-4 + 3.0 * n / (count - 1));
    for (const double decade : {-3.0, -2.0})
        *std::min_element(exponents.begin(), exponents.end(), [decade](double a, double b) {
            return std::abs(a - decade) < std::abs(b - decade);
        }) = decade;
    // Three digits: the forces of a study are numbers one can quote. The decades are met exactly.
    std::vector<double> groups;
    for (const double e : exponents) groups.push_back(std::stod(fmt::format("{:.2e}", std::pow(10, e))));
    return groups;
}

namespace {

void require_valid(const StudyOptions& o) {
    const auto check = [](std::string_view option, double value, double low, double high) {
        if (!(value >= low && value <= high))
            throw InputError(
                fmt::format("{} is {:g}; it must be from {:g} to {:g}", option, value, low, high));
    };
    check("the number of vertices", o.vertices, 2, 1000);
    check("the number of forces", o.forces, 4, 100);
    check("the number of levels", o.levels, 1, 4);
    check("the radius of influence, as a share of R,", o.influence_share, 0.01, 2);
    check("the radius of the refined region, as a share of R,", o.region_share, o.influence_share, 4);
    if (o.poisson.empty()) throw InputError("Poisson's ratio: none is given");
    for (std::size_t n = 0; n < o.poisson.size(); ++n) {
        check("Poisson's ratio", o.poisson[n], 0, 0.5);
        if (n > 0 && !(o.poisson[n] > o.poisson[n - 1]))
            throw InputError("Poisson's ratios must be given in increasing order, each once");
    }
}

bool is_sphere(const Body& body) {
    const Vector centre = volume_centroid(body.rest.positions, body.rest.triangles);
    double least = INFINITY, largest = 0;
    for (const Vector& q : body.rest.positions) {
        least = std::min(least, (q - centre).norm());
        largest = std::max(largest, (q - centre).norm());
    }
    return largest < 1.02 * least;
}

}  // namespace

Setting set_up_study(const Scene& scene, const StudyOptions& options) {
    require_valid(options);
    Setting s;
    s.options = options;
    s.material_name = scene.material_name;
    s.gravity = scene.gravity;
    LoadedMesh loaded = load_mesh(scene.mesh, scene.unit, scene.normalize, scene.weld);
    s.notes = std::move(loaded.notes);
    for (const Scheme scheme : schemes)
        s.bodies[std::size_t(scheme)] = std::make_shared<const Body>(
            build_body(loaded.mesh, scene.material, {scheme, scene.centre, false}));

    const SurfaceMesh& mesh = s.body().rest;
    std::vector<Index> all(mesh.positions.size());
    std::iota(all.begin(), all.end(), Index(0));
    s.sampled = spread_vertices(mesh, all, std::size_t(options.vertices));
    const std::vector<double> A = vertex_areas(mesh.positions, mesh.triangles);
    std::stable_sort(all.begin(), all.end(), [&](Index a, Index b) { return A[a] < A[b]; });
    const std::size_t tenth = std::max<std::size_t>(1, all.size() / 10);
    const std::size_t of_tenth = std::size_t(std::max(2, options.vertices / 2));
    s.densest = spread_vertices(mesh, std::span(all).first(tenth), of_tenth);
    s.coarsest = spread_vertices(mesh, std::span(all).last(tenth), of_tenth);
    s.inward = vertex_normals(mesh.positions, mesh.triangles);
    for (Vector& n : s.inward) n = -n;

    s.force_groups = log_spaced_groups(options.forces);
    s.influence_m = options.influence_share * s.body().radius;
    s.region_m = options.region_share * s.body().radius;
    s.sphere = is_sphere(s.body());
    for (const Index vertex : s.sampled) {
        try {
            refined(s.body(), region_of(s, vertex), options.levels);
            s.refinable.push_back(vertex);
        } catch (const InputError& error) {
            s.refused.push_back({vertex, error.what()});
        }
    }
    const std::array<const Body*, 3> bodies = {s.bodies[0].get(), s.bodies[1].get(), s.bodies[2].get()};
    s.sampling = sampling_until_rest(bodies);
    return s;
}

std::uint64_t setting_hash(const Setting& s) {
    const Material& m = s.body().material;
    const StudyOptions& o = s.options;
    const Vector& c = s.body().centre.position;
    std::string text = fmt::format("{} {} {} {} {} {} {}\n", m.mass, m.young, m.surface, m.damping,
                                   to_string(s.body().centre.kind), s.sampling.dt_s, s.sampling.samples);
    text +=
        fmt::format("{} {} {} {} {}\n", o.vertices, o.forces, o.levels, o.influence_share, o.region_share);
    text +=
        fmt::format("{} {} {} {} {} {}\n", c.x(), c.y(), c.z(), s.gravity.x(), s.gravity.y(), s.gravity.z());
    for (const Vector& q : s.body().rest.positions) text += fmt::format("{} {} {}\n", q.x(), q.y(), q.z());
    for (const Triangle& t : s.body().rest.triangles) text += fmt::format("{} {} {}\n", t[0], t[1], t[2]);
    return text_hash(text);
}

std::vector<Index> region_of(const Setting& s, Index vertex) {
    return triangles_near(s.body().rest, s.body().rest.positions[vertex], s.region_m);
}

Loads study_load(const Setting& s, const Body& body, LoadKind load, Index vertex, double force_n) {
    const Vector newton = force_n * s.inward[vertex];
    Force force = load == LoadKind::patch ? patch_force(body, vertex, s.influence_m, newton)
                                          : point_force(vertex, newton);
    return {Vector::Zero(), {std::move(force)}, {}};
}

std::string case_key(LoadKind load, std::string_view scheme, int levels, Index vertex, double group) {
    return fmt::format("{} {} {} {} {}", to_string(load), scheme, levels, vertex, group);
}

Job coarse_job(const Setting& s, Scheme scheme, Index vertex) {
    Job job{[&s, scheme] { return s.bodies[std::size_t(scheme)]; }, double(s.body().vertices()), {}};
    for (const LoadKind load : load_kinds)
        for (const double group : s.force_groups)
            job.cases.push_back({case_key(load, to_string(scheme), 0, vertex, group),
                                 [&s, load, vertex, group](const Body& body) {
                                     return study_load(s, body, load, vertex, s.force_n(group));
                                 },
                                 vertex});
    return job;
}

}  // namespace innerspring
