#include "innerspring/body/estimate.h"

#include <fmt/format.h>

#include <memory>

#include "commands.h"
#include "innerspring/mesh/write.h"
#include "innerspring/record/json.h"
#include "innerspring/record/vtk.h"
#include "innerspring/sim/stability.h"
#include "options.h"

using namespace innerspring;

namespace {

struct Arguments {
    MeshOptions mesh;
    BodyArguments body;
    OutputOptions output;
    std::string csv, vtp;
};

void print_quartiles(std::string_view label, const Quartiles& q) {
    fmt::print("  {:<24} {:>11.4g} {:>11.4g} {:>11.4g} {:>11.4g} {:>11.4g}\n", label, q.min, q.lower,
               q.median, q.upper, q.max);
}

void print(const EstimateReport& r) {
    const Estimate& e = r.estimate;
    fmt::print("{}: {} vertices, {} triangles, scheme {}\n", r.subject.mesh_name, r.subject.vertices,
               r.subject.triangles, to_string(r.subject.scheme));
    print_row("centre", fmt::format("{} at ({:.4g}, {:.4g}, {:.4g}) m: {}", to_string(r.subject.centre.kind),
                                    r.subject.centre.position.x(), r.subject.centre.position.y(),
                                    r.subject.centre.position.z(), r.subject.centre.reason));
    print_row("volume, radius R",
              fmt::format("{:.6g} m^3, {:.6g} m", r.subject.volume_m3, volume_radius(r.subject.volume_m3)));
    print_row("material", fmt::format("{}: M {:.4g} kg, E {:.4g} Pa, E_s {:.4g} N/m, zeta {:.3g}, nu {:g}",
                                      r.subject.material_name, r.subject.material.mass,
                                      r.subject.material.young, r.subject.material.surface,
                                      r.subject.material.damping, r.subject.material.poisson));
    if (!isotropic(r.subject.material)) {
        const Vector D = moduli(r.subject.material);
        print_row("anisotropy", fmt::format("{}: {:.4g}, {:.4g}, {:.4g} Pa; below E is their mean, {:.4g} Pa",
                                            to_string(r.subject.material.anisotropy.kind), D[0], D[1], D[2],
                                            mean_modulus(r.subject.material)));
    }
    print_row("M g/(E R^2), E_s/(E R)",
              fmt::format("{:.4g}, {:.4g}", r.subject.groups.weight, r.subject.groups.surface));
    fmt::print("\n  {:<24} {:>11} {:>11} {:>11} {:>11} {:>11}\n", "", "min", "lower", "median", "upper",
               "max");
    print_quartiles("m_i [kg]", e.m);
    print_quartiles("K_i [N/m]", e.K);
    print_quartiles("k_e [N/m]", e.k);
    print_quartiles("L_i [m]", e.L);
    fmt::print("\n");
    print_row("sum of m_i", fmt::format("{:.12g} kg (M = {:.12g} kg)", e.mass_sum, r.subject.material.mass));
    print_row("sum of K_i", fmt::format("{:.6g} N/m (theory, sum of E A_i/L_i: {:.6g} N/m)", e.stiffness_sum,
                                        e.stiffness_theory));
    print_row("centre of mass shift", fmt::format("{:.3g} m from the volume centroid", e.mass_shift.norm()));
    print_row("sag under 9.81 m/s^2", fmt::format("{:.4g} m (M g R^2/(3 V E))", e.sag));
    print_row("largest stable step", fmt::format("{:.4g} s, explicit", r.largest_stable_step_s));
}

int run(const Arguments& a) {
    Scene scene;
    scene.mesh = a.mesh.mesh;
    apply(a.mesh, scene);
    apply(a.body, scene);
    Setup setup = set_up(scene);
    const Body& body = setup.body;
    print_notes(setup.notes, a.output.quiet);

    const EstimateReport report{describe(scene, setup), estimate(body), largest_stable_step(body),
                                setup.notes};
    std::vector<Vector> fibres;
    for (Index i = 0; i < body.N.size(); ++i) fibres.push_back(fibre_direction(body, i));
    if (!a.csv.empty()) {
        std::string text = fmt::format("vertex,x_m,y_m,z_m,L_m,m_kg,K_n_m,c_n_s_m{}\n",
                                       fibres.empty() ? "" : ",fibre_x,fibre_y,fibre_z");
        for (std::size_t i = 0; i < body.vertices(); ++i) {
            const Vector& q = body.rest.positions[i];
            text += fmt::format("{},{},{},{},{},{},{},{}", i, q.x(), q.y(), q.z(), body.L[i], body.m[i],
                                body.K[i], body.c[i]);
            if (!fibres.empty())
                text += fmt::format(",{},{},{}", fibres[i].x(), fibres[i].y(), fibres[i].z());
            text += '\n';
        }
        write_whole(a.csv, text);
    }
    if (!a.vtp.empty()) {
        std::vector<VertexField> fields = {{"m_kg", std::span<const double>(body.m)},
                                           {"K_n_m", std::span<const double>(body.K)},
                                           {"L_m", std::span<const double>(body.L)}};
        if (!fibres.empty()) fields.push_back({"fibre", std::span<const Vector>(fibres)});
        write_whole(a.vtp, to_vtp(body.rest.positions, body.rest.triangles, fields));
    }
    if (a.output.json)
        fmt::print("{}", to_json(report));
    else
        print(report);
    return 0;
}

}  // namespace

Command add_estimate(CLI::App& program) {
    CLI::App* app =
        program.add_subcommand("estimate", "Masses and springs of a surface, without simulating it");
    auto a = std::make_shared<Arguments>();
    add_mesh_options(*app, a->mesh, "surface to estimate");
    add_body_options(*app, a->body);
    app->add_option("--csv", a->csv, "write one line per vertex")->type_name("FILE");
    app->add_option("--vtp", a->vtp, "write the surface with m, K and L per vertex for ParaView")
        ->type_name("FILE");
    add_output_options(*app, a->output);
    return {app, [a] { return run(*a); }};
}
