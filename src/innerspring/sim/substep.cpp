#include "innerspring/sim/substep.h"

#include <algorithm>

#include "innerspring/sim/kernel.h"
#include "innerspring/sim/press.h"

namespace innerspring {

namespace {

Index first_bad(const std::vector<Index>& blocks) {
    for (Index i : blocks)
        if (i != no_index) return i;
    return no_index;
}

/// What the tools do to velocities `v` from positions `x`; positions after the sub-step go to x_out.
void touch(const Loads& loads, double time, double h, const std::vector<Vector>& x, std::vector<Vector>& v,
           std::vector<Vector>& x_out, Contact& contact) {
    contact.resolve(
        loads, time, h,
        [&](const Vector&, Index i) -> Contact::Carried {
            return {x[i], v[i]};
        },
        [&](const Vector&, Index i, const Contact::Carried& c) {
            v[i] = c.v;
            x_out[i] = c.x;
        });
}

/// The same on top of the damping of a free body, without what was foreseen.
void touch_damped(const Loads& loads, double time, double h, const std::vector<Vector>& x,
                  std::vector<Vector>& v, std::vector<Vector>& x_out, Contact& contact) {
    for (Candidate& c : contact.candidates()) c.x = x[c.vertex], c.v = v[c.vertex] - c.foreseen;
    if (contact.meet_all(loads, time, h)) {
        contact.settle(loads);
        contact.finish(h);
    }
    for (const Candidate& c : contact.candidates()) {
        if (!c.changed && c.foreseen.isZero(0)) continue;
        v[c.vertex] = c.v;
        x_out[c.vertex] = c.changed ? c.x : Vector(x[c.vertex] + h * c.v);
    }
}

/// The same before the damping of a free body: see Candidate::foreseen.
void foresee(const Loads& loads, double time, double h, const std::vector<Vector>& x, std::vector<Vector>& v,
             Contact& contact) {
    for (Candidate& c : contact.candidates()) c.x = x[c.vertex], c.v = v[c.vertex];
    if (contact.meet_all(loads, time, h)) contact.settle(loads);
    for (Candidate& c : contact.candidates()) {
        c.foreseen = c.v - v[c.vertex];
        v[c.vertex] = c.v;
    }
}

PressSums total(const std::vector<PressSums>& blocks) {
    PressSums sum;
    for (const PressSums& b : blocks) sum.volume += b.volume, sum.flow += b.flow, sum.give += b.give;
    return sum;
}

/// Calls loop(first, last) for blocks of vertices.
template <class Loop>
void each_block(std::size_t n, Workspace::Data& w, Loop&& loop) {
    w.team.run(block_count(n),
               [&](std::size_t block) { loop(block * block_size, std::min(n, (block + 1) * block_size)); });
}

/// The volume term's and the tools' part of a sub-step in double precision: w.v, and w.x if `move`, get what
/// w.response says to the pressure that is missing; tools are only foreseen if not. w.area and w.response are
/// those of the places x. Returns the first vertex that leaves the numbers, if `move`.
Index press(const Loads& loads, double time, const std::vector<Vector>& x, bool move, Pressing& s,
            Workspace::Data& w) {
    if (move && !loads.tools.empty())
        for (const Candidate& c : w.contact.candidates()) s.flow -= w.area[c.vertex].dot(c.foreseen);
    double P = s.missing();
    if (!loads.tools.empty())
        P = press_against_tools(
            s, loads, time, !move, w.contact,
            [&](Candidate& c) {
                c.x = x[c.vertex], c.v = w.v[c.vertex];
                if (move) c.v -= c.foreseen;
            },
            [&](Index i) -> const Vector& { return w.area[i]; },
            [&](Index i) -> const Vector& { return w.response[i]; });
    const double to_v = s.h * P;
    each_block(x.size(), w, [&](std::size_t first, std::size_t last) {
        Index& bad = w.not_finite[first / block_size];
        bad = no_index;
        for (std::size_t i = first; i < last; ++i) {
            w.v[i] += to_v * w.response[i];
            if (!move) continue;
            w.x[i] = x[i] + s.h * w.v[i];
            if (!(w.x[i].squaredNorm() + w.v[i].squaredNorm() < 1e200) && bad == no_index) bad = Index(i);
        }
    });
    if (!loads.tools.empty())
        for (const Candidate& c : w.contact.candidates()) {
            w.v[c.vertex] = c.v;
            if (move) w.x[c.vertex] = c.x;
        }
    s.P += P;
    return first_bad(w.not_finite);
}

/// What curvature left of V - V_0 at the end of a step, where hard: moved out along the response of those
/// that neither pin nor tool holds, without a speed; but a free body is turned so much the slower or faster
/// as its angular momentum asks.
void restore_volume(const Body& body, const Loads& loads, Workspace::Data& w) {
    const std::size_t n = body.vertices();
    if (!loads.tools.empty())
        for (const Candidate& c : w.contact.candidates())
            if (c.changed) w.response[c.vertex].setZero();
    Vector gained = Vector::Zero();
    for (int round = 0; round < 3; ++round) {
        each_block(n, w, [&](std::size_t first, std::size_t last) {
            PressSums& sum = w.sums[first / block_size];
            sum.volume = w.volume.find(w.x, w.area, first, last), sum.give = 0;
            for (std::size_t i = first; i < last; ++i) sum.give += w.area[i].dot(w.response[i]);
        });
        const PressSums sum = total(w.sums);
        const double excess = sum.volume / 18 - body.volume;
        // A body at rest is left alone.
        if (!(std::abs(excess) > (round == 0 ? 2e-9 : 1e-12) * body.volume) || !(sum.give > 0)) break;
        const double out = -excess / sum.give;
        if (body.free)
            for (std::size_t i = 0; i < n; ++i) gained += body.m[i] * out * w.response[i].cross(w.v[i]);
        each_block(n, w, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) w.x[i] += out * w.response[i];
        });
        // What is left is of second order.
        if (std::abs(excess) < 1e-6 * body.volume) break;
    }
    if (!body.free || gained.isZero(0)) return;
    Moments moments;
    for (std::size_t i = 0; i < body.vertices(); ++i) moments.add(body.m[i], w.x[i] - w.x[0], Vector::Zero());
    moments.xv = -gained;
    const RigidMotion turn = rigid_motion(moments);
    for (std::size_t i = 0; i < body.vertices(); ++i)
        w.v[i] += turn.angular.cross(w.x[i] - w.x[0] - turn.centre);
}

}  // namespace

Index substep(const Body& body, const Loads& loads, double h, bool last, State& state, Workspace::Data& w) {
    const std::size_t n = body.vertices();
    const auto advance_blocks = [&](auto&& advance) {
        each_block(n, w, [&](std::size_t from, std::size_t to) {
            w.not_finite[from / block_size] = advance(from, to);
        });
        return first_bad(w.not_finite);
    };
    const Vector* external = nullptr;
    if (!loads.forces.empty()) {
        add_loads(loads, state.time, w.external);
        external = w.external.data();
    }
    const KernelStep s{
        body,           home_frame(body, state.x, w.team),        loads.gravity, h, external, state.x.data(),
        state.v.data(), w.volume.active() ? nullptr : w.x.data(), w.v.data()};
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
    const bool pressing = w.volume.active(), tools = !loads.tools.empty();
    Pressing pressure;
    if (pressing) {
        w.volume.prepare();
        w.area.resize(n), w.response.resize(n), w.sums.resize(block_count(n));
        pressure.compliance = w.volume.compliance(), pressure.h = h;
    }
    // a_i, r_i and their sums, in the block that has just got its velocities.
    const auto respond = [&](std::size_t from, std::size_t to) {
        PressSums sum;
        sum.volume = w.volume.find(state.x, w.area, from, to);
        for (std::size_t i = from; i < to; ++i) {
            w.response[i] = 1 / (body.m[i] + (body.free ? 0 : h * body.c[i])) * w.area[i];
            sum.flow += w.area[i].dot(w.v[i]), sum.give += w.area[i].dot(w.response[i]);
        }
        w.sums[from / block_size] = sum;
    };
    // The sums, but for pinned vertices, which move as they do and give nothing.
    const auto take_sums = [&] {
        const PressSums sum = total(w.sums);
        pressure.flow = sum.flow, pressure.give = sum.give;
        for (const Pin& pin : loads.pins)
            for (Index i : pin.vertices) {
                pressure.flow -= w.area[i].dot(w.v[i]), pressure.give -= w.area[i].dot(w.response[i]);
                w.response[i].setZero();
            }
        move_pins();
        for (const Pin& pin : loads.pins)
            for (Index i : pin.vertices) pressure.flow += w.area[i].dot(w.v[i]);
        return sum.volume / 18 - body.volume;
    };
    Index bad;
    if (!body.free) {
        bad = advance_blocks([&](std::size_t from, std::size_t to) {
            const Index left = advance_held(s, from, to);
            if (pressing) respond(from, to);
            return left;
        });
        if (pressing) {
            pressure.excess = take_sums();
            if (bad == no_index) bad = press(loads, state.time, state.x, true, pressure, w);
        } else if (bad == no_index && tools) {
            touch(loads, state.time, h, state.x, w.v, w.x, w.contact);
        }
    } else {
        bad = advance_blocks([&](std::size_t from, std::size_t to) {
            const Index left = accelerate(s, from, to);
            if (pressing) respond(from, to);
            return left;
        });
        // What pinned vertices really do is part of the motion that is not damped, and so is what the tools
        // make of it.
        if (pressing)
            pressure.excess = take_sums();
        else
            move_pins();
        if (bad == no_index && tools) {
            if (pressing)
                press(loads, state.time, state.x, false, pressure, w);
            else
                foresee(loads, state.time, h, state.x, w.v, w.contact);
        }
        // Pressure is damped as all else: relative to the motion that it has as a whole.
        const bool damped = body.material.damping > 0;
        const RigidMotion none,
            home = damped ? rigid_fit(body, h, s.x, s.v_out, w.team) : none,
            part = damped && pressing ? rigid_fit(body, h, s.x, w.response.data(), w.team) : none;
        const auto damp = [&](std::size_t from, std::size_t to) {
            const Index left = damp_and_move(s, home, from, to);
            if (!pressing) return left;
            PressSums sum;
            for (std::size_t i = from; i < to; ++i) {
                Vector& r = w.response[i];
                const Vector whole = part.linear + part.angular.cross(s.x[i] - part.centre);
                r = whole + (r - whole) / (1 + h * body.c[i] / body.m[i]);
                sum.flow += w.area[i].dot(w.v[i]), sum.give += w.area[i].dot(r);
            }
            w.sums[from / block_size] = sum;
            return left;
        };
        if (bad == no_index) bad = advance_blocks(damp);
        if (bad == no_index && pressing) {
            take_sums();
            bad = press(loads, state.time, state.x, true, pressure, w);
        } else if (bad == no_index && tools) {
            touch_damped(loads, state.time, h, state.x, w.v, w.x, w.contact);
        }
    }
    w.pressure += pressure.P;
    // Zero again, so that nothing is left of these loads when others come.
    for (const Force& f : loads.forces)
        for (Index i : f.vertices) w.external[i].setZero();
    if (bad != no_index) return bad;
    move_pins();
    if (w.volume.hard() && last) restore_volume(body, loads, w);
    state.x.swap(w.x);
    state.v.swap(w.v);
    state.time = time;
    return no_index;
}

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
        const auto r_of = [&](Index i) { return response(p, i); };
        const auto a_of = [&](Index i) { return Vector((body.m[i] + h * body.c[i]) * response(p, i)); };
        for (const Pin& pin : loads.pins) {  // what the kernel took for free
            const Vector v = (offset_at(pin, time + h) - offset_at(pin, time)) / h;
            for (Index i : pin.vertices) {
                const Vector a = a_of(i);
                s.flow += a.dot(v - velocity(p, i)), s.give -= a.dot(r_of(i));
            }
        }
        const double P =
            tools ? press_against_tools(s, loads, time, false, w.contact, look, a_of, r_of) : s.missing();
        if (!press(p, kernel, h, P, w.team)) return false;
        place_touched(true);
        move_pins();
        w.pressure += P;
        if (!w.volume.hard() || !last) return true;
        // What curvature left of V - V_0, without a speed.
        if (tools)
            for (const Candidate& c : w.contact.candidates())
                if (c.changed && c.inverse_mass > 0) s.give -= a_of(c.vertex).dot(r_of(c.vertex));
        if (s.give > 0 && !shift(p, kernel, -volume_excess(p, kernel, w.team) / s.give, w.team)) return false;
        place_touched(false);
        move_pins();
        return true;
    }
    if (tools)
        w.contact.resolve(
            loads, time, h,
            [&](const Vector& home, Index place) -> Contact::Carried {
                return {home + displacement_before_at(p, place), velocity_at(p, place)};
            },
            [&](const Vector& home, Index place, const Contact::Carried& c) {
                place_at(p, place, c.x - home, c.v);
            });
    move_pins();
    return true;
}

}  // namespace innerspring
