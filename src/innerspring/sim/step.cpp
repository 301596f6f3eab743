#include "innerspring/sim/step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "innerspring/mesh/error.h"
#include "innerspring/sim/implicit.h"
#include "innerspring/sim/kernel.h"
#include "innerspring/sim/packed.h"
#include "innerspring/sim/press.h"
#include "innerspring/sim/stability.h"

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

struct Workspace::Data {
    StepOptions options;
    Integrator integrator;
    int substeps = 1;
    Team team;
    std::vector<Vector> x, v, external;  ///< the arrays a step writes before they are swapped in
    std::vector<Index> not_finite;       ///< per block
    StabilityBound bound;
    std::optional<Packed> packed;  ///< in single precision
    std::optional<ImplicitSolver> implicit;
    Contact contact;
    LargestMotion largest;
    bool tools = false;  ///< were there
    VolumeTerm volume;
    std::vector<Vector> area, response;  ///< a_i, and dv_i / d(h P), of the sub-step
    std::vector<double> sums;            ///< per block
    double pressure = 0;                 ///< sum over the sub-steps of a step [Pa]
};

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

Index first_bad(const std::vector<Index>& blocks) {
    for (Index i : blocks)
        if (i != no_index) return i;
    return no_index;
}

/// Before a step of dt with tools. In double precision all vertices are looked at for the bounds of the
/// motion, in single find_largest() has done it.
void begin_contact(const Body& body, const Loads& loads, double time, const State& state,
                   Workspace::Data& w) {
    const double dt = w.options.dt, h = dt / w.substeps;
    Contact::Motion motion;
    if (w.packed) {
        motion.displacement = w.largest.displacement, motion.speed = w.largest.speed;
        w.contact.begin(body, loads, motion, w.bound.value, time, dt, h, [&](Index i) -> Vector {
            return body.rest.positions[i] + displacement(*w.packed, i);
        });
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
    w.contact.begin(body, loads, motion, w.bound.value, time, dt, h,
                    [&](Index i) -> const Vector& { return state.x[i]; });
}

/// What the tools do to velocities `v` from positions `x`; positions after the sub-step go to x_out, if any.
void touch(const Loads& loads, double time, double h, const std::vector<Vector>& x, std::vector<Vector>& v,
           std::vector<Vector>* x_out, Contact& contact) {
    for (Candidate& c : contact.candidates()) c.x = x[c.vertex], c.v = v[c.vertex];
    contact.resolve(loads, time, h);
    for (const Candidate& c : contact.candidates()) {
        if (!c.changed) continue;
        v[c.vertex] = c.v;
        if (x_out) (*x_out)[c.vertex] = c.x;
    }
}

/// sum_i of what `term(i)` gives, block by block.
template <class Term>
double sum_over(std::size_t n, Workspace::Data& w, Term&& term) {
    w.sums.resize(block_count(n));
    w.team.run(w.sums.size(), [&](std::size_t block) {
        double sum = 0;
        for (std::size_t i = block * block_size; i < std::min(n, (block + 1) * block_size); ++i)
            sum += term(i);
        w.sums[block] = sum;
    });
    double sum = 0;
    for (double part : w.sums) sum += part;
    return sum;
}

/// The volume term's and the tools' part of a sub-step in double precision: w.v, and w.x if `move`, get what
/// w.response says to the pressure that is missing. w.area and w.response are those of the places x.
void press(const Body& body, const Loads& loads, double time, const std::vector<Vector>& x, bool move,
           Pressing& s, Workspace::Data& w) {
    const std::size_t n = body.vertices();
    for (const Pin& pin : loads.pins)
        for (Index i : pin.vertices) w.response[i].setZero();
    s.flow = sum_over(n, w, [&](std::size_t i) { return w.area[i].dot(w.v[i]); });
    s.give = sum_over(n, w, [&](std::size_t i) { return w.area[i].dot(w.response[i]); });
    double P = s.missing();
    if (!loads.tools.empty())
        P = press_against_tools(
            s, loads, time, w.contact, [&](Candidate& c) { c.x = x[c.vertex], c.v = w.v[c.vertex]; },
            [&](Index i) -> const Vector& { return w.area[i]; },
            [&](Index i) -> const Vector& { return w.response[i]; });
    w.team.run(block_count(n), [&](std::size_t block) {
        for (std::size_t i = block * block_size; i < std::min(n, (block + 1) * block_size); ++i) {
            w.v[i] += s.h * P * w.response[i];
            if (move) w.x[i] += s.h * s.h * P * w.response[i];
        }
    });
    if (!loads.tools.empty())
        for (const Candidate& c : w.contact.candidates()) {
            w.v[c.vertex] = c.v;
            if (move) w.x[c.vertex] = c.x;
        }
    s.P += P;
}

/// What curvature left of V - V_0 at the end of a step, where hard: moved out along the response of those
/// that neither pin nor tool holds, without a speed; but a free body is turned so much the slower or faster
/// as its angular momentum asks.
void restore_volume(const Body& body, const Loads& loads, Workspace::Data& w) {
    if (!loads.tools.empty())
        for (const Candidate& c : w.contact.candidates())
            if (c.changed) w.response[c.vertex].setZero();
    Vector gained = Vector::Zero();
    for (int round = 0; round < 3; ++round) {
        const double excess = w.volume.find(w.x, w.area, w.team);
        const double give =
            sum_over(body.vertices(), w, [&](std::size_t i) { return w.area[i].dot(w.response[i]); });
        // A body at rest is left alone.
        if (!(std::abs(excess) > (round == 0 ? 2e-9 : 1e-12) * body.volume) || !(give > 0)) break;
        for (std::size_t i = 0; i < body.vertices(); ++i) {
            const Vector by = -excess / give * w.response[i];
            w.x[i] += by;
            if (body.free) gained += body.m[i] * by.cross(w.v[i]);
        }
    }
    if (!body.free || gained.isZero(0)) return;
    Moments moments;
    for (std::size_t i = 0; i < body.vertices(); ++i) moments.add(body.m[i], w.x[i] - w.x[0], Vector::Zero());
    moments.xv = -gained;
    const RigidMotion turn = rigid_motion(moments);
    for (std::size_t i = 0; i < body.vertices(); ++i)
        w.v[i] += turn.angular.cross(w.x[i] - w.x[0] - turn.centre);
}

/// One symplectic Euler step of length h, the last of a step or not; state changes only if all stays finite.
Index substep(const Body& body, const Loads& loads, double h, bool last, State& state, Workspace::Data& w) {
    const std::size_t n = body.vertices();
    auto each_block = [&](auto&& advance) {
        w.team.run(w.not_finite.size(), [&](std::size_t block) {
            w.not_finite[block] = advance(block * block_size, std::min(n, (block + 1) * block_size));
        });
        return first_bad(w.not_finite);
    };
    const Vector* external = nullptr;
    if (!loads.forces.empty()) {
        add_loads(loads, state.time, w.external);
        external = w.external.data();
    }
    const KernelStep s{body,           home_frame(body, state.x, w.team),
                       loads.gravity,  h,
                       external,       state.x.data(),
                       state.v.data(), w.x.data(),
                       w.v.data()};
    const double time = state.time + h;
    auto move_pins = [&] {
        for (const Pin& pin : loads.pins) {
            const Vector offset = offset_at(pin, time);
            for (Index i : pin.vertices) {
                w.x[i] = body.rest.positions[i] + offset;
                w.v[i] = (w.x[i] - state.x[i]) / h;
            }
        }
    };
    const bool pressing = w.volume.active();
    Pressing pressure;
    if (pressing) {
        pressure.excess = w.volume.find(state.x, w.area, w.team);
        pressure.compliance = w.volume.compliance(), pressure.h = h;
        w.response.resize(body.vertices());
        for (std::size_t i = 0; i < body.vertices(); ++i)
            w.response[i] = w.area[i] / (body.m[i] + (body.free ? 0 : h * body.c[i]));
    }
    Index bad;
    if (!body.free) {
        bad = each_block([&](std::size_t from, std::size_t to) { return advance_held(s, from, to); });
        if (pressing) {
            move_pins();
            if (bad == no_index) press(body, loads, state.time, state.x, true, pressure, w);
        } else if (bad == no_index && !loads.tools.empty()) {
            touch(loads, state.time, h, state.x, w.v, &w.x, w.contact);
        }
    } else {
        bad = each_block([&](std::size_t from, std::size_t to) { return accelerate(s, from, to); });
        move_pins();  // what pinned vertices really do is part of the motion that is not damped,
        if (pressing && bad == no_index)
            press(body, loads, state.time, state.x, false, pressure, w);
        else if (bad == no_index && !loads.tools.empty())  // and so is what the tools make of it
            touch(loads, state.time, h, state.x, w.v, nullptr, w.contact);
        const bool damped = body.material.damping > 0;
        const RigidMotion home = damped ? rigid_fit(body, h, s.x, s.v_out, w.team) : RigidMotion{};
        if (bad == no_index)
            bad = each_block(
                [&](std::size_t from, std::size_t to) { return damp_and_move(s, home, from, to); });
        if (pressing && bad == no_index) {
            // Pressure on top is damped as all else: relative to the motion that it has as a whole.
            if (damped) {
                const RigidMotion part = rigid_fit(body, h, s.x, w.response.data(), w.team);
                for (std::size_t i = 0; i < body.vertices(); ++i) {
                    const Vector whole = part.linear + part.angular.cross(s.x[i] - part.centre);
                    w.response[i] = whole + (w.response[i] - whole) / (1 + h * body.c[i] / body.m[i]);
                }
            }
            move_pins();
            press(body, loads, state.time, state.x, true, pressure, w);
        } else if (bad == no_index && !loads.tools.empty()) {
            touch(loads, state.time, h, state.x, w.v, &w.x, w.contact);
        }
    }
    w.pressure += pressure.P;
    // Zero again, so that nothing is left of these loads when others come.
    for (const Force& f : loads.forces)
        for (Index i : f.vertices) w.external[i].setZero();
    if (bad != no_index) return bad;
    move_pins();
    if (pressing) {
        if (w.volume.hard() && last) restore_volume(body, loads, w);
        for (std::size_t i = 0; i < body.vertices(); ++i)
            if (!(w.x[i].squaredNorm() + w.v[i].squaredNorm() < 1e200)) return Index(i);
    }
    state.x.swap(w.x);
    state.v.swap(w.v);
    state.time = time;
    return no_index;
}

/// The same in single precision, on w.packed; `time` [s] is that before the sub-step.
bool packed_substep(const Body& body, const Loads& loads, double time, double h, bool last,
                    Workspace::Data& w, double* volume) {
    Packed& p = *w.packed;
    for (const Force& f : loads.forces)
        push(p, body, f.vertices, f.weights, h * at(f.profile, time) * f.newton);
    const VectorKernels& kernel = w.options.kernel ? *w.options.kernel : *vector_kernels().front();
    const bool pressing = w.volume.active(), tools = !loads.tools.empty();
    VolumeFlow flow;
    if (!advance(p, kernel, h, loads.gravity, w.team, volume || pressing ? &flow : nullptr)) return false;
    if (volume) *volume = pressing ? body.volume + flow.excess : flow.excess;
    const auto look = [&](Candidate& c) {
        c.x = body.rest.positions[c.vertex] + displacement_before(p, c.vertex);
        c.v = velocity(p, c.vertex);
    };
    const auto place_touched = [&](bool all) {
        if (!tools) return;
        for (const Candidate& c : w.contact.candidates())
            if (c.changed || all) place(p, c.vertex, c.x - body.rest.positions[c.vertex], c.v);
    };
    const auto move_pins = [&] {
        for (const Pin& pin : loads.pins) {
            const Vector offset = offset_at(pin, time + h), velocity = (offset - offset_at(pin, time)) / h;
            for (Index i : pin.vertices) place(p, i, offset, velocity);
        }
    };
    if (pressing) {
        Pressing s;
        s.excess = flow.excess, s.flow = flow.flow, s.give = flow.give;
        s.compliance = w.volume.compliance(), s.h = h;
        const auto response = [&](Index i) { return Vector(area(p, i) / (body.m[i] + h * body.c[i])); };
        for (const Pin& pin : loads.pins) {  // what the kernel took for free
            const Vector v = (offset_at(pin, time + h) - offset_at(pin, time)) / h;
            for (Index i : pin.vertices) {
                const Vector a = area(p, i);
                s.flow += a.dot(v - velocity(p, i)), s.give -= a.dot(response(i));
            }
        }
        const double P =
            tools ? press_against_tools(
                        s, loads, time, w.contact, look, [&](Index i) { return area(p, i); }, response)
                  : s.missing();
        if (!press(p, kernel, h, h * P, h * h * P, w.team)) return false;
        place_touched(true);
        move_pins();
        w.pressure += P;
        if (!w.volume.hard() || !last) return true;
        // What curvature left of V - V_0, without a speed.
        if (tools)
            for (const Candidate& c : w.contact.candidates())
                if (c.changed && c.inverse_mass > 0) s.give -= area(p, c.vertex).dot(response(c.vertex));
        if (s.give > 0 && !press(p, kernel, h, 0, -volume_excess(p, kernel, w.team) / s.give, w.team))
            return false;
        place_touched(false);
        move_pins();
        return true;
    }
    if (tools) {
        for (Candidate& c : w.contact.candidates()) look(c);
        w.contact.resolve(loads, time, h);
        place_touched(false);
    }
    move_pins();
    return true;
}

/// The first vertex that a step in single precision took out of the numbers.
Index first_bad(const Packed& p) {
    for (Index i = 0; i < p.place_of.size(); ++i)
        if (!(displacement(p, i).squaredNorm() * p.scale * p.scale < 1e30)) return i;
    return 0;  // a velocity
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
    data.reset(new Data{options,
                        options.integrator,
                        1,
                        Team(options.threads),
                        {},
                        {},
                        {},
                        {},
                        {},
                        {},
                        {},
                        {},
                        {},
                        false,
                        VolumeTerm(body),
                        {},
                        {},
                        {}});
    data->bound = stability_bound(body);
    prepare(body, *data);
}

void Workspace::adapt(const Body& body, const Transfer& transfer) {
    update(data->bound, body, transfer.surface, transfer.body);
    data->contact.forget();
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
    load(*w.packed, body, state, w.team);
    for (int n = 0; n < count; ++n) {
        const double end = end_of_step(now, dt);
        w.pressure = 0;
        if (!loads.tools.empty()) {
            find_largest(*w.packed, w.team, w.largest);
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
