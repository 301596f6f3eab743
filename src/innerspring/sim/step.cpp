#include "innerspring/sim/step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/error.h"
#include "innerspring/sim/substep.h"

namespace innerspring {

std::string_view to_string(Integrator integrator) {
    switch (integrator) {
        case Integrator::automatic:
            return "auto";
        case Integrator::symplectic:
            return "symplectic";
        case Integrator::implicit:
            return "implicit";
    }
    return "?";
}

Integrator parse_integrator(std::string_view text) {
    for (Integrator i : {Integrator::automatic, Integrator::symplectic, Integrator::implicit})
        if (text == to_string(i)) return i;
    throw InputError(fmt::format("integrator '{}': expected auto, symplectic or implicit", text));
}

std::string_view to_string(Precision precision) {
    return precision == Precision::single ? "single" : "double";
}

Precision parse_precision(std::string_view text) {
    for (Precision p : {Precision::single, Precision::full})
        if (text == to_string(p)) return p;
    throw InputError(fmt::format("precision '{}': expected single or double", text));
}

namespace {

/// Beyond so many sub-steps `auto` goes implicit (bench_solve, millisecond): each evaluation of an implicit
/// step, with its solve, costs as much as six to seven sub-steps, and a step takes about
/// 3 + 2 log10(1e-3 / tolerance) of them.
///
/// With tools it takes some three times as many in soft nets and more in stiff ones, where rounds of contact
/// go on for long.
double implicit_pays_from(double tolerance, bool tools) {
    return (tools ? 8 : 1) * 6.5 * (3 + 2 * std::max(0.0, std::log10(1e-3 / tolerance)));
}

/// Before a step of dt with tools. In double precision all vertices are looked at for the bounds of the
/// motion, in single find_largest() has done it.
void begin_contact(const Body& body, const Loads& loads, double time, const State& state,
                   Workspace::Data& w) {
    const double dt = w.options.dt, h = dt / w.substeps;
    Contact::Motion motion;
    if (w.packed) {
        motion.displacement = w.largest.displacement, motion.speed = w.largest.speed;
        motion.alone = !w.volume.active();
        w.contact.begin(
            body, loads, motion, w.bound.value, time, dt, h, w.packed->place_of,
            [&](Index i) -> Vector { return body.rest.positions[i] + displacement(*w.packed, i); });
        return;
    }
    motion.frame = home_frame(body, state.x, w.team);
    double u2 = 0, v2 = 0;
    for (std::size_t i = 0; i < body.vertices(); ++i) {
        const Vector home = motion.frame.R * body.rest.positions[i] + motion.frame.t;
        u2 = std::max(u2, (state.x[i] - home).squaredNorm());
        v2 = std::max(v2, state.v[i].squaredNorm());
    }
    motion.displacement = std::sqrt(u2), motion.speed = std::sqrt(v2);
    if (w.implicit) motion.share = 1;
    motion.alone = !w.implicit && !w.volume.active() && !body.free;  // what is foreseen is kept there
    w.contact.begin(body, loads, motion, w.bound.value, time, dt, h, {},
                    [&](Index i) -> const Vector& { return state.x[i]; });
}

/// The first vertex that a step in single precision took out of the numbers.
Index first_bad(const Packed& p) {
    for (Index i = 0; i < p.place_of.size(); ++i)
        if (!((displacement(p, i).squaredNorm() + velocity(p, i).squaredNorm()) * p.scale * p.scale < 1e30))
            return i;
    return 0;
}

/// Takes the integrator and the sub-steps for the body as it stands, after `transfer` if there was one.
void prepare(const Body& body, Workspace::Data& w, const Transfer* transfer = nullptr) {
    const StepOptions& options = w.options;
    const double stable = step_safety * largest_stable_step(w.bound);
    const double wanted = std::ceil(options.dt / stable);
    w.integrator = options.integrator;
    if (w.integrator == Integrator::automatic)
        w.integrator =
            wanted <= std::min(implicit_pays_from(options.tolerance, w.tools), double(options.max_substeps))
                ? Integrator::symplectic
                : Integrator::implicit;
    if (w.integrator == Integrator::symplectic && !(wanted <= options.max_substeps))
        throw InputError(
            fmt::format("symplectic Euler would need {:.0f} sub-steps of {:.3g} s for dt = {:g} s (at most "
                        "{} are allowed); "
                        "use a smaller dt, or the integrator auto or implicit",
                        wanted, stable, options.dt, options.max_substeps));
    const bool single =
        w.integrator == Integrator::symplectic && options.precision == Precision::single && packable(body);
    if (!single) w.packed.reset();
    if (single && !w.packed) w.packed = pack(body);
    if (w.integrator == Integrator::symplectic) {
        w.implicit.reset();
        w.substeps = std::max(1, int(wanted));
        if (single) return;
        w.x.resize(body.vertices()), w.v.resize(body.vertices());
        w.external.resize(body.vertices(), Vector::Zero());
        w.not_finite.resize(block_count(body.vertices()), no_index);
    } else {
        w.substeps = 1;
        if (w.implicit && transfer)
            w.implicit->adapt(transfer->surface, transfer->body);
        else
            w.implicit.emplace(body, options.dt);
    }
}

}  // namespace

Workspace::Workspace(const Body& body, const StepOptions& options) {
    if (!(options.dt > 0 && std::isfinite(options.dt)))
        throw InputError(fmt::format("dt is {:g} s; it must be positive", options.dt));
    data = std::make_unique<Data>(body, options);
    data->bound = stability_bound(body);
    prepare(body, *data);
}

void Workspace::adapt(const Body& body, const Transfer& transfer) {
    update(data->bound, body, transfer.surface, transfer.body);
    data->contact.adapt(body, transfer.surface, transfer.body);
    data->volume.adapt(transfer.body);
    if (data->packed) innerspring::adapt(*data->packed, body, transfer.surface, transfer.body);
    prepare(body, *data, &transfer);
}

void Workspace::reserve(std::size_t vertices) {
    for (auto* list : {&data->x, &data->v, &data->external}) list->reserve(list->size() + vertices);
    for (auto& w : data->bound.w) w.reserve(w.size() + vertices);
    data->bound.ratio.reserve(data->bound.ratio.size() + vertices);
    data->not_finite.reserve(data->not_finite.size() + block_count(vertices) + 1);
}

Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

Integrator Workspace::integrator() const {
    return data->integrator;
}
Precision Workspace::precision() const {
    return data->packed ? Precision::single : Precision::full;
}
int Workspace::substeps() const {
    return data->substeps;
}
const ContactReport& Workspace::contact() const {
    return data->contact.report();
}

namespace {

/// When a step of dt from this state ends: a run from time 0 with one dt is at n dt, not at a sum of n
/// roundings.
double end_of_step(const State& state, double dt) {
    const double counted = double(state.steps) * dt;
    return std::abs(state.time - counted) < 1e-9 * counted || state.time == counted
               ? double(state.steps + 1) * dt
               : state.time + dt;
}

/// The state is written only if all went well.
StepReport packed_steps(const Body& body, const Loads& loads, State& state, Workspace::Data& w, int count) {
    const double dt = w.options.dt, h = dt / w.substeps;
    State now{state.time, state.steps, {}, {}};
    StepReport report;
    load(*w.packed, body, state, w.team, loads.tools.empty() ? nullptr : &w.largest);
    for (int n = 0; n < count; ++n) {
        const double end = end_of_step(now, dt);
        w.pressure = 0;
        if (!loads.tools.empty()) {
            if (n > 0) find_largest(*w.packed, w.team, w.largest);
            begin_contact(body, loads, now.time, state, w);
        }
        for (report.substeps = 0; report.substeps < w.substeps; ++report.substeps, now.time += h) {
            double* const volume = w.options.volume && report.substeps == 0 ? &report.volume : nullptr;
            if (!packed_substep(body, loads, now.time, h, report.substeps + 1 == w.substeps, w, volume)) {
                report.not_finite = first_bad(*w.packed);
                return report;
            }
        }
        report.pressure = w.pressure / w.substeps;
        if (!loads.tools.empty()) w.contact.end(dt);
        now.time = end;
        ++now.steps;
    }
    store(*w.packed, body, state, w.team);
    for (const Pin& pin : loads.pins) {  // exact in double
        const Vector offset = offset_at(pin, now.time),
                     velocity = (offset - offset_at(pin, now.time - h)) / h;
        for (Index i : pin.vertices) state.x[i] = body.rest.positions[i] + offset, state.v[i] = velocity;
    }
    state.time = now.time, state.steps = now.steps;
    return report;
}

StepReport one_step(const Body& body, const Loads& loads, State& state, Workspace::Data& w) {
    const double dt = w.options.dt, h = dt / w.substeps, end = end_of_step(state, dt);
    const double V = w.options.volume ? volume(state.x, body.rest.triangles) : 0;
    StepReport report;
    w.pressure = 0;
    if (!loads.tools.empty()) begin_contact(body, loads, state.time, state, w);
    if (w.implicit)
        report =
            w.implicit->step(loads, w.options, state, w.team, loads.tools.empty() ? nullptr : &w.contact);
    else
        for (; report.substeps < w.substeps && report.not_finite == no_index; ++report.substeps)
            report.not_finite = substep(body, loads, h, report.substeps + 1 == w.substeps, state, w);
    if (!w.implicit) report.pressure = w.pressure / w.substeps;
    if (!loads.tools.empty()) w.contact.end(dt);
    report.volume = V;
    if (report.not_finite == no_index) {
        state.time = end;
        ++state.steps;
    }
    return report;
}

}  // namespace

StepReport step(const Body& body, const Loads& loads, State& state, Workspace& workspace, int count) {
    Workspace::Data& w = *workspace.data;
    if (!loads.tools.empty() && !w.tools) {
        w.tools = true;
        if (w.options.integrator == Integrator::automatic) prepare(body, w);
    }
    if (w.packed) return packed_steps(body, loads, state, w, count);
    StepReport report;
    for (int n = 0; n < count && report.not_finite == no_index; ++n) report = one_step(body, loads, state, w);
    return report;
}

}  // namespace innerspring
