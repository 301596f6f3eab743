#include "innerspring/sim/factor.h"

#include <gtest/gtest.h>

#include "innerspring/sim/refine.h"
#include "support/bodies.h"

namespace innerspring {
namespace {

using namespace support;

std::vector<double> diagonal(const Body& body, double h) {
    std::vector<double> d(body.vertices());
    for (std::size_t i = 0; i < d.size(); ++i) d[i] = body.m[i] / (h * h) + body.c[i] / h + body.K[i];
    return d;
}

std::vector<Vector> random_field(std::size_t n, std::uint64_t seed) {
    Random random(seed);
    std::vector<Vector> field(n);
    for (Vector& v : field) v = random_vector(random);
    return field;
}

/// |b - A x| / |b|, from the springs themselves.
double left_over(const Body& body, const std::vector<double>& d, const std::vector<bool>& pinned,
                 const std::vector<Vector>& b, const std::vector<Vector>& x) {
    double left = 0, all = 0;
    for (std::size_t i = 0; i < b.size(); ++i) {
        Vector r = b[i] - (pinned[i] ? x[i] : Vector(d[i] * x[i]));
        if (!pinned[i])
            for (const Spoke& s : body.spokes_of(i))
                r -= s.k * (x[i] - (pinned[s.neighbour] ? Vector(Vector::Zero()) : x[s.neighbour]));
        left += r.squaredNorm(), all += b[i].squaredNorm();
    }
    return std::sqrt(left / all);
}

/// What rounding leaves grows with the condition of the matrix, which goes as the springs' stiffness.
double allowed(const Factor& factor, double surface) {
    return (factor.in_float() ? 3e-5 : 3e-11) * std::max(1.0, surface < 1e8 ? surface / 3e4 : surface / 1e7);
}

TEST(Factor, SolvesWhatTheSpringsSay) {
    Random random(5);
    for (const char* shape : {"icosphere:vertices=12", "sphere:vertices=700,irregularity=5,seed=2",
                              "organ:vertices=500", "torus:vertices=600", "plate:vertices=400"})
        for (double surface : {0.0, 1.0, 100.0, 1e6, 1e10})
            for (bool pins : {false, true}) {
                const Body body = make_body(shape, {.surface = surface});
                const auto d = diagonal(body, 1e-3);
                std::vector<bool> pinned(body.vertices(), false);
                if (pins)
                    for (int k = 0; k < 5; ++k) pinned[random.bits() % body.vertices()] = true;
                Factor factor(body);
                factor.factorize(body, d, pinned);
                auto b = random_field(body.vertices(), 7);
                for (std::size_t i = 0; i < b.size(); ++i)
                    if (pinned[i]) b[i].setZero();
                std::vector<Vector> x(body.vertices());
                factor.solve(b.data(), x.data());
                for (std::size_t i = 0; i < b.size(); ++i)
                    if (pinned[i]) {
                        ASSERT_EQ(x[i], Vector(Vector::Zero()));
                    }
                EXPECT_EQ(factor.in_float(), surface < 1e8);
                EXPECT_LT(left_over(body, d, pinned, b, x), allowed(factor, surface))
                    << shape << " E_s " << surface << " pins " << pins;
            }
}

TEST(Factor, DissectionKeepsNeighboursOnOnePathToTheRoot) {
    const Body body = make_body("organ:vertices=900");
    const Dissection tree = dissect(body);
    for (Index i = 0; i < body.vertices(); ++i)
        for (const Spoke& s : body.spokes_of(i)) {
            int low = tree.node_of[std::size_t(tree.place_of[i])];
            const int high = tree.node_of[std::size_t(tree.place_of[s.neighbour])];
            if (low > high) continue;
            while (low >= 0 && low != high) low = tree.nodes[std::size_t(low)].parent;
            ASSERT_EQ(low, high) << i << " and " << s.neighbour;
        }
}

TEST(Factor, EveryKernelMultipliesAPanelToTheSameBits) {
    Random random(11);
    const int columns = 23, beyond = PanelProduct<float>::beyond;
    for (int rows : {1, 3, 4, 7, 8, 15, 16, 17, 31, 32, 33, 70}) {
        std::vector<float> P(std::size_t(rows * columns + beyond)), w(4 * 50);
        for (float& p : P) p = float(random.uniform() - 0.5);
        for (float& x : w) x = float(random.uniform() - 0.5);
        std::vector<int> places(columns);
        for (int& place : places) place = int(random.bits() % 50);
        std::vector<float> first;
        for (const VectorKernels* kernels : vector_kernels()) {
            std::vector<float> out(std::size_t(4 * (rows + beyond)));
            kernels->multiply({P.data(), rows, columns, places.data(), w.data(), out.data()});
            out.resize(std::size_t(4 * rows));
            for (int i = 0; i < rows; ++i)
                for (int a = 0; a < 3; ++a) {
                    double sum = 0;
                    for (int j = 0; j < columns; ++j)
                        sum += double(P[std::size_t(j * rows + i)]) *
                               double(w[std::size_t(4 * places[std::size_t(j)] + a)]);
                    ASSERT_NEAR(out[std::size_t(4 * i + a)], sum, 2e-6) << kernels->name << " row " << i;
                    out[std::size_t(4 * i + 3)] = 0;
                }
            if (first.empty()) first = out;
            EXPECT_EQ(out, first) << kernels->name << " " << rows << " rows";
        }
    }
}

// Refined here and there, and taken back: a part is made anew, and it is the factor of the whole.
TEST(Factor, AdaptedIsTheSameAsMadeAnew) {
    for (double surface : {1.0, 1e6, 1e10}) {
        Body body = make_body("sphere:vertices=800,irregularity=3", {.surface = surface});
        State state = rest_state(body);
        Subdivision history(body.rest);
        Factor adapted(body), order_only(body);
        adapted.factorize(body, diagonal(body, 1e-3), std::vector<bool>(body.vertices(), false));
        Random random(3);
        int fewest = 1 << 30;
        for (int round = 0; round < 12; ++round) {
            const Vector place = body.rest.positions[random.bits() % body.vertices()];
            const Transfer change =
                round % 4 == 3 ? coarsen(body, history, state,
                                         [&](const Vector& a, auto&&...) { return (a - place).norm() < 0.5; })
                               : refine(body, history, state, triangles_near(body.rest, place, 0.1));
            const auto d = diagonal(body, 1e-3);
            const std::vector<bool> pinned(body.vertices(), false);
            adapted.adapt(body, d, pinned, change.surface, change.body);
            fewest = std::min(fewest, adapted.nodes_made());
            order_only.adapt_tree(body, change.surface, change.body);
            Factor whole = order_only;
            whole.factorize(body, d, pinned);
            const auto b = random_field(body.vertices(), 7);
            std::vector<Vector> x(body.vertices()), y(body.vertices());
            adapted.solve(b.data(), x.data());
            whole.solve(b.data(), y.data());
            ASSERT_EQ(x, y) << "round " << round;
            ASSERT_LT(left_over(body, d, pinned, b, x), allowed(adapted, surface)) << round;
        }
        EXPECT_LT(fewest, int(adapted.tree().nodes.size()) / 3);
    }
}

}  // namespace
}  // namespace innerspring
