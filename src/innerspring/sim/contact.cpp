#include "innerspring/sim/contact.h"

#include <algorithm>
#include <cmath>

namespace innerspring {

namespace {

/// Of Gauss-Seidel: at most so many sweeps, until no impulse changes by more than this share of the largest.
constexpr int most_sweeps = 100;
constexpr double settled = 1e-10;

/// The first time in [0, 1] at which a point on its way from a to b (in the tool's frame) is within `touch`
/// of it, by steps of the distance, which can never pass through; > 1 if it does not happen.
double first_hit(const Tool& tool, const Vector& a, const Vector& b, double distance, double touch) {
    const double way = (b - a).norm();
    double t = 0;
    for (int n = 0; n < 200; ++n) {
        t += std::max(distance, touch) / way;
        if (!(t <= 1)) return 2;
        distance = nearest(tool, a + t * (b - a)).distance;
        if (distance <= touch) return t;
    }
    return t;
}

}  // namespace

double pressure(const Body& body, const VertexContact& contact) {
    double A = 0;  // each triangle of the vertex is met from two of its edges
    for (const Spoke& spoke : body.spokes_of(contact.vertex))
        for (Index t : body.edge_triangles[spoke.edge])
            A += double_area_vector(body.rest.positions, body.rest.triangles[t]).norm() / 12;
    return A > 0 ? contact.normal / A : 0;
}

/// The constraint on a point of the body against the tool's surface, `local` where it is touched in the
/// tool's frame; `offset`: from the tool's surface to there along the normal, for balls.
void Contact::add(Point& p, const Vector& local, double offset, bool touching, double h) {
    const ToolData& tool = tools_[p.tool];
    p.surface = tool.next.world(local) + offset * p.normal;
    p.velocity = (p.surface - tool.back.world(p.surface)) / h;  // of the same point of the tool
    p.x = Vector::Zero();
    p.inverse_mass = 0;
    for (int n = 0; n < p.count; ++n) {
        const Candidate& c = candidates_[p.corners[n]];
        p.x += p.weights[n] * c.x;
        p.inverse_mass += p.weights[n] * p.weights[n] * c.inverse_mass;
    }
    if (!(p.inverse_mass > 0)) return points_.pop_back();
    p.known = touching || !long_;
    p.least = p.normal.dot(touching ? p.velocity : Vector((p.surface - p.x) / h));
}

void Contact::meet(const Tool& tool, const VertexPair& pair, double h) {
    const ToolData& data = tools_[pair.tool];
    const Candidate& c = candidates_[pair.candidate];
    const Vector a = data.now.local(c.x), b = data.next.local(c.x + h * c.v);
    // No part of the way is farther from where the step began than its ends are.
    if (std::max((a - pair.local).squaredNorm(), (b - pair.local).squaredNorm()) <
            (pair.distance - touch_) * (pair.distance - touch_) &&
        pair.distance > touch_)
        return;
    // A distance changes by no more than the way.
    const double slack = 1e-9 * data.bound;
    const auto measure = [&](const Vector& p, double within) {
        if (tool.shape == ToolShape::mesh)
            if (const NearTriangles& few = seen_[pair.seen].few; few.answer(p, within))
                return nearest(*tool.mesh, few, p, within);
        return nearest(tool, p, within);
    };
    const Nearest from = measure(a, std::abs(pair.distance) + (a - pair.local).norm() + slack),
                  to = measure(b, std::abs(from.distance) + (b - a).norm() + slack);
    const bool touching = from.distance <= touch_;
    Vector at = b - to.distance * to.normal, normal = to.normal;
    if (touching && long_) {
        at = a - from.distance * from.normal, normal = from.normal;
    } else if (!touching) {
        // Past the far side, or through an edge: where it came in.
        const bool past = to.distance >= 0 ? from.distance + to.distance < (b - a).norm()
                                           : long_ || from.normal.dot(to.normal) < 0.5;
        if (past) {
            const double t = first_hit(tool, a, b, from.distance, touch_);
            if (t > 1 && to.distance >= 0) return;
            const Vector hit = a + std::min(t, 1.0) * (b - a);
            const Nearest there = nearest(tool, hit);
            at = hit - there.distance * there.normal, normal = there.normal;
        } else if (to.distance >= 0) {
            return;
        }
    }
    Point& p = points_.emplace_back();
    p.corners = {pair.candidate, 0, 0}, p.weights = {1, 0, 0}, p.count = 1, p.tool = pair.tool;
    p.normal = data.next.R * normal;
    add(p, at, 0, touching, h);
}

void Contact::meet(const FacePair& pair, double h) {
    const ToolData& data = tools_[pair.tool];
    const Vector& centre = data.probes.centres[pair.probe];
    const double radius = data.probes.radius;
    const Vector s0 = data.now.world(centre), s1 = data.next.world(centre);
    const Vector started = data.start.world(centre);
    std::array<Vector, 3> x0, x1;
    double moved = 0;
    for (int n = 0; n < 3; ++n) {
        const Candidate& c = candidates_[pair.corners[n]];
        x0[n] = c.x, x1[n] = c.x + h * c.v;
        moved = std::max({moved, (x0[n] - c.start).squaredNorm(), (x1[n] - c.start).squaredNorm()});
    }
    moved =
        std::sqrt(moved) + std::sqrt(std::max((s0 - started).squaredNorm(), (s1 - started).squaredNorm()));
    if (pair.distance - moved > touch_) return;
    const auto normal_of = [](const std::array<Vector, 3>& x) {
        return Vector((x[1] - x[0]).cross(x[2] - x[0]).stableNormalized());
    };
    const Vector n0 = normal_of(x0);
    const OnTriangle on0 = nearest_on_triangle(s0, x0[0], x0[1], x0[2]);
    const double side0 = n0.dot(s0 - x0[0]), d0 = (s0 - on0.point).norm();
    bool touching = d0 - radius <= touch_;
    if (long_ && (touching || side0 < -touch_))
        for (int n = 0; n < 3; ++n) x1[n] = x0[n] + (s1 - s0);
    const Vector n1 = normal_of(x1);
    const OnTriangle on1 = nearest_on_triangle(s1, x1[0], x1[1], x1[2]);
    const double side1 = n1.dot(s1 - x1[0]), d1 = (s1 - on1.point).norm();
    Point p{};
    p.x = p.surface = p.velocity = Vector::Zero();
    p.corners = {pair.corners[0], pair.corners[1], pair.corners[2]}, p.count = 3, p.tool = pair.tool;
    p.weights = on1.weights;
    if (side0 < -touch_) {
        // Below this face. If it is inside the body it was pushed in by what was there before, or by another
        // face: out again, if not from deep.
        if (d0 > pair.deep || on0.corners() == 1) return;
        p.normal = -n1;
        if (on0.corners() == 2) {
            // Nearest to a side, in the angle between two faces.
            const int side = on0.weights[2] == 0 ? 0 : on0.weights[0] == 0 ? 1 : 2;
            const Vector& apex = candidates_[pair.corners[side + 3]].x;
            const Vector normal = n0 + normal_of({x0[(side + 1) % 3], x0[side], apex});
            if (normal.dot(s0 - on0.point) >= 0) return;
            p.normal = -normal.stableNormalized();
        }
        touching = true;
    } else if (side1 < 0 && side0 > side1) {
        // The centre goes through the plane; through the triangle?
        const double t = std::clamp(side0 / (side0 - side1), 0.0, 1.0);
        std::array<Vector, 3> x;
        for (int n = 0; n < 3; ++n) x[n] = x0[n] + t * (x1[n] - x0[n]);
        const Vector s = s0 + t * (s1 - s0);
        const OnTriangle on = nearest_on_triangle(s, x[0], x[1], x[2]);
        const double tolerance = std::max(touch_, 1e-6 * (x1[1] - x1[0]).norm());
        if ((on.point - s).norm() <= tolerance) {
            p.normal = -n1, p.weights = on.weights;
        } else if (d1 < radius) {
            p.normal = (on1.point - s1) / d1;
        } else {
            return;
        }
    } else if (radius > 0 && (d1 < radius || touching)) {
        p.normal = d1 > touch_ ? Vector((on1.point - s1) / d1) : Vector(-n1);
        if (long_ && !touching) {
            // Where they first touch, by steps of what is between them.
            double way = (s1 - s0).norm(), distance = d0, t = 0;
            for (int n = 0; n < 3; ++n) way = std::max(way, (x1[n] - x0[n] - (s1 - s0)).norm());
            for (int step = 0; step < 100 && distance - radius > touch_ && t < 1; ++step) {
                t = std::min(1.0, t + (distance - radius) / way);
                std::array<Vector, 3> x;
                for (int n = 0; n < 3; ++n) x[n] = x0[n] + t * (x1[n] - x0[n]);
                const Vector s = s0 + t * (s1 - s0);
                const OnTriangle on = nearest_on_triangle(s, x[0], x[1], x[2]);
                distance = (on.point - s).norm();
                if (distance > touch_) p.normal = (on.point - s) / distance;
                p.weights = on.weights;
            }
        }
    } else if (radius == 0 && touching) {
        p.normal = -n1;
    } else {
        return;
    }
    // Corners are vertices and looked at as such, against the same ball.
    if (radius > 0 && *std::max_element(p.weights.begin(), p.weights.end()) == 1) return;
    points_.push_back(p);
    add(points_.back(), centre, radius, touching, h);
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
    for (Candidate& c : candidates_) c.place = 0;
    for (const Point& p : points_)
        for (int n = 0; n < p.count; ++n) {
            Candidate& c = candidates_[p.corners[n]];
            alone = alone && c.place != 1;
            c.place = 1;
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

void Contact::resolve(const Loads& loads, double time, double h) {
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
    for (ToolContact& t : report_.tools) t.force /= dt, t.torque /= dt;
}

}  // namespace innerspring
