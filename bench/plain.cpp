#include "plain.h"

#include <memory>

#include "peers.h"

namespace innerspring {

Peer plain_loop(const Body& body, const Loads& loads, double dt) {
    auto plain = std::make_shared<PlainBody>();
    for (std::size_t i = 0; i < body.vertices(); ++i) {
        const Vector& q = body.rest.positions[i];
        plain->points.push_back(
            {{q[0], q[1], q[2]}, {}, {}, {q[0], q[1], q[2]}, body.m[i], body.K[i], body.c[i]});
    }
    for (std::size_t e = 0; e < body.edges.size(); ++e)
        plain->links.push_back({body.edges[e].a, body.edges[e].b, body.k[e], body.rest_length[e]});
    for (const Force& force : loads.forces)
        for (std::size_t n = 0; n < force.vertices.size(); ++n) {
            const Vector f = force.weights[n] * force.newton;
            plain->loads.push_back({force.vertices[n], {f[0], f[1], f[2]}});
        }
    for (int i = 0; i < 3; ++i) plain->gravity[i] = loads.gravity[i];
    return {"plain loop", 1,
            [=](int steps) {
                for (int n = 0; n < steps; ++n) plain_step(*plain, dt);
            },
            [=] {
                std::vector<Vector> x;
                for (const PlainPoint& p : plain->points) x.emplace_back(p.x[0], p.x[1], p.x[2]);
                return x;
            },
            true};
}

}  // namespace innerspring
