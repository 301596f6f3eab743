#include <algorithm>
#include <cmath>

#include "innerspring/sim/contact.h"

// Where what is near a tool gets into it in a sub-step.
namespace innerspring {

namespace {

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

/// The constraint on a point of the body against the tool's surface.
void Contact::add(Point& p, bool touching, double h) {
    const ToolData& tool = tools_[p.tool];
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

/// Where a vertex on its way gets into a tool or leaves it; false if it does neither.
bool Contact::meet(const Tool& tool, const Near& near, const Carried& c, double h, Met& met) {
    const ToolData& data = tools_[near.tool];
    const Vector a = data.now.local(c.x), b = data.next.local(c.x + h * c.v);
    // No part of the way is farther from where the step began than its ends are.
    if (std::max((a - near.local).squaredNorm(), (b - near.local).squaredNorm()) <
            (near.distance - touch_) * (near.distance - touch_) &&
        near.distance > touch_)
        return false;
    // A distance changes by no more than the way.
    const double slack = 1e-9 * data.bound;
    const auto measure = [&](const Vector& p, double within) {
        if (tool.shape == ToolShape::mesh)
            if (NearTriangles& few = seen_[near.seen].few; few.answer(p, within)) {
                const Nearest found = nearest(*tool.mesh, few, p, within);
                few.begin_with(found.triangle);
                return found;
            }
        return nearest(tool, p, within);
    };
    const Nearest from = measure(a, std::abs(near.distance) + (a - near.local).norm() + slack),
                  to = measure(b, std::abs(from.distance) + (b - a).norm() + slack);
    met.touching = from.distance <= touch_;
    Vector at = b - to.distance * to.normal, normal = to.normal;
    if (met.touching && long_) {
        at = a - from.distance * from.normal, normal = from.normal;
    } else if (!met.touching) {
        // Past the far side, or through an edge: where it came in.
        const bool past = to.distance >= 0 ? from.distance + to.distance < (b - a).norm()
                                           : long_ || from.normal.dot(to.normal) < 0.5;
        if (past) {
            const double t = first_hit(tool, a, b, from.distance, touch_);
            if (t > 1 && to.distance >= 0) return false;
            const Vector hit = a + std::min(t, 1.0) * (b - a);
            const Nearest there = nearest(tool, hit);
            at = hit - there.distance * there.normal, normal = there.normal;
        } else if (to.distance >= 0) {
            return false;
        }
    }
    met.normal = data.next.R * normal, met.surface = data.next.world(at);
    return true;
}

void Contact::meet(const Tool& tool, const VertexPair& pair, double h) {
    const Candidate& c = candidates_[pair.candidate];
    Met met;
    if (!meet(tool, pair, {c.x, c.v}, h, met)) return;
    Point& p = points_.emplace_back();
    p.corners = {pair.candidate, 0, 0}, p.weights = {1, 0, 0}, p.count = 1, p.tool = pair.tool;
    p.normal = met.normal, p.surface = met.surface;
    add(p, met.touching, h);
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
    p.surface = s1 + radius * p.normal;
    if (side0 >= -touch_) p.radius = radius;
    points_.push_back(p);
    add(points_.back(), touching, h);
}

}  // namespace innerspring
