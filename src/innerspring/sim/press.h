#pragma once
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
    /// What a change of V' by tools adds, where `held` of give cannot follow.
    double answer(double change, double held = 0) const {
        const double below = compliance + h * h * (give - held);
        return give > held && below > 0 ? -change / below : 0;
    }
};

/// The pressure together with what tools do in a sub-step. `look(candidate)` fills in x before the sub-step
/// and v after it without the missing pressure; a_of and r_of give a vertex's. Returns the pressure [Pa] that
/// is still to be added for all but the candidates, whose x and v after the sub-step are complete. Pressing a
/// body raises its pressure, which presses against the tool: a few rounds, then the tools hold still.
template <class Look, class AreaOf, class ResponseOf>
double press_against_tools(const Pressing& s, const Loads& loads, double time, Contact& contact, Look&& look,
                           AreaOf&& a_of, ResponseOf&& r_of) {
    constexpr int rounds = 4;
    std::vector<Candidate>& candidates = contact.candidates();
    double P = s.missing(), added = P;
    for (Candidate& c : candidates) look(c), c.before = c.x;
    for (int round = 1;; ++round) {
        for (Candidate& c : candidates) {
            c.x = c.before;
            c.v += s.h * added * r_of(c.vertex);
            c.untouched = c.before + s.h * c.v;
        }
        contact.resolve(loads, time, s.h);
        double change = 0, held = 0;
        for (const Candidate& c : candidates) {
            if (!c.changed) continue;
            const Vector a = a_of(c.vertex);
            change += a.dot(c.x - c.untouched);
            held += a.dot(r_of(c.vertex));
        }
        added = s.answer(change);
        if (round < rounds && std::abs(added) > 1e-6 * std::abs(P)) {
            P += added;
            continue;
        }
        added = s.answer(change, held);
        for (Candidate& c : candidates) {
            if (c.changed) continue;
            c.v += s.h * added * r_of(c.vertex);
            c.x = c.before + s.h * c.v;
        }
        return P + added;
    }
}

}  // namespace innerspring
