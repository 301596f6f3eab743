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

}  // namespace

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

}  // namespace innerspring
