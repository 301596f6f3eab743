#include <algorithm>
#include <cmath>

#include "innerspring/sim/contact.h"

// Vertices that only one tool may meet. Nothing couples them, so that a sub-step is a formula: with the plane
// n . (x - s) = 0 that touches the tool where the vertex would end, and m the vertex' mass,
//     j_n = max(0, m (least - n . v)),   j_t = -m u_t, on to |j_t| <= mu j_n,   u = v - v_tool.
namespace innerspring {

/// How many from `first` on are of one tool, as many as are done at once at most.
std::size_t Contact::next_lones(std::size_t first) const {
    const std::size_t most = std::min(lones_.size(), first + most_at_once);
    std::size_t last = first + 1;
    while (last < most && lones_[last].tool == lones_[first].tool) ++last;
    return last - first;
}

/// With `meet(lone, carried, met)` for the shape of the tool.
template <class Meet>
void Contact::press_each(const Tool& tool, std::size_t first, std::size_t count, double h, Meet&& meet) {
    const Index k = lones_[first].tool;
    const ToolData& data = tools_[k];
    int points = 0;
    for (std::size_t at = 0; at < count; ++at) {
        Lone& l = lones_[first + at];
        Carried& c = carried_[at];
        Met met;
        pressed_[at] = false;
        if (!meet(l, c, met)) continue;
        const Vector& n = met.normal;
        const Vector velocity =
            data.still ? Vector(Vector::Zero()) : Vector((met.surface - data.back.world(met.surface)) / h);
        const double least = met.touching ? n.dot(velocity) : n.dot(met.surface - c.x) / h;
        const double jn = std::max(0.0, (least - n.dot(c.v)) * l.mass);
        Vector j = jn * n;
        if (tool.friction > 0 && jn > 0) {
            const Vector u = c.v - velocity, slip = u - n.dot(u) * n;
            const double stops = slip.norm() * l.mass, most = tool.friction * jn;
            j -= (stops <= most ? l.mass : l.mass * (most / stops)) * slip;
        }
        const Vector before = c.x;
        c.v += l.inverse_mass * j;
        c.x += h * c.v;
        const double depth = std::min(std::max(0.0, n.dot(met.surface - c.x)), put_out_);
        if (!(jn > 0 || depth > 0)) continue;
        c.x += depth * n;
        pressed_[at] = true;
        l.impulse += j, l.normal += jn;
        l.torque += (before - data.now.t).cross(j);
        points += jn > 0;
        // As Contact::book().
        l.work += std::abs(j.dot(c.v) - j.squaredNorm() * l.inverse_mass / 2) +
                  stiffness_ * l.mass * depth * (depth / 2 + displacement_);
    }
    report_.tools[k].points += points;
}

/// After the step of dt, in the order of the vertices, wherever they lie.
void Contact::report_lones(double dt) {
    for (Index n = 0; n < lones_.size(); ++n)
        if (lones_[n].normal > 0 || lones_[n].work > 0)
            candidate_of_[lones_[n].vertex] = n, mark(lones_[n].vertex);
    take_marked([&](Index i) {
        const Lone& l = lones_[std::exchange(candidate_of_[i], no_index)];
        ToolContact& felt = report_.tools[l.tool];
        felt.force -= l.impulse, felt.torque -= l.torque;
        report_.work += l.work;
        if (l.normal > 0) report_.vertices.push_back({i, l.impulse / dt, l.normal / dt});
    });
}

void Contact::press_alone(const Tool& tool, std::size_t first, std::size_t count, double h) {
    const ToolData& data = tools_[lones_[first].tool];
    const Vector s0 = data.now.t, s1 = data.next.t;
    if (tool.shape == ToolShape::plane) {
        const Vector n0 = data.now.R.col(2), n1 = data.next.R.col(2);
        press_each(tool, first, count, h, [&](const Lone&, const Carried& c, Met& met) {
            const Vector b = c.x + h * c.v;
            const double from = n0.dot(c.x - s0), to = n1.dot(b - s1);
            met.touching = from <= touch_;
            if (!met.touching && to >= 0) return false;
            met.normal = n1, met.surface = b - to * n1;
            return true;
        });
    } else if (tool.shape == ToolShape::sphere) {
        const double r = tool.radius, touch = r + touch_;
        press_each(tool, first, count, h, [&](const Lone& l, const Carried& c, Met& met) {
            const Vector a = c.x - s0, b = c.x + h * c.v - s1;
            const double a2 = a.squaredNorm(), b2 = b.squaredNorm();
            met.touching = a2 <= touch * touch;
            if (!met.touching) {
                // Through it and out again, or in from the other side: with care.
                const double way2 = (b - a).squaredNorm(), gap = std::sqrt(a2) - r;
                if (b2 >= r * r ? way2 > gap * gap : a.dot(b) < 0.5 * std::sqrt(a2 * b2))
                    return meet(tool, l, c, h, met);
                if (b2 >= r * r) return false;
            }
            const double size = std::sqrt(b2);
            if (!(size > 0)) return meet(tool, l, c, h, met);
            met.normal = b / size, met.surface = s1 + r * met.normal;
            return true;
        });
    } else {
        press_each(tool, first, count, h,
                   [&](const Lone& l, const Carried& c, Met& met) { return meet(tool, l, c, h, met); });
    }
}

}  // namespace innerspring
