// Bullet's soft body on the same mesh, as somebody would set it up who wants our body from it.
//
// What is fair: one position iteration, the least Bullet takes; Debian's build, in single precision; a
// collision mask of 0 and nothing else in the world, so that no contacts are looked for. The whole step of
// the world is timed, as nobody can run less of it: besides the solver that is the tree of its nodes, which
// it updates each step, and the bounding box.
//
// A body that btSoftBodyHelpers::CreateFromTriMesh makes has faces, whose normals each step computes, and
// links in random order, which its users ask for by default as the solver goes from link to link. That is
// what we compare with. "Bare" is the least that can be done by hand: no faces, links in the order of
// vertices.
//
// Its stiffnesses are shares of an error that one iteration takes away. A spring k moves its ends by
// k dt^2 (1/m_a + 1/m_b) of its stretch in one explicit step, so that is the share that means the same; one
// material for all links, with the mean, as is usual. The time of a step does not depend on them.
#include "peers.h"

#ifdef INNERSPRING_BENCH_BULLET
#include <BulletSoftBody/btDefaultSoftBodySolver.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <memory>
#include <span>

namespace innerspring {

namespace {

btVector3 to_bullet(const Vector& v) {
    return {btScalar(v[0]), btScalar(v[1]), btScalar(v[2])};
}

/// Destroyed from the last member to the first.
struct World {
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btSoftRigidDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
    btEmptyShape nothing;
    btRigidBody ground{btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &nothing)};  // mass 0: static
    std::unique_ptr<btSoftBody> soft;
    std::vector<std::pair<int, btVector3>> loads;

    ~World() { world.removeSoftBody(soft.get()); }
};

/// Means over the vertices or edges of what one step should do.
struct Shares {
    double link = 0, inner = 0, damping = 0;
};

Shares shares(const Body& body, double dt) {
    Shares s;
    for (std::size_t e = 0; e < body.edges.size(); ++e)
        s.link += body.k[e] * dt * dt * (1 / body.m[body.edges[e].a] + 1 / body.m[body.edges[e].b]);
    s.link = std::min(1.0, s.link / double(body.edges.size()));
    for (std::size_t i = 0; i < body.vertices(); ++i) {
        s.inner += body.K[i] * dt * dt / body.m[i];
        s.damping += body.c[i] * dt / body.m[i];
    }
    s.inner = std::min(1.0, s.inner / double(body.vertices()));
    s.damping = std::min(1.0, s.damping / double(body.vertices()));
    return s;
}

/// Nodes, links and faces one by one: the helper finds the links with a table of V x V flags, 27 GB at
/// 163 842 vertices.
std::shared_ptr<World> make_world(const Body& body, const Loads& loads, const Shares& s, bool bare,
                                  std::span<const Index> fixed = {}) {
    auto w = std::make_shared<World>();
    w->world.setGravity(to_bullet(loads.gravity));
    btSoftBodyWorldInfo& info = w->world.getWorldInfo();
    info.m_gravity = to_bullet(loads.gravity);
    info.air_density = 0;
    std::vector<btVector3> x;
    std::vector<btScalar> m;
    for (std::size_t i = 0; i < body.vertices(); ++i) {
        x.push_back(to_bullet(body.rest.positions[i]));
        m.push_back(btScalar(body.m[i]));
    }
    for (Index i : fixed) m[i] = 0;  // Bullet's word for what does not move
    w->soft = std::make_unique<btSoftBody>(&info, int(x.size()), x.data(), m.data());
    btSoftBody& soft = *w->soft;
    soft.m_materials[0]->m_kLST = btScalar(s.link);
    for (const Edge& edge : body.edges) soft.appendLink(int(edge.a), int(edge.b), soft.m_materials[0]);
    if (!bare) {
        for (const Triangle& t : body.rest.triangles) soft.appendFace(int(t[0]), int(t[1]), int(t[2]));
        soft.randomizeConstraints();
    }
    soft.m_cfg.piterations = 1;
    soft.m_cfg.collisions = 0;
    soft.setActivationState(DISABLE_DEACTIVATION);
    w->world.addSoftBody(&soft, btBroadphaseProxy::DefaultFilter, 0);
    for (const Force& force : loads.forces)
        for (std::size_t n = 0; n < force.vertices.size(); ++n)
            w->loads.emplace_back(int(force.vertices[n]), to_bullet(force.weights[n] * force.newton));
    return w;
}

Peer peer(const char* what, std::shared_ptr<World> w, double dt) {
    return {what, 1,
            [w, dt](int steps) {
                for (int n = 0; n < steps; ++n) {
                    for (const auto& [node, force] : w->loads) w->soft->addForce(force, node);
                    w->world.stepSimulation(btScalar(dt), 0);  // 0: one step of dt
                }
            },
            [w] {
                std::vector<Vector> x;
                for (int i = 0; i < w->soft->m_nodes.size(); ++i) {
                    const btVector3& p = w->soft->m_nodes[i].m_x;
                    x.emplace_back(p.x(), p.y(), p.z());
                }
                return x;
            }};
}

/// Every vertex tied to its home, a place on a static body. An anchor takes `influence` of the velocity and,
/// times kAHR, of the distance: our damper and our inner spring.
Peer anchored(const Body& body, const Loads& loads, double dt, bool bare) {
    const Shares s = shares(body, dt);
    auto w = make_world(body, loads, s, bare);
    w->soft->m_cfg.kAHR = btScalar(std::min(1.0, s.inner / s.damping));
    for (int i = 0; i < int(body.vertices()); ++i)
        w->soft->appendAnchor(i, &w->ground, false, btScalar(s.damping));
    return peer(bare ? "Bullet, anchors, bare" : "Bullet, anchors", w, dt);
}

/// Every vertex drawn to its place in the rest shape, which follows the body. That alone would fall, ever
/// faster and farther from where floats are dense, so it hangs from a patch at the top.
Peer pose_matched(const Body& body, const Loads& loads, double dt) {
    const auto& q = body.rest.positions;
    const auto top = std::ranges::max_element(q, {}, [](const Vector& p) { return p.y(); });
    const Shares s = shares(body, dt);
    auto w =
        make_world(body, loads, s, false, vertices_around(body, Index(top - q.begin()), 0.4 * body.radius));
    w->soft->m_cfg.kMT = btScalar(s.inner);
    w->soft->setPose(false, true);
    return peer("Bullet, pose matching", w, dt);
}

}  // namespace

std::vector<Peer> bullet(const Body& body, const Loads& loads, double dt) {
    return {anchored(body, loads, dt, false), anchored(body, loads, dt, true), pose_matched(body, loads, dt)};
}

}  // namespace innerspring

#else

std::vector<innerspring::Peer> innerspring::bullet(const Body&, const Loads&, double) {
    return {};
}

#endif
