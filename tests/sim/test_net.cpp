#include "innerspring/sim/net.h"
#include "innerspring/sim/settle.h"

#include <gtest/gtest.h>

#include "support/bodies.h"

namespace innerspring {
namespace {

using namespace support;

struct Placed {
    Body body;
    std::vector<Vector> x, z;
    std::vector<double> d;
    std::vector<bool> pinned;
};

Placed placed(const char* shape) {
    Placed p{make_body(shape, {.surface = 3}), {}, {}, {}, {}};
    Random random(4);
    for (const Vector& q : p.body.rest.positions) {
        p.x.push_back(q + 0.05 * random_vector(random));
        p.z.push_back(q + 0.05 * random_vector(random));
        p.d.push_back(random.uniform(0.5, 2));
        p.pinned.push_back(random.bits() % 7 == 0);
    }
    p.x[5] = p.x[p.body.spokes_of(5).front().neighbour];  // a spring of no length
    return p;
}

// Law 7: the gradient is that of the value; and its square is what is said.
TEST(Net, GradientIsThatOfTheValue) {
    Placed p = placed("organ:vertices=700");
    p.x[5] = p.body.rest.positions[5];
    Team team(1);
    Net net(p.body);
    std::vector<Vector> g(p.x.size()), other(p.x.size());
    const Net::Value value = net.evaluate(p.x, p.d, p.z, p.pinned, g, team);
    double square = 0;
    for (const Vector& v : g) square += v.squaredNorm();
    EXPECT_NEAR(value.gradient2, square, 1e-12 * square);
    Random random(8);
    for (int sample = 0; sample < 30; ++sample) {
        const std::size_t i = random.bits() % p.x.size();
        if (p.pinned[i]) {
            EXPECT_EQ(g[i], Vector(Vector::Zero()));
            continue;
        }
        for (int axis = 0; axis < 3; ++axis) {
            const double at = p.x[i][axis], by = 1e-6;
            p.x[i][axis] = at + by;
            const double above = net.evaluate(p.x, p.d, p.z, p.pinned, other, team).total();
            p.x[i][axis] = at - by;
            const double below = net.evaluate(p.x, p.d, p.z, p.pinned, other, team).total();
            p.x[i][axis] = at;
            EXPECT_NEAR((above - below) / (2 * by), g[i][axis], 1e-6 * g[i].norm() + 1e-8);
        }
    }
}

TEST(Net, EveryKernelGivesTheSameBits) {
    for (const char* shape : {"icosphere:vertices=12", "organ:vertices=700", "torus:vertices=301"}) {
        const Placed p = placed(shape);
        const Body& body = p.body;
        std::vector<NetRow> rows;
        std::vector<NetSpoke> spokes;
        for (std::size_t i = 0; i < body.vertices(); ++i) {
            rows.push_back({std::uint32_t(spokes.size()), std::uint32_t(body.spokes_of(i).size())});
            for (const Spoke& s : body.spokes_of(i)) spokes.push_back({s.neighbour, s.edge});
        }
        std::vector<double> first_s, first_sums;
        std::vector<Vector> first_g;
        for (const VectorKernels* kernels : vector_kernels()) {
            std::vector<double> s(body.k.size());
            std::vector<Vector> g(body.vertices());
            const NetPass pass{&body.edges.front().a,
                               body.k.data(),
                               body.rest_length.data(),
                               s.data(),
                               rows.data(),
                               spokes.data(),
                               p.x.front().data(),
                               p.z.front().data(),
                               p.d.data(),
                               g.front().data()};
            NetSums sums;
            const double energy =
                kernels->stretch(pass, 0, s.size() - 1) + kernels->stretch(pass, s.size() - 1, s.size());
            kernels->pull(pass, 0, g.size(), sums);
            std::vector<double> all{energy};
            all.insert(all.end(), sums.places, sums.places + 3);
            all.insert(all.end(), sums.gradient2, sums.gradient2 + 3);
            if (first_s.empty()) first_s = s, first_g = g, first_sums = all;
            EXPECT_EQ(s, first_s) << kernels->name;
            EXPECT_EQ(g, first_g) << kernels->name;
            EXPECT_EQ(all, first_sums) << kernels->name;
        }
    }
}

// Vertices that move side by side are no neighbours, or wider vectors would see other places; and where
// nothing moves any more the gradient is zero.
TEST(Net, SettlingEndsWhereForcesBalanceWithTheSameBitsFromEveryKernel) {
    for (const char* shape : {"icosphere:vertices=12", "organ:vertices=700", "torus:vertices=301"}) {
        const Placed p = placed(shape);
        std::vector<Index> moving;
        for (Index i = 0; i < p.x.size(); ++i)
            if (!p.pinned[i]) moving.push_back(i);
        const Settling settling(p.body, moving, p.d, p.z);
        EXPECT_LE(settling.colours(), 10u);
        std::vector<Vector> first;
        for (const VectorKernels* kernels : vector_kernels()) {
            std::vector<Vector> x = p.x;
            for (int sweep = 0; sweep < 7; ++sweep) settling.sweep(*kernels, x, sweep % 2 == 1);
            if (first.empty()) first = x;
            EXPECT_EQ(x, first) << kernels->name;
            for (std::size_t i = 0; i < x.size(); ++i) {
                if (p.pinned[i]) {
                    ASSERT_EQ(x[i], p.x[i]);
                }
            }
        }
        Team team(1);
        Net net(p.body);
        std::vector<Vector> g(p.x.size()), x = p.x;
        const Net::Value before = net.evaluate(x, p.d, p.z, p.pinned, g, team);
        for (int sweep = 0; sweep < 1000; ++sweep)
            settling.sweep(*vector_kernels().front(), x, sweep % 2 == 1);
        const Net::Value after = net.evaluate(x, p.d, p.z, p.pinned, g, team);
        EXPECT_LT(after.total(), before.total());
        EXPECT_LT(after.gradient2, 1e-16 * before.gradient2) << shape;
    }
}

}  // namespace
}  // namespace innerspring
