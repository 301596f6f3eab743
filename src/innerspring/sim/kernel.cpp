#include "innerspring/sim/kernel.h"

#include <Eigen/Cholesky>

namespace innerspring {

namespace {

/// False for NaN, infinities, and what is about to overflow.
bool finite(const Vector& x, const Vector& v) {
    return x.squaredNorm() + v.squaredNorm() < 1e200;
}

template <bool Held>
Vector velocity_after(const KernelStep& s, std::size_t i) {
    const Body& b = s.body;
    const Vector home = Held ? b.rest.positions[i] : Vector(s.frame.R * b.rest.positions[i] + s.frame.t);
    Vector F = surface_force(b, s.x, i) - b.K[i] * (s.x[i] - home);
    if (s.external) F += s.external[i];
    return s.v[i] + s.h * (F / b.m[i] + s.gravity);
}

}  // namespace

Index advance_held(const KernelStep& s, std::size_t first, std::size_t last) {
    Index bad = no_index;
    for (std::size_t i = first; i < last; ++i) {
        s.v_out[i] = velocity_after<true>(s, i) / (1 + s.h * s.body.c[i] / s.body.m[i]);
        s.x_out[i] = s.x[i] + s.h * s.v_out[i];
        if (!finite(s.x_out[i], s.v_out[i]) && bad == no_index) bad = Index(i);
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
        s.x_out[i] = s.x[i] + s.h * s.v_out[i];
        if (!finite(s.x_out[i], s.v_out[i]) && bad == no_index) bad = Index(i);
    }
    return bad;
}

RigidMotion rigid_fit(const Body& body, double h, const Vector* x, const Vector* v, Team& team) {
    struct Sums {
        double w = 0;
        Vector x = Vector::Zero(), v = Vector::Zero(), xv = Vector::Zero();  // xv: sum of w x cross v
        Eigen::Matrix3d xx = Eigen::Matrix3d::Zero();
    };
    const std::size_t n = body.vertices();
    const Vector x0 = x[0];
    std::vector<Sums> blocks(block_count(n));
    team.run(blocks.size(), [&](std::size_t block) {
        Sums& sum = blocks[block];
        for (std::size_t i = block * block_size; i < std::min(n, (block + 1) * block_size); ++i) {
            const double w = body.c[i] / (1 + h * body.c[i] / body.m[i]);
            const Vector r = x[i] - x0;
            sum.w += w;
            sum.x += w * r;
            sum.v += w * v[i];
            sum.xv += w * r.cross(v[i]);
            sum.xx += w * r * r.transpose();
        }
    });
    Sums total;
    for (const Sums& b : blocks)
        total.w += b.w, total.x += b.x, total.v += b.v, total.xv += b.xv, total.xx += b.xx;
    RigidMotion motion;
    if (!(total.w > 0)) return motion;
    const Vector centre = total.x / total.w;
    motion.centre = x0 + centre;
    motion.linear = total.v / total.w;
    const Vector spin = total.xv - centre.cross(total.v);  // sum w r x v about the weighted mean
    const Eigen::Matrix3d spread = total.xx - total.w * centre * centre.transpose();  // sum w r r^T about it
    const Eigen::Matrix3d inertia = spread.trace() * Eigen::Matrix3d::Identity() - spread;
    motion.angular = inertia.ldlt().solve(spin);
    if (!motion.angular.allFinite())
        motion.angular.setZero();  // all mass on a line: no rotation is determined, none is damped
    return motion;
}

}  // namespace innerspring
