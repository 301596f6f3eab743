#include "innerspring/sim/kernel.h"

#include <Eigen/Cholesky>

namespace innerspring {

namespace {

/// False for NaN, infinities, and what is about to overflow.
bool finite(const Vector& x, const Vector& v) {
    return x.squaredNorm() + v.squaredNorm() < 1e200;
}

/// x' = x + h v', if x_out is given. False if the vertex left the numbers.
bool moved(const KernelStep& s, std::size_t i) {
    const Vector x = s.x[i] + s.h * s.v_out[i];
    if (s.x_out) s.x_out[i] = x;
    return finite(x, s.v_out[i]);
}

template <bool Held>
Vector velocity_after(const KernelStep& s, std::size_t i) {
    const Body& b = s.body;
    const Vector home = Held ? b.rest.positions[i] : Vector(s.frame.R * b.rest.positions[i] + s.frame.t);
    Vector F = surface_force(b, s.x, i) + inner_force(b, s.frame, i, s.x[i] - home);
    if (s.external) F += s.external[i];
    return s.v[i] + s.h * (F / b.m[i] + s.gravity);
}

}  // namespace

Index advance_held(const KernelStep& s, std::size_t first, std::size_t last) {
    Index bad = no_index;
    for (std::size_t i = first; i < last; ++i) {
        s.v_out[i] = velocity_after<true>(s, i) / (1 + s.h * s.body.c[i] / s.body.m[i]);
        if (!moved(s, i) && bad == no_index) bad = Index(i);
    }
    return bad;
}

Index accelerate(const KernelStep& s, std::size_t first, std::size_t last) {
    Index bad = no_index;
    for (std::size_t i = first; i < last; ++i) {
        s.v_out[i] = velocity_after<false>(s, i);
        if (!finite(s.v_out[i], s.v_out[i]) && bad == no_index) bad = Index(i);
    }
    return bad;
}

Index damp_and_move(const KernelStep& s, const RigidMotion& home, std::size_t first, std::size_t last) {
    Index bad = no_index;
    for (std::size_t i = first; i < last; ++i) {
        const Vector v_home = home.linear + home.angular.cross(s.x[i] - home.centre);
        s.v_out[i] = v_home + (s.v_out[i] - v_home) / (1 + s.h * s.body.c[i] / s.body.m[i]);
        if (!moved(s, i) && bad == no_index) bad = Index(i);
    }
    return bad;
}

void Moments::add(double weight, const Vector& r, const Vector& velocity) {
    w += weight;
    x += weight * r;
    v += weight * velocity;
    xv += weight * r.cross(velocity);
    xx += weight * r * r.transpose();
}

Moments& Moments::operator+=(const Moments& other) {
    w += other.w, x += other.x, v += other.v, xv += other.xv, xx += other.xx;
    return *this;
}

RigidMotion rigid_motion(const Moments& m) {
    RigidMotion motion;
    if (!(m.w > 0)) return motion;
    motion.centre = m.x / m.w;
    motion.linear = m.v / m.w;
    const Vector spin = m.xv - motion.centre.cross(m.v);  // sum w r x v about the weighted mean
    const Eigen::Matrix3d spread = m.xx - m.w * motion.centre * motion.centre.transpose();
    const Eigen::Matrix3d inertia = spread.trace() * Eigen::Matrix3d::Identity() - spread;
    motion.angular = inertia.ldlt().solve(spin);
    if (!motion.angular.allFinite()) motion.angular.setZero();
    return motion;
}

RigidMotion rigid_fit(const Body& body, double h, const Vector* x, const Vector* v, Team& team) {
    const std::size_t n = body.vertices();
    const Vector x0 = x[0];
    std::vector<Moments> blocks(block_count(n));
    team.run(blocks.size(), [&](std::size_t block) {
        for (std::size_t i = block * block_size; i < std::min(n, (block + 1) * block_size); ++i)
            blocks[block].add(body.c[i] / (1 + h * body.c[i] / body.m[i]), x[i] - x0, v[i]);
    });
    Moments total;
    for (const Moments& b : blocks) total += b;
    RigidMotion motion = rigid_motion(total);
    motion.centre += x0;
    return motion;
}

}  // namespace innerspring
