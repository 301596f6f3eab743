#include <cmath>

#include "plain.h"

void plain_step(PlainBody& body, double dt) {
    for (PlainPoint& p : body.points)
        for (int i = 0; i < 3; ++i) p.f[i] = p.m * body.gravity[i] - p.K * (p.x[i] - p.home[i]);
    for (const PlainLoad& load : body.loads)
        for (int i = 0; i < 3; ++i) body.points[load.vertex].f[i] += load.f[i];
    for (const PlainLink& link : body.links) {
        PlainPoint &a = body.points[link.a], &b = body.points[link.b];
        const double dx = b.x[0] - a.x[0], dy = b.x[1] - a.x[1], dz = b.x[2] - a.x[2];
        const double length = std::sqrt(dx * dx + dy * dy + dz * dz);
        const double s = link.k * (1 - link.rest / length);
        a.f[0] += s * dx, a.f[1] += s * dy, a.f[2] += s * dz;
        b.f[0] -= s * dx, b.f[1] -= s * dy, b.f[2] -= s * dz;
    }
    for (PlainPoint& p : body.points) {
        const double damp = 1 / (1 + dt * p.c / p.m), push = dt / p.m;
        for (int i = 0; i < 3; ++i) {
            p.v[i] = (p.v[i] + push * p.f[i]) * damp;
            p.x[i] += dt * p.v[i];
        }
    }
}
