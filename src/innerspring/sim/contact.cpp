#include "innerspring/sim/contact.h"

#include <algorithm>
#include <cmath>

namespace innerspring {

namespace {

/// Of Gauss-Seidel: at most so many sweeps, until no impulse changes by more than this share of the largest.
constexpr int most_sweeps = 100;
constexpr double settled = 1e-10;

}  // namespace

double pressure(const Body& body, const VertexContact& contact) {
    double A = 0;  // each triangle of the vertex is met from two of its edges
    for (const Spoke& spoke : body.spokes_of(contact.vertex))
        for (Index t : body.edge_triangles[spoke.edge])
            A += double_area_vector(body.rest.positions, body.rest.triangles[t]).norm() / 12;
    return A > 0 ? contact.normal / A : 0;
}

void Contact::apply(Point& p, const Vector& impulse) {
    const double normal = p.normal.dot(impulse);
    p.jn += normal, p.jt += impulse - normal * p.normal;
    for (int n = 0; n < p.count; ++n) {
        Candidate& c = candidates_[p.corners[n]];
        c.v += p.weights[n] * c.inverse_mass * impulse;
    }
}

/// One Gauss-Seidel update of a point.
void Contact::relax(Point& p, double friction) {
    Vector v = Vector::Zero();
    for (int n = 0; n < p.count; ++n) v += p.weights[n] * candidates_[p.corners[n]].v;
    const double jn = std::max(0.0, p.jn + (p.least - p.normal.dot(v)) / p.inverse_mass);
    Vector jt = Vector::Zero();
    if (friction > 0) {
        const Vector u = v - p.velocity;
        jt = p.jt - (u - p.normal.dot(u) * p.normal) / p.inverse_mass;
        const double size = jt.norm(), most = friction * jn;
        p.sticks = size <= most;
        if (!p.sticks) jt *= most / size;
    }
    const Vector change = (jn - p.jn) * p.normal + jt - p.jt;
    p.jn = jn, p.jt = jt;
    for (int n = 0; n < p.count; ++n) {
        Candidate& c = candidates_[p.corners[n]];
        c.v += p.weights[n] * c.inverse_mass * change;
    }
}

/// Sweeps of projected Gauss-Seidel, and between them a step on in the direction of the last ones by
/// Fletcher-Reeves' rule (nonsmooth nonlinear conjugate gradients, Silcowitz, Niebe & Erleben 2010): where
/// many points share vertices the sweeps alone would take thousands.
void Contact::settle(const Loads& loads) {
    // One sweep will do if no candidate belongs to two points.
    bool alone = true;
    for (Candidate& c : candidates_) c.use = 0;
    for (const Point& p : points_)
        for (int n = 0; n < p.count; ++n) {
            Candidate& c = candidates_[p.corners[n]];
            alone = alone && c.use != 1;
            c.use = 1;
        }
    if (alone) {
        for (Point& p : points_) relax(p, p.known ? loads.tools[p.tool].friction : 0);
        return;
    }
    steps_.assign(points_.size(), {});
    double before = 0;
    for (int sweep = 0; sweep < most_sweeps; ++sweep) {
        double largest = 0, changed = 0, square = 0;
        for (std::size_t n = 0; n < points_.size(); ++n) {
            Point& p = points_[n];
            const Vector j = p.jn * p.normal + p.jt;
            relax(p, p.known ? loads.tools[p.tool].friction : 0);
            Steps& s = steps_[n];
            s.change = p.jn * p.normal + p.jt - j;
            square += s.change.squaredNorm();
            changed = std::max(changed, s.change.norm()), largest = std::max(largest, p.jn);
        }
        if (changed <= settled * largest || sweep + 1 == most_sweeps) break;
        const double beta = before > 0 && square < before ? square / before : 0;
        before = square;
        for (std::size_t n = 0; n < points_.size(); ++n) {
            // If this goes beyond what the constraints allow the next sweep projects.
            Steps& s = steps_[n];
            apply(points_[n], beta * s.direction);
            s.direction = beta * s.direction + s.change;
        }
    }
}

void Contact::place_tools(const Loads& loads, double time, double h) {
    for (std::size_t k = 0; k < tools_.size(); ++k) {
        tools_[k].now = time == last_time_ ? tools_[k].now : tools_[k].next;
        tools_[k].next = placed(loads.tools[k], time + h);
        tools_[k].back.R = tools_[k].now.R * tools_[k].next.R.transpose();
        tools_[k].back.t = tools_[k].now.t - tools_[k].back.R * tools_[k].next.t;
        if (time != last_time_) report_.tools[k].points = 0;
    }
    last_time_ = time;
}

/// The impulse at a point, at `arm` from the tool's origin, that did `work` on the body, which is moved out
/// by `depth`.
void Contact::book(const Point& p, const Vector& arm, double work, double depth) {
    const Vector j = p.jn * p.normal + p.jt;
    for (int n = 0; n < p.count; ++n) {
        Candidate& c = candidates_[p.corners[n]];
        c.x += p.weights[n] * c.inverse_mass / p.inverse_mass * depth * p.normal;
        c.impulse += p.weights[n] * j, c.normal += p.weights[n] * p.jn;
    }
    ToolContact& tool = report_.tools[p.tool];
    tool.force -= j;
    tool.torque -= arm.cross(j);
    if (p.jn > 0) ++tool.points;
    // The springs' share of moving out.
    report_.work += std::abs(work) + stiffness_ / p.inverse_mass * depth * (depth / 2 + displacement_);
}

Contact::Carried Contact::mean(const Point& p) const {
    Carried at{Vector::Zero(), Vector::Zero()};
    for (int n = 0; n < p.count; ++n) {
        at.x += p.weights[n] * candidates_[p.corners[n]].x;
        at.v += p.weights[n] * candidates_[p.corners[n]].v;
    }
    return at;
}

/// How far it is moved out of the tool: what is left inside, as what touched may be by rounding or was from
/// the beginning, without a speed.
double Contact::left_inside(const Point& p, const Vector& x) const {
    return std::min(std::max(0.0, p.normal.dot(p.surface - x)), put_out_);
}

void Contact::resolve_coupled(const Loads& loads, double time, double h) {
    if (!meet_all(loads, time, h)) return;
    settle(loads);
    finish(h);
}

bool Contact::meet_all(const Loads& loads, double time, double h) {
    points_.clear();
    for (Candidate& c : candidates_) c.changed = false;
    place_tools(loads, time, h);
    for (const VertexPair& pair : pairs_) meet(loads.tools[pair.tool], pair, h);
    for (const FacePair& pair : faces_) meet(pair, h);
    return !points_.empty();
}

void Contact::finish(double h) {
    for (const Point& p : points_)
        for (int n = 0; n < p.count; ++n)
            if (Candidate& c = candidates_[p.corners[n]]; !c.changed) c.x += h * c.v, c.changed = true;
    for (const Point& p : points_) {
        const Carried at = mean(p);
        const Vector j = p.jn * p.normal + p.jt;
        // j . (v + v')/2 of the impulse.
        book(p, p.x - tools_[p.tool].now.t, j.dot(at.v) - j.squaredNorm() * p.inverse_mass / 2,
             left_inside(p, at.x));
    }
}

void Contact::open(const Loads& loads, double time, double h) {
    long_ = true;
    points_.clear();
    place_tools(loads, time, h);
}

bool Contact::approach(const Loads& loads, double h) {
    const std::size_t before = points_.size();
    const auto once = [&](auto& pair, auto&& meet_it) {
        if (pair.met) return;
        const std::size_t n = points_.size();
        meet_it();
        pair.met = points_.size() > n;
    };
    for (VertexPair& pair : pairs_) once(pair, [&] { meet(loads.tools[pair.tool], pair, h); });
    for (FacePair& pair : faces_) once(pair, [&] { meet(pair, h); });
    return points_.size() > before;
}

bool Contact::press(const Loads& loads) {
    for (Candidate& c : candidates_) c.changed = false;
    for (Point& p : points_) {
        if (!p.fresh) p.known = p.known || p.jn > 0;
        p.fresh = false;
        p.jn = 0, p.jt.setZero(), p.sticks = false;
        for (int n = 0; n < p.count; ++n) candidates_[p.corners[n]].changed = true;
    }
    settle(loads);
    return std::none_of(points_.begin(), points_.end(), [&](const Point& p) {
        return p.jn > 0 && !p.known && loads.tools[p.tool].friction > 0;
    });
}

void Contact::close() {
    for (const Point& p : points_) {
        const Carried at = mean(p);
        const Vector j = p.jn * p.normal + p.jt;
        book(p, at.x - tools_[p.tool].next.t, j.dot(at.v), left_inside(p, at.x));
    }
}

void Contact::end(double dt) {
    report_.vertices.clear();
    for (Candidate& c : candidates_)
        if (c.normal > 0) report_.vertices.push_back({c.vertex, c.impulse / dt, c.normal / dt});
    report_lones(dt);
    for (ToolContact& t : report_.tools) t.force /= dt, t.torque /= dt;
}

}  // namespace innerspring
