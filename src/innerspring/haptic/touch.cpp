#include "innerspring/haptic/touch.h"

#include <algorithm>
#include <cmath>

#include "innerspring/sim/forces.h"

namespace innerspring {

namespace {

/// How a surface spring answers a motion of one end along n [N/m].
double along(const Spoke& spoke, const Vector& d, const Vector& n) {
    const double length = d.norm();
    if (!(length > 0)) return spoke.k;
    const double cosine = n.dot(d) / length, c2 = cosine * cosine;
    return spoke.k * (c2 + std::max(0.0, 1 - spoke.rest / length) * (1 - c2));
}

}  // namespace

/// The rings around the contact and the springs among them.
void TouchFinder::gather(const Body& body, const State& state, const Vector& n) {
    HomeFrame frame;
    if (!body.N.empty()) {
        Team alone(1);
        frame = home_frame(body, state.x, alone);
    }
    const std::size_t contact = patch_.size();
    for (std::size_t begin = 0, ring = 0; ring < rings; ++ring) {
        const std::size_t end = patch_.size();
        for (std::size_t p = begin; p < end; ++p)
            for (const Spoke& spoke : body.spokes_of(patch_[p]))
                if (place_[spoke.neighbour] == no_index && patch_.size() < contact + most) {
                    place_[spoke.neighbour] = Index(patch_.size());
                    patch_.push_back(spoke.neighbour);
                }
        begin = end;
    }
    u_.resize(patch_.size(), 0), moved_.resize(patch_.size(), false);
    diagonal_.clear(), entries_.clear(), first_.clear();
    for (const Index i : patch_) {
        first_.push_back(Index(entries_.size()));
        double diagonal = body.N.empty() ? body.K[i] : -n.dot(inner_force(body, frame, i, n));
        for (const Spoke& spoke : body.spokes_of(i)) {
            const double h = along(spoke, state.x[spoke.neighbour] - state.x[i], n);
            diagonal += h;
            if (const Index place = place_[spoke.neighbour]; place != no_index)
                entries_.emplace_back(place, h);
        }
        diagonal_.push_back(diagonal);
    }
    first_.push_back(Index(entries_.size()));
}

/// A u = load where nothing is prescribed: successive over-relaxation.
void TouchFinder::relax() {
    constexpr double over = 1.4;
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (std::size_t p = 0; p < patch_.size(); ++p) {
            if (moved_[p]) continue;
            double sum = load_[p];
            for (Index e = first_[p]; e < first_[p + 1]; ++e)
                sum += entries_[e].second * u_[entries_[e].first];
            u_[p] += over * (sum / diagonal_[p] - u_[p]);
        }
}

void TouchFinder::adapt(const Transfer& transfer) {
    std::erase_if(pressed_, [&](const Pressed& p) {
        return std::ranges::any_of(transfer.surface.retired,
                                   [&](const auto& gone) { return gone.vertex == p.vertex; });
    });
    for (const auto& [from, to] : transfer.body.moved)
        for (Pressed& p : pressed_)
            if (p.vertex == from) p.vertex = to;
}

Touch TouchFinder::find(const Body& body, const State& state, const ContactReport& report, const Tool& tool,
                        std::size_t index, const Vector& gravity) {
    Touch touch;
    if (index >= report.tools.size()) return touch;
    const Pose pose = pose_at(tool, state.time);
    const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
    place_.resize(body.vertices(), no_index), new_normal_.resize(body.vertices(), 0);
    patch_.clear();
    const auto longest_at = [&](Index i) {
        double longest = 0;
        for (const Spoke& spoke : body.spokes_of(i)) longest = std::max(longest, spoke.rest);
        return longest;
    };
    const auto near_tool = [&](Index i) {
        return nearest(tool, R.transpose() * (state.x[i] - pose.position), 2 * longest_at(i));
    };

    // Where this tool presses, and how: with friction the force leans, the pressure does not.
    Vector pressure = Vector::Zero(), point = Vector::Zero();
    for (const VertexContact& c : report.vertices) {
        const Nearest near = near_tool(c.vertex);
        if (!(c.normal > 0) || !(near.distance < longest_at(c.vertex))) continue;
        new_normal_[c.vertex] = c.normal;
        pressure -= c.normal * (R * near.normal);
    }
    const Vector& force = report.tools[index].force;
    if (!force.allFinite()) return touch;
    force_ = keep * force_ + (1 - keep) * (tool.friction > 0 ? pressure : force);
    double total = 0;
    for (Pressed& p : pressed_) {
        p.normal = keep * p.normal + (1 - keep) * new_normal_[p.vertex];
        new_normal_[p.vertex] = 0;
        total += p.normal;
    }
    for (const VertexContact& c : report.vertices)
        if (double& normal = new_normal_[c.vertex]; normal > 0) {
            pressed_.push_back({c.vertex, (1 - keep) * normal});
            total += pressed_.back().normal;
            normal = 0;
        }
    std::erase_if(pressed_, [&](const Pressed& p) {
        return !(p.normal * double(pressed_.size()) > 1e-3 * total) ||
               !(near_tool(p.vertex).distance < longest_at(p.vertex));
    });
    total = 0;
    for (const Pressed& p : pressed_) total += p.normal, point += p.normal * state.x[p.vertex];
    const double size = force_.norm();
    if (!(total > 0) || !(size > 0) || !point.allFinite()) return touch;
    touch.normal = force_ / size;
    touch.point = point / total;
    touch.force = body.free ? force_.dot(touch.normal) : 0;

    double corners = 0;  // share of the force
    moved_.clear(), share_.clear(), u_.clear();
    for (const Pressed& c : pressed_) {
        const Nearest near = near_tool(c.vertex);
        const bool on = near.distance < 1e-2 * longest_at(c.vertex);
        place_[c.vertex] = Index(patch_.size());
        patch_.push_back(c.vertex);
        moved_.push_back(on);
        share_.push_back(on ? 0 : c.normal);
        u_.push_back(on ? std::abs((R * near.normal).dot(touch.normal)) : 0);
        if (!on) corners += c.normal;
        if (!body.free) {
            const std::size_t i = c.vertex;
            const Vector springs = surface_force(body, state.x.data(), i) +
                                   inner_force(body, {}, i, state.x[i] - body.rest.positions[i]) +
                                   body.m[i] * gravity;
            touch.force += springs.dot(touch.normal);
        }
    }
    gather(body, state, touch.normal);
    load_.assign(patch_.size(), 0);
    const auto mean = [&] {
        double m = 0;
        for (std::size_t p = 0; p < share_.size(); ++p) m += share_[p] * u_[p];
        return m / corners;
    };
    relax();
    if (corners > 0) {
        first_u_ = u_;
        const double with_it = mean();
        for (std::size_t p = 0; p < u_.size(); ++p) u_[p] = 0;
        for (std::size_t p = 0; p < share_.size(); ++p) load_[p] = share_[p] / corners;
        relax();
        const double yields = mean(), factor = yields > 0 ? (1 - with_it) / yields : 0;
        for (std::size_t p = 0; p < u_.size(); ++p) u_[p] = first_u_[p] + factor * u_[p];
    }
    for (std::size_t p = 0; p < u_.size(); ++p) {  // k = u . A u, which is the formula above
        double sum = diagonal_[p] * u_[p];
        for (Index e = first_[p]; e < first_[p + 1]; ++e) sum -= entries_[e].second * u_[entries_[e].first];
        touch.stiffness += u_[p] * sum;
        touch.damping += body.c[patch_[p]] * u_[p] * u_[p];
    }
    for (const Index vertex : patch_) place_[vertex] = no_index;
    touch.touching = touch.stiffness > 0 && touch.force > 0 && std::isfinite(touch.stiffness);
    return touch;
}

}  // namespace innerspring
