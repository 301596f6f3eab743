#pragma once
#include <algorithm>

#include "innerspring/sim/contact.h"
#include "innerspring/sim/volume.h"

namespace innerspring {

/// An explicit step's pressure (ours). With v* the velocities without it, r_i = dv_i / d(h P) and V to first
/// order,
///     V' = V + h sum_i a_i . v*_i + h^2 P sum_i a_i . r_i,   P = -(V' - V_0) / compliance,
/// gives P at once: backward Euler in the one number V, stable at any stiffness, to a hard constraint at
/// compliance 0. Then of V - V_0 itself only a share is made up for in a step, lest rounding shakes the body.
struct Pressing {
    double excess = 0;      ///< V - V_0 before the step [m^3]
    double flow = 0;        ///< sum a_i . v_i, as the velocities are [m^3/s]
    double give = 0;        ///< sum a_i . r_i [m^4/kg]
    double compliance = 0;  ///< V_0 / kappa [m^3/Pa]
    double h = 0;           ///< [s]
    double P = 0;           ///< so much is in the velocities already [Pa]

    static constexpr double share = 0.2;  ///< of V - V_0, where hard

    /// What is still to be added to P.
    double missing() const {
        const double below = compliance + h * h * give, V = compliance > 0 ? excess : share * excess;
        return below > 0 ? -(compliance * P + V + h * flow) / below : 0;
    }
    /// What tools add that change `flow` by so much.
    double answer(double change) const {
        const double below = compliance + h * h * give;
        return below > 0 ? -h * change / below : 0;
    }
};

/// The pressure together with what tools do in a sub-step. `look(candidate)` fills in x before the sub-step
/// and v after it without the missing pressure; a_of and r_of give a vertex's. Returns the pressure [Pa] that
/// is still to be added for all but the candidates, whose x and v after the sub-step are complete. Pressing a
/// body raises its pressure, which presses against the tool: the two are found in turns. `foresee`: only v,
/// and Candidate::foreseen.
template <class Look, class AreaOf, class ResponseOf>
double press_against_tools(const Pressing& s, const Loads& loads, double time, bool foresee, Contact& contact,
                           Look&& look, AreaOf&& a_of, ResponseOf&& r_of) {
    constexpr int most_rounds = 10;
    std::vector<Candidate>& candidates = contact.candidates();
    double P = s.missing(), answered = 0;
    for (Candidate& c : candidates) {
        look(c);
        c.v += s.h * P * r_of(c.vertex);
        c.free_v = c.v;
    }
    if (contact.meet_all(loads, time, s.h)) {
        double last = 0, answer = 0;  // of the round before
        for (int round = 0; round < most_rounds; ++round) {
            contact.settle(loads);
            double change = 0;
            for (const Candidate& c : candidates) change += a_of(c.vertex).dot(c.v - c.free_v);
            // As long as the same points press the answer is linear in what was answered before: secants.
            const double now = s.answer(change),
                         slope = answered != last ? (now - answer) / (answered - last) : 0;
            const double more = (now - answered) / (1 - std::clamp(slope, 0.0, 0.9));
            last = answered, answer = now;
            answered += more, P += more;
            for (Candidate& c : candidates) {
                const Vector by = s.h * more * r_of(c.vertex);
                c.v += by, c.free_v += by;
            }
            if (std::abs(more) <= 1e-9 * std::abs(P)) break;
        }
        contact.settle(loads);
        if (!foresee) contact.finish(s.h);
    }
    for (Candidate& c : candidates)
        if (foresee)
            c.foreseen = c.v - c.free_v;
        else if (!c.changed)
            c.x += s.h * c.v;
    return P;
}

}  // namespace innerspring
