#include "innerspring/study/truth_models.h"

#include <fmt/format.h>

#include "innerspring/sim/equilibrium.h"

namespace innerspring {

namespace {

/// The body of a subject in equilibrium with the load.
TruthAnswer body_answer(const TruthSubject& subject, const TruthLoad& load, const Material& material,
                        BodyOptions options) {
    options.centre = subject.centre;
    const Body body = build_body(subject.mesh, material, options);
    Loads loads{load.gravity, {}, {}};
    const std::vector<Vector> f = nodal_forces(subject, load);
    for (Index i = 0; i < f.size(); ++i)
        if (f[i] != Vector::Zero()) loads.forces.push_back(point_force(i, f[i]));
    if (!subject.held.empty()) loads.pins.push_back({subject.held, {}});
    State state = rest_state(body);
    EquilibriumOptions closely;
    closely.tolerance_n = 1e-7 * load_sum(body, loads, 0);
    const EquilibriumReport report = solve_equilibrium(body, loads, state, closely);
    TruthAnswer answer{std::move(state.x)};
    for (std::size_t i = 0; i < answer.u.size(); ++i) answer.u[i] -= body.rest.positions[i];
    if (!report.reached)
        answer.note = report.residual_n <= report.tolerance_n
                          ? std::string("the volume did not settle to 1e-10 of it")
                          : fmt::format("no equilibrium: {:.2g} N left on a vertex, {:.2g} asked for",
                                        report.residual_n, report.tolerance_n);
    return answer;
}

Material radial(Material material) {
    material.anisotropy.kind = Anisotropy::Kind::radial;
    return material;
}

Material with_volume(const TruthSubject& s) {
    Material material = s.material;
    material.poisson = s.poisson;
    return material;
}

}  // namespace

std::vector<TruthModel> truth_models() {
    // A variant of the material or of the body is one more line: set what differs and ask body_answer(). What
    // knows Poisson's ratio takes s.poisson, the reference's.
    return {
        {"C", "scheme C as published: Eqs. 1-3 and surface springs",
         [](const TruthSubject& s, const TruthLoad& l) { return body_answer(s, l, s.material, {}); }},
        {"C bare", "Eqs. 1-3 alone: scheme C with E_s = 0",
         [](const TruthSubject& s, const TruthLoad& l) {
             Material bare = s.material;
             bare.surface = 0;
             return body_answer(s, l, bare, {});
         }},
        {"C free", "scheme C whose homes follow the body (a free body)",
         [](const TruthSubject& s, const TruthLoad& l) {
             return body_answer(s, l, s.material, {Scheme::C, {}, true});
         },
         true},
        {"C volume", "scheme C with the volume term at the reference's Poisson's ratio",
         [](const TruthSubject& s, const TruthLoad& l) { return body_answer(s, l, with_volume(s), {}); }},
        {"C radial", "scheme C, the inner springs E towards the centre and E/2 across",
         [](const TruthSubject& s, const TruthLoad& l) { return body_answer(s, l, radial(s.material), {}); }},
        {"C radial volume",
         "the same with the volume term, and across E/(2(1+nu)) of the reference's Poisson's ratio",
         [](const TruthSubject& s, const TruthLoad& l) {
             return body_answer(s, l, radial(with_volume(s)), {});
         }},
        {"C bare volume", "the volume term with E_s = 0",
         [](const TruthSubject& s, const TruthLoad& l) {
             Material bare = with_volume(s);
             bare.surface = 0;
             return body_answer(s, l, bare, {});
         }},
        {"C free volume", "C free with the volume term",
         [](const TruthSubject& s, const TruthLoad& l) {
             return body_answer(s, l, with_volume(s), {Scheme::C, {}, true});
         },
         true},
    };
}

std::vector<Vector> nodal_forces(const TruthSubject& subject, const TruthLoad& load) {
    std::vector<Vector> f(subject.mesh.positions.size(), Vector::Zero());
    for (const SurfaceForce& s : load.surface)
        for (int k = 0; k < 3; ++k)
            f[subject.mesh.triangles[s.triangle][std::size_t(k)]] += s.at[k] * s.force;
    return f;
}

namespace {

ElasticSolid solid_of(const TruthSubject& s) {
    QuadraticMesh mesh = quadratic(fill_with_tetrahedra(s.mesh, s.filling));
    std::vector<bool> held = held_nodes(mesh, s.held);
    return ElasticSolid(std::move(mesh), {s.material.young, s.poisson}, std::move(held));
}

}  // namespace

ElementReference::ElementReference(const TruthSubject& s) : solid_(solid_of(s)) {}

std::vector<Vector> ElementReference::answer(const TruthSubject& s, const TruthLoad& load) const {
    std::vector<Vector> f(nodes(), Vector::Zero());
    add_body_force(solid_.mesh(), s.material.mass / s.volume * load.gravity, f);
    add_surface_forces(solid_.mesh(), s.mesh.triangles, load.surface, f);
    std::vector<Vector> u = solid_.solve(std::move(f));
    u.resize(s.mesh.positions.size());
    // What nothing holds has a place only up to a rigid motion.
    if (s.held.empty())
        remove_rigid_motion(s.mesh.positions, vertex_areas(s.mesh.positions, s.mesh.triangles), u);
    return u;
}

}  // namespace innerspring
