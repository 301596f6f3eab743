#include <algorithm>
#include <cmath>

#include "innerspring/sim/contact.h"

// Which vertices and faces may meet a tool in a step.
namespace innerspring {

namespace {

/// Faces are looked at where a side is longer than this share of a probe's radius: below it a sphere passes
/// between the vertices by at most 1 % of its radius.
constexpr double fine_side = 0.25;

Box grown(const Box& box, double by) {
    return {box.lower - Vector::Constant(by), box.upper + Vector::Constant(by)};
}

/// Calls fn(item) for every item of a tree of points in a leaf that overlaps `box`.
template <class Function>
void for_each_near(const BoxTree& tree, const Box& box, Function&& fn) {
    std::array<Index, 128> stack;
    std::size_t top = 0;
    if (!tree.nodes.empty()) stack[top++] = 0;
    while (top > 0) {
        const BoxTree::Node& node = tree.nodes[stack[--top]];
        if (!overlap(node.box, box)) continue;
        if (node.count == 0) {
            stack[top++] = node.first + 1;
            stack[top++] = node.first;
        }
        for (Index slot = node.first; slot < node.first + node.count; ++slot) fn(tree.items[slot]);
    }
}

/// The corner beyond side (side, side + 1) of a triangle.
Index across(const Body& body, Index t, int side) {
    const Index edge = body.triangle_edges[t][side];
    for (Index other : body.edge_triangles[edge])
        if (other != t)
            for (Index i : body.rest.triangles[other])
                if (i != body.edges[edge].a && i != body.edges[edge].b) return i;
    return body.rest.triangles[t][(side + 2) % 3];
}

}  // namespace

Contact::Placed Contact::placed(const Pose& pose) {
    return {pose.rotation.normalized().toRotationMatrix(), pose.position};
}

Contact::Placed Contact::placed(const Tool& tool, double time) {
    return placed(pose_at(tool, time));
}

/// What depends on the body and the tools only, where they are new.
void Contact::prepare(const Body& body, const Loads& loads, double time, double dt) {
    const std::size_t n = body.vertices();
    if (tree_.nodes.empty()) {
        const auto& x = body.rest.positions;
        std::vector<Box> boxes;
        boxes.reserve(body.rest.triangles.size());
        longest_.clear();
        mean_side_ = 0;
        for (const Triangle& t : body.rest.triangles) {
            const Vector &a = x[t[0]], &b = x[t[1]], &c = x[t[2]];
            boxes.push_back({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
            longest_.push_back(
                std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()})));
            mean_side_ += longest_.back() / double(body.rest.triangles.size());
        }
        tree_ = build_box_tree(boxes);
        candidate_of_.assign(n, no_index), seen_.assign(n, no_index), pinned_.assign(n, false);
        // Pages that are not written to cost nothing.
        candidates_.clear(), candidates_.reserve(n), found_.reserve(n), pairs_.reserve(n), points_.reserve(n);
        report_.vertices.reserve(n);
        tools_.clear();
    }
    tools_.resize(loads.tools.size());
    report_.tools.resize(loads.tools.size());
    for (std::size_t k = 0; k < tools_.size(); ++k) {
        const Tool& tool = loads.tools[k];
        ToolData& data = tools_[k];
        if (data.key != tool.mesh.get() || data.radius != tool.radius || data.length != tool.length ||
            data.probes.centres.empty() != (tool.shape == ToolShape::plane)) {
            data.key = tool.mesh.get(), data.radius = tool.radius, data.length = tool.length;
            data.bound = tool.shape == ToolShape::mesh ? tool.mesh->radius : tool.radius + tool.length / 2;
            data.probes = probes_of(tool, std::max(mean_side_ / 2, data.bound / 64));
            data.probe_tree = build_point_tree(data.probes.centres, 4);
        }
        data.start = data.next = placed(tool, time);
        data.sweep = data.turn = 0;
        const auto leg = [&](const Pose& a, const Pose& b) {
            data.sweep += (b.position - a.position).norm();
            data.turn += a.rotation.angularDistance(b.rotation);
        };
        Pose last = pose_at(tool, time);
        for (const PosePoint& p : tool.path)
            if (p.time > time && p.time < time + dt) leg(last, p.pose), last = p.pose;
        leg(last, pose_at(tool, time + dt));
        data.sweep += data.turn * data.bound;
    }
}

Index Contact::candidate(const Body& body, Index i) {
    if (candidate_of_[i] == no_index) {
        candidate_of_[i] = Index(candidates_.size());
        Candidate& c = candidates_.emplace_back();
        c.vertex = i;
        // Held bodies are damped implicitly: (m + h c) dv = j.
        c.inverse_mass = pinned_[i] ? 0 : 1 / (body.m[i] + (body.free ? 0 : h_ * body.c[i]));
    }
    return candidate_of_[i];
}

/// Vertices and large triangles that may be near a tool, by where they are at rest.
void Contact::find(const Body& body, const Loads& loads, const Motion& motion, double stiffness, double time,
                   double dt, double h) {
    prepare(body, loads, time, dt);
    h_ = h, stiffness_ = stiffness, displacement_ = motion.displacement, last_time_ = -INFINITY;
    touch_ = 2e-7 * body.radius;
    reach_ = 2 * motion.speed * dt + loads.gravity.norm() * dt * dt / 2 +
             std::min(stiffness * dt * dt, 1.0) / 2 * motion.displacement;
    candidates_.clear(), found_.clear(), found_faces_.clear();
    report_.work = 0;
    for (ToolContact& t : report_.tools) t = {};
    for (const Pin& pin : loads.pins)
        for (Index i : pin.vertices) pinned_[i] = true;
    std::array<Index, 128> stack;
    for (Index k = 0; k < tools_.size(); ++k) {
        const ToolData& data = tools_[k];
        const Tool& tool = loads.tools[k];
        // Into the frame of the homes, which is where the tree is.
        const double reach = motion.displacement + reach_ + data.sweep;
        const Vector at = motion.frame.R.transpose() * (data.start.t - motion.frame.t);
        const Eigen::Matrix3d R = motion.frame.R.transpose() * data.start.R;
        const bool plane = tool.shape == ToolShape::plane;
        // Half the size of the box around the tool, turned.
        Vector half = Vector::Constant(data.bound);
        if (tool.shape == ToolShape::capsule)
            half = R.col(2).cwiseAbs() * tool.length / 2 + Vector::Constant(tool.radius);
        const Box box = grown({at - half, at + half}, reach);
        const auto near = [&](const Box& b) {
            if (!plane) return overlap(b, box);
            const Vector n = R.col(2), centre = (b.lower + b.upper) / 2, size = (b.upper - b.lower) / 2;
            const double turned = data.turn * ((centre - at).norm() + size.norm());
            return n.dot(centre - at) - n.cwiseAbs().dot(size) <= reach + turned;
        };
        const double coarse = data.probes.centres.empty() ? std::numeric_limits<double>::infinity()
                                                          : fine_side * data.probes.radius;
        std::size_t top = 0;
        stack[top++] = 0;
        while (top > 0) {
            const BoxTree::Node& node = tree_.nodes[stack[--top]];
            if (!near(node.box)) continue;
            if (node.count == 0) {
                stack[top++] = node.first + 1;
                stack[top++] = node.first;
            }
            for (Index slot = node.first; slot < node.first + node.count; ++slot) {
                const Index t = tree_.items[slot];
                for (Index i : body.rest.triangles[t])
                    if (seen_[i] != k) {
                        seen_[i] = k;
                        found_.push_back({candidate(body, i), k});
                    }
                if (longest_[t] > coarse && near(tree_.boxes[slot])) {
                    for (int side = 0; side < 3; ++side) candidate(body, across(body, t, side));
                    found_faces_.push_back({t, k});
                }
            }
        }
        for (const auto& [c, tool_index] : found_)
            if (tool_index == k) seen_[candidates_[c].vertex] = no_index;
    }
    for (const Pin& pin : loads.pins)
        for (Index i : pin.vertices) pinned_[i] = false;
}

/// Of those the ones that are near where the body is now; the others are left out.
void Contact::narrow(const Body& body, const Loads& loads) {
    pairs_.clear(), faces_.clear();
    for (const auto& [c, k] : found_) {
        const ToolData& data = tools_[k];
        Candidate& candidate = candidates_[c];
        if (candidate.inverse_mass == 0) continue;
        const Vector local = data.start.local(candidate.start);
        double within = reach_ + data.sweep + 2 * touch_;
        if (loads.tools[k].shape == ToolShape::plane) within += data.turn * local.norm();
        const double near = within;
        // Inside a mesh it counts however deep it is.
        const Tool& tool = loads.tools[k];
        if (tool.shape == ToolShape::mesh && overlap(tool.mesh->tree.nodes[0].box, {local, local}))
            within = std::numeric_limits<double>::infinity();
        const double distance = nearest(tool, local, within).distance;
        if (!(distance <= near)) continue;
        candidate.place = 0;
        pairs_.push_back({c, k, distance, local});
    }
    for (const auto& [t, k] : found_faces_) {
        const ToolData& data = tools_[k];
        std::array<Index, 6> corners;
        for (int n = 0; n < 3; ++n) {
            corners[n] = candidate_of_[body.rest.triangles[t][n]];
            corners[n + 3] = candidate_of_[across(body, t, n)];
        }
        const Vector &a = candidates_[corners[0]].start, &b = candidates_[corners[1]].start,
                     &c = candidates_[corners[2]].start;
        const Vector middle = (a + b + c) / 3;
        const double size = std::sqrt(
            std::max({(a - middle).squaredNorm(), (b - middle).squaredNorm(), (c - middle).squaredNorm()}));
        const double within = reach_ + data.sweep + data.probes.radius + 2 * touch_;
        const Vector local = data.start.local(middle);
        for_each_near(data.probe_tree, grown({local, local}, size + within), [&](Index probe) {
            const Vector s = data.start.world(data.probes.centres[probe]);
            const double distance = (nearest_on_triangle(s, a, b, c).point - s).norm();
            if (distance > within) return;
            for (Index corner : corners) candidates_[corner].place = 0;
            faces_.push_back({corners, k, probe, distance - data.probes.radius});
        });
    }
    Index kept = 0;
    for (Candidate& c : candidates_) {
        candidate_of_[c.vertex] = no_index;
        if (c.place != no_index) c.place = kept++;
    }
    for (VertexPair& pair : pairs_) pair.candidate = candidates_[pair.candidate].place;
    for (FacePair& pair : faces_)
        for (Index& corner : pair.corners) corner = candidates_[corner].place;
    for (const Candidate& c : candidates_)
        if (c.place != no_index) candidates_[c.place] = c;
    candidates_.erase(candidates_.begin() + kept, candidates_.end());
}

}  // namespace innerspring
