#include "innerspring/study/gravity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/error.h"

namespace innerspring {

std::vector<NamedCentre> gravity_centres(const Setting& s) {
    const Body& body = s.body();
    const Vector centroid = volume_centroid(body.rest.positions, body.rest.triangles),
                 down = s.gravity.normalized();
    const auto at = [&](std::string name, const Vector& c) {
        return NamedCentre{std::move(name), {CentreKind::given, c}, (c - centroid).dot(down) / body.radius};
    };
    std::vector<NamedCentre> centres;
    if (body.centre.kind == CentreKind::local)
        centres.push_back({"local", {CentreKind::local, Vector::Zero()}, std::nan("")});
    else if (body.centre.kind != CentreKind::centroid)
        centres.push_back(at(std::string(to_string(body.centre.kind)), body.centre.position));
    centres.push_back({"centroid", {CentreKind::centroid, Vector::Zero()}, 0});
    centres.push_back(at("vertex_mean", vertex_mean(body.rest.positions)));
    for (const int percent : {1, 2, 4, 8})
        centres.push_back(
            at(fmt::format("off_{}_percent", percent), centroid + percent / 100.0 * body.radius * down));
    return centres;
}

namespace {

std::string gravity_key(Scheme scheme, const NamedCentre& centre) {
    return fmt::format("gravity {} {}", to_string(scheme), centre.name);
}

Body body_about(const Setting& s, Scheme scheme, const NamedCentre& centre) {
    return build_body(s.body().rest, s.body().material, {scheme, centre.option, false});
}

}  // namespace

std::vector<Job> gravity_jobs(const Setting& s, std::vector<RefusedCentre>& refused) {
    std::vector<Job> jobs;
    for (const NamedCentre& centre : gravity_centres(s)) {
        try {
            body_about(s, Scheme::C, centre);
        } catch (const InputError& error) {
            refused.push_back({centre.name, error.what()});
            continue;
        }
        for (const Scheme scheme : schemes)
            jobs.push_back(
                {[&s, scheme, centre] { return std::make_shared<const Body>(body_about(s, scheme, centre)); },
                 double(s.body().vertices()),
                 {{gravity_key(scheme, centre), [&s](const Body&) {
                       return Loads{s.gravity, {}, {}};
                   }}}});
    }
    return jobs;
}

GravityStudy gravity_study(const Setting& s, const Responses& responses, std::vector<RefusedCentre> refused) {
    const Body& body = s.body();
    GravityStudy study{{}, std::move(refused)};
    // A closed surface of modulus E_s resists a change of volume as 3 E_s/R more of E does.
    const double stiffness = body.material.young + 3 * body.material.surface / body.radius;
    for (const NamedCentre& centre : gravity_centres(s))
        for (const Scheme scheme : schemes) {
            const auto found = responses.find(gravity_key(scheme, centre));
            if (found == responses.end()) continue;  // refused
            const Response& r = found->second;
            const double law = -100 * 2 * body.material.mass * s.gravity.norm() /
                               (3 * body.volume * stiffness) * centre.offset_share * body.radius;
            study.rows.push_back({scheme, centre.name, centre.offset_share,
                                  volume_variation(r.volume_percent), r.std_m, law, r.volume_percent});
        }
    return study;
}

Image gravity_picture(const Setting& s, const Painter& paint) {
    const Loads loads{s.gravity, {}, {}};
    std::vector<std::vector<double>> displacement;
    std::vector<State> states;
    double high = 0;
    for (const Scheme scheme : {Scheme::B, Scheme::C}) {
        const Body& body = s.body(scheme);
        StepOptions step;
        step.dt = s.sampling.dt_s;
        step.integrator = Integrator::symplectic;
        step.precision = Precision::full;
        Workspace workspace(body, step);
        respond(body, loads, no_index, s.sampling, workspace, states.emplace_back());
        std::vector<double>& u = displacement.emplace_back();
        for (std::size_t i = 0; i < body.vertices(); ++i)
            u.push_back((states.back().x[i] - body.rest.positions[i]).norm());
        high = std::max(high, *std::max_element(u.begin(), u.end()));
    }
    std::vector<Image> images;
    for (std::size_t n = 0; n < 2; ++n) {
        PictureOptions options;
        options.width = 640, options.height = 480;
        options.title = n == 0 ? "scheme B under gravity" : "scheme C under gravity";
        options.legend = "displacement [m]";
        options.high = high;
        images.push_back(
            paint(states[n].x, s.body().rest.triangles, displacement[n], options, s.body().rest.positions));
    }
    return beside(images);
}

}  // namespace innerspring
