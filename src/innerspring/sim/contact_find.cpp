#include <algorithm>
#include <cmath>

#include "innerspring/sim/contact.h"

// Which vertices and faces may meet a tool in a step.
namespace innerspring {

namespace {

/// At faces and probes in a step, per face and probe that there are near the tools.
constexpr std::size_t most_looks = 32;

/// What is inside a tool from the beginning is put out at so many body radii a second.
constexpr double put_out_speed = 5;

/// Of a vertex that is no candidate: how many tools may meet it.
constexpr Index unused = no_index - 2, many_tools = no_index - 2, one_tool = no_index - 1;

Box grown(const Box& box, double by) {
    return {box.lower - Vector::Constant(by), box.upper + Vector::Constant(by)};
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

void Contact::reserve(std::size_t n) {
    if (found_.capacity() >= n) return;
    n += n / 4 + 64;
    marks_.resize(2 * n / 64 + 1), pair_at_.resize(n);
    // Pages that are not written to cost nothing.
    candidates_.reserve(n), found_.reserve(n), seen_.reserve(n), seen_before_.reserve(n), pairs_.reserve(n),
        lones_.reserve(n), points_.reserve(n), found_faces_.reserve(2 * n), faces_.reserve(4 * n),
        close_.reserve(4 * n), x_.reserve(7 * n), report_.vertices.reserve(n), steps_.reserve(n);
}

void Contact::adapt(const Body& body, const SurfaceChange& surface, const BodyChange& change) {
    if (trees_.empty()) return;
    innerspring::adapt(trees_, body, surface, change);
    seen_of_.resize(seen_of_.size() + surface.created.size(), no_index);
    for (const auto& [from, to] : change.moved) {
        const Index place = seen_of_[to] = seen_of_[from];
        if (place < seen_.size() && seen_[place].vertex == from) seen_[place].vertex = to;
        seen_of_.pop_back();
    }
    candidate_of_.resize(body.vertices(), no_index), pinned_.resize(body.vertices(), false);
    reserve(body.vertices());
}

/// What depends on the body and the tools only, where they are new.
void Contact::prepare(const Body& body, const Loads& loads, double time, double dt) {
    if (trees_.empty()) {
        build(trees_, body);
        const std::size_t n = body.vertices();
        candidate_of_.assign(n, no_index), seen_of_.assign(n, no_index), pinned_.assign(n, false);
        seen_.clear();
        reserve(n);
    }
    tools_.resize(loads.tools.size());
    report_.tools.resize(loads.tools.size());
    const double spacing = trees_.mean_side() / 2;
    for (std::size_t k = 0; k < tools_.size(); ++k) {
        const Tool& tool = loads.tools[k];
        ToolData& data = tools_[k];
        if (data.key != tool.mesh.get() || data.radius != tool.radius || data.length != tool.length ||
            data.probes.centres.empty() != (tool.shape == ToolShape::plane) ||
            (tool.shape == ToolShape::mesh && data.spacing != spacing)) {
            data.key = tool.mesh.get(), data.radius = tool.radius, data.length = tool.length;
            data.spacing = spacing;
            data.bound = tool.shape == ToolShape::mesh ? tool.mesh->radius : tool.radius + tool.length / 2;
            data.probes = probes_of(tool, std::max(spacing, data.bound / 64));
            data.fine_side = std::numeric_limits<double>::infinity();
            for (double side : data.probes.fine_side) data.fine_side = std::min(data.fine_side, side);
            seen_.clear();
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
        data.still = data.sweep == 0 && data.turn == 0;
        data.sweep += data.turn * data.bound;
    }
}

/// Held bodies are damped implicitly: (m + h c) dv = j.
double Contact::mass(const Body& body, Index i) const {
    return body.m[i] + (body.free ? 0 : h_ * body.c[i]);
}

Index Contact::candidate(const Body& body, Index i) {
    if (candidate_of_[i] >= unused) {
        candidate_of_[i] = Index(candidates_.size());
        Candidate& c = candidates_.emplace_back();
        c.vertex = i;
        c.inverse_mass = pinned_[i] ? 0 : 1 / mass(body, i);
    }
    return candidate_of_[i];
}

/// Vertices and large triangles that may be near a tool, by where they are at rest.
void Contact::find(const Body& body, const Loads& loads, const Motion& motion, double stiffness, double time,
                   double dt, double h) {
    prepare(body, loads, time, dt);
    h_ = h, stiffness_ = stiffness, displacement_ = motion.displacement, last_time_ = -INFINITY;
    long_ = false, touch_ = 2e-7 * body.radius, put_out_ = put_out_speed * body.radius * h;
    reach_ = 2 * motion.speed * dt + loads.gravity.norm() * dt * dt / 2 + motion.share * motion.displacement;
    found_.clear(), found_faces_.clear();
    report_.work = 0;
    for (ToolContact& t : report_.tools) t = {};
    for (Index k = 0; k < tools_.size(); ++k) {
        const ToolData& data = tools_[k];
        const Tool& tool = loads.tools[k];
        // Into the frame of the homes, which is where the trees are.
        const double reach = motion.displacement + reach_ + data.sweep;
        const Vector at = motion.frame.R.transpose() * (data.start.t - motion.frame.t);
        const Eigen::Matrix3d R = motion.frame.R.transpose() * data.start.R;
        const Vector n = R.col(2), axis = n * tool.length / 2;
        const bool plane = tool.shape == ToolShape::plane;
        const double radius = tool.shape == ToolShape::mesh ? data.bound : tool.radius;
        const auto near = [&](const Box& b) {
            const Vector middle = (b.lower + b.upper) / 2 - at, half = (b.upper - b.lower) / 2;
            if (plane)
                return n.dot(middle) - n.cwiseAbs().dot(half) <=
                       reach + data.turn * (middle.norm() + half.norm());
            // From the box grown by the axis of a capsule (a point for others) to the tool's centre.
            const Vector apart = (middle.cwiseAbs() - half - axis.cwiseAbs()).cwiseMax(0);
            return apart.squaredNorm() <= (radius + reach) * (radius + reach);
        };
        for_each_near(trees_.vertices, near, [&](Index i) { mark(i); });
        take_marked([&](Index i) { found_.push_back({i, k}); });
        const double coarse = data.fine_side;
        if (!(trees_.largest > coarse)) continue;
        need_triangles(trees_, body);
        for_each_near(trees_.triangles, near, [&](Index t) {
            if (trees_.longest[t] > coarse) mark(t);
        });
        take_marked([&](Index t) { found_faces_.push_back({t, k}); });
    }
}

/// The distance of a vertex to a mesh [m], any greater one where it is more than `near`. What was seen in the
/// step before bounds it on both sides and so saves most of the search, or all; it does not change the
/// result.
double Contact::to_mesh(const DistanceField& mesh, Index i, Index tool, const Vector& local, double near) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    // Inside the mesh it counts however deep it is.
    double within = overlap(mesh.tree.nodes[0].box, {local, local}) ? infinity : near;
    Index& place = seen_of_[i];
    double least = -infinity;
    NearTriangles few;
    if (place < seen_before_.size() && seen_before_[place].vertex == i && seen_before_[place].tool == tool) {
        const Seen& before = seen_before_[place];
        const double moved = (local - before.local).norm() + 1e-9 * mesh.radius;
        least = before.distance - moved;
        few = before.few;
        if (before.exact) within = std::min(within, std::abs(before.distance) + moved);
    }
    place = Index(seen_.size());
    if (least > near) {
        seen_.push_back({i, tool, false, local, least, few});
        return infinity;
    }
    const Nearest found =
        few.answer(local, within) ? nearest(mesh, few, local, within) : nearest(mesh, local, within);
    const double distance = found.distance;
    const bool exact = distance < infinity;
    // For the sub-steps of this step, and the next steps while it stays near.
    if (exact && distance <= near && !few.answer(local, std::abs(distance) + near))
        few = triangles_near(mesh, local, std::abs(distance) + 2 * near);
    few.begin_with(found.triangle);
    seen_.push_back({i, tool, exact, local, exact ? distance : near, few});
    return distance;
}

/// The probes that may come to the large faces if those move by `reach` [m]; false if that is too much to
/// look at.
bool Contact::find_close(double reach) {
    close_.clear();
    looks_left_ = most_looks * (found_faces_.size() + probes_);
    for (ToolData& data : tools_) data.nearest.assign(data.probes.centres.size(), INFINITY);
    const Vector* x = x_.data() + found_.size();
    for (Index f = 0; f < found_faces_.size() && looks_left_ > 0; ++f, x += 3) {
        const auto& [t, k] = found_faces_[f];
        ToolData& data = tools_[k];
        const Vector &a = x[0], &b = x[1], &c = x[2], middle = (a + b + c) / 3;
        const double size = std::sqrt(
            std::max({(a - middle).squaredNorm(), (b - middle).squaredNorm(), (c - middle).squaredNorm()}));
        const double within = reach + data.sweep + data.probes.radius + 2 * touch_;
        const Vector local = data.start.local(middle);
        const Box box = grown({local, local}, size + within);
        const auto in_box = [&](const Box& other) { return looks_left_ > 0 && overlap(other, box); };
        for_each_near(data.probe_tree, in_box, [&, t = t](Index probe) {
            if (looks_left_ == 0 || trees_.longest[t] <= data.probes.fine_side[probe]) return;
            --looks_left_;
            const Vector s = data.start.world(data.probes.centres[probe]);
            const double distance = (nearest_on_triangle(s, a, b, c).point - s).norm();
            data.nearest[probe] = std::min(data.nearest[probe], distance);
            if (distance <= within) close_.push_back({f, probe, distance});
        });
    }
    return looks_left_ > 0;
}

/// Those become candidates too. Where a fast and stretched body is near many probes it is looked at as far
/// as the work is bounded: what is farther is put out in the next step.
void Contact::narrow_faces(const Body& body) {
    if (found_faces_.empty()) return;
    probes_ = 0;
    for (const ToolData& data : tools_) probes_ += data.probes.centres.size();
    double reach = reach_;
    for (int n = 0; n < 6 && !find_close(reach); ++n) reach /= 4;
    for (const auto& [f, probe, distance] : close_) {
        const auto& [t, k] = found_faces_[f];
        const ToolData& data = tools_[k];
        const Vector* x = &x_[found_.size() + 3 * std::size_t(f)];
        // Only the nearest faces put out what is below them.
        const bool first = distance <= data.nearest[probe] + 2 * touch_;
        FacePair pair{{},
                      k,
                      probe,
                      distance - data.probes.radius,
                      first ? std::max(data.probes.radius, trees_.longest[t] / 5) : 0};
        for (int n = 0; n < 3; ++n) {
            pair.corners[n] = candidate(body, body.rest.triangles[t][n]);
            candidates_[pair.corners[n]].start = x[n];
            pair.corners[n + 3] = candidate(body, across(body, t, n));
        }
        faces_.push_back(pair);
    }
}

/// Of those the ones that are near where the body is now become candidates, or if nothing else can meet them
/// and they may, lone.
void Contact::narrow(const Body& body, const Loads& loads, bool alone, std::span<const Index> places) {
    candidates_.clear(), pairs_.clear(), lones_.clear(), faces_.clear();
    seen_before_.swap(seen_);
    seen_.clear();
    for (const Pin& pin : loads.pins)
        for (Index i : pin.vertices) pinned_[i] = true;
    for (Index n = 0; n < found_.size(); ++n) {
        const auto& [i, k] = found_[n];
        const Tool& tool = loads.tools[k];
        const ToolData& data = tools_[k];
        const Vector local = data.start.local(x_[n]);
        double near = reach_ + data.sweep + 2 * touch_;
        if (tool.shape == ToolShape::plane && data.turn > 0) near += data.turn * local.norm();
        const double distance = tool.shape == ToolShape::mesh ? to_mesh(*tool.mesh, i, k, local, near)
                                                              : nearest(tool, local).distance;
        if (!(distance <= near) || pinned_[i]) continue;
        pairs_.push_back({{k, seen_of_[i], distance, local}, n});
        candidate_of_[i] = candidate_of_[i] == no_index ? one_tool : many_tools;
    }
    narrow_faces(body);
    const auto place_of = [&](Index i) { return places.empty() ? i : places[i]; };
    std::size_t coupled = 0;
    Index tool = 0;
    const auto take_lones = [&] {
        take_marked([&](Index place) {
            const VertexPair& pair = pairs_[pair_at_[place]];
            const Index i = found_[pair.candidate][0];
            const double m = mass(body, i);
            lones_.push_back({pair, i, place, m, 1 / m, body.rest.positions[i]});
        });
    };
    for (Index p = 0; p < pairs_.size(); ++p) {
        const VertexPair& pair = pairs_[p];
        const Index i = found_[pair.candidate][0];
        if (pair.tool != tool) take_lones(), tool = pair.tool;
        if (alone && candidate_of_[i] == one_tool) {
            const Index place = place_of(i);
            candidate_of_[i] = no_index;
            if (place >= pair_at_.size()) pair_at_.resize(place + 1);
            pair_at_[place] = p;
            mark(place);
            continue;
        }
        candidates_[candidate(body, i)].start = x_[pair.candidate];
    }
    take_lones();
    for (const VertexPair& pair : pairs_) {
        const Index n = pair.candidate, c = candidate_of_[found_[n][0]];
        if (c >= unused) continue;  // lone
        pairs_[coupled] = pair;
        pairs_[coupled++].candidate = c;
    }
    pairs_.erase(pairs_.begin() + std::ptrdiff_t(coupled), pairs_.end());
    for (Candidate& c : candidates_) c.at = place_of(c.vertex), c.home = body.rest.positions[c.vertex];
    report_.looked_at = pairs_.size() + lones_.size() + faces_.size();
    for (const Candidate& c : candidates_) candidate_of_[c.vertex] = no_index;
    for (const Pin& pin : loads.pins)
        for (Index i : pin.vertices) pinned_[i] = false;
}

}  // namespace innerspring
