// How fast are we beside others? Nanoseconds per vertex and step of this library, of the plain loop and of
// Bullet, on the same mesh, with the same step, in turns in the same process.
//   bench_peers [--vertices 642,10242,...] [--rounds N] [--seconds S] [--csv FILE]
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "innerspring/mesh/shapes.h"
#include "innerspring/sim/stability.h"
#include "innerspring/version.h"
#include "machine.h"
#include "peers.h"

using namespace innerspring;

namespace {

/// Bullet takes some minutes to be set up beyond this.
constexpr std::size_t most_for_bullet = 2000000;

struct Options {
    std::vector<long> vertices{642, 10242, 163842, 1000000};
    int rounds = 7;
    double seconds = 0.1;  // one peer's turn in a round
    std::string csv;
};

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

double seconds_for(const Peer& peer, int steps) {
    const auto start = std::chrono::steady_clock::now();
    peer.advance(steps);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Motion {
    double down = 0, largest = 0;  // mean against gravity's axis, and of all vertices [m]
};

Motion motion(const Body& body, const std::vector<Vector>& x) {
    Motion m;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const Vector d = x[i] - body.rest.positions[i];
        m.down -= d.y() / double(x.size());
        m.largest = std::isfinite(d.norm()) ? std::max(m.largest, d.norm()) : INFINITY;
    }
    return m;
}

/// All from rest through the same steps: who claims our physics must end where we end, and the others must
/// move. Throws if not.
void compare_motion(const Body& body, const std::vector<Peer>& peers, int steps, double dt) {
    for (const Peer& peer : peers) peer.advance(steps);
    const std::vector<Vector> x = peers[0].positions();
    const Motion own = motion(body, x);
    fmt::print("  after {} steps of {:.3g} s the mean vertex is {:.3g} m down", steps, dt, own.down);
    for (const Peer& peer : peers) {
        const std::vector<Vector> y = peer.positions();
        const Motion other = motion(body, y);
        if (!(other.down > 0 && other.largest < 1e6))
            throw std::runtime_error(fmt::format("{} does not move as a body under gravity", peer.what));
        double apart = 0;
        for (std::size_t i = 0; i < x.size(); ++i) apart = std::max(apart, (x[i] - y[i]).norm());
        if (peer.same_physics && apart > 1e-3 * own.largest)
            throw std::runtime_error(fmt::format("{} ends {:g} m from where we do", peer.what, apart));
        if (peer.same_physics) continue;
        fmt::print(", {} {:.3g}", peer.what, other.down);
    }
    fmt::print("\n");
}

void run(const Options& o) {
    fmt::print("innerspring {}; {}, {} cores; {}; {}\n", version, processor(), cores(), compiler(), today());
    fmt::print("ns per vertex and step, {} rounds in turns; and how many times what we take\n", o.rounds);
    std::string rows;
    for (long vertices : o.vertices) {
        const Body body = build_body(make_shape(fmt::format("icosphere:vertices={}", vertices)));
        Loads loads;
        loads.forces.push_back(patch_force(body, 0, 0.4, Vector(0, 0, -0.01)));
        const double dt = 0.99 * step_safety * largest_stable_step(body);
        std::vector<Peer> peers{ours(body, loads, dt, 1), ours(body, loads, dt, 2),
                                plain_loop(body, loads, dt)};
        if (body.vertices() <= most_for_bullet)
            std::ranges::move(bullet(body, loads, dt), std::back_inserter(peers));

        fmt::print("\nicosphere of {} vertices\n", body.vertices());
        compare_motion(body, peers, 100, dt);
        std::vector<int> steps;
        for (const Peer& peer : peers)
            steps.push_back(std::max(3, int(5 * o.seconds / seconds_for(peer, 5))));
        std::vector<std::vector<double>> times(peers.size());
        for (int round = 0; round < o.rounds; ++round)
            for (std::size_t p = 0; p < peers.size(); ++p) {
                peers[p].advance(1);  // brings its data back into the caches
                times[p].push_back(1e9 * seconds_for(peers[p], steps[p]) / steps[p] /
                                   double(body.vertices()));
            }
        // Round by round, as the machine may be slower in one than in the next.
        auto ratio = [&](std::size_t p, std::size_t to) {
            std::vector<double> ratios;
            for (int r = 0; r < o.rounds; ++r)
                ratios.push_back(times[p][std::size_t(r)] / times[to][std::size_t(r)]);
            return median(ratios);
        };
        fmt::print("  {:<24}{:>8}{:>10}{:>10}{:>12}{:>12}\n", "", "threads", "median", "least", "ours on 1",
                   "ours on 2");
        for (std::size_t p = 0; p < peers.size(); ++p) {
            const double ns = median(times[p]);
            fmt::print("  {:<24}{:>8}{:>10.2f}{:>10.2f}{:>11.2f}x{:>11.2f}x\n", peers[p].what,
                       peers[p].threads, ns, std::ranges::min(times[p]), ratio(p, 0), ratio(p, 1));
            rows += fmt::format("\"{}\",{},\"{}\",{},{},icosphere,{},{},\"{}\",{:.6g},{:.3f},{:.3f},{:.3f}\n",
                                processor(), cores(), compiler(), today(), version, body.vertices(),
                                peers[p].threads, peers[p].what, 1e-6 * ns * double(body.vertices()), ns,
                                std::ranges::min(times[p]), ratio(p, 0));
        }
        std::fflush(stdout);
    }
    if (o.csv.empty()) return;
    const bool fresh = !std::filesystem::exists(o.csv);
    std::FILE* file = std::fopen(o.csv.c_str(), "a");
    if (!file) throw std::runtime_error(o.csv + " cannot be written");
    if (fresh)
        fmt::print(file,
                   "machine,cores,compiler,date,version,mesh,vertices,threads,what,ms,ns_per_vertex,least_ns_"
                   "per_vertex,"
                   "times_ours_on_one_thread\n");
    fmt::print(file, "{}", rows);
    std::fclose(file);
}

}  // namespace

int main(int argc, char** argv) {
    Options o;
    CLI::App app("A step of this library, of a plain loop and of Bullet, on the same mesh in turns");
    app.add_option("--vertices", o.vertices, "sizes of the icosphere")
        ->delimiter(',')
        ->check(CLI::Range(4, 100000000));
    app.add_option("--rounds", o.rounds)->check(CLI::Range(1, 1000000));
    app.add_option("--seconds", o.seconds, "one peer's turn in a round")->check(CLI::Range(1e-9, 1e9));
    app.add_option("--csv", o.csv, "file to append to");
    CLI11_PARSE(app, argc, argv);
    try {
        run(o);
        return 0;
    } catch (const std::exception& e) {
        fmt::print(stderr, "bench_peers: {}\n", e.what());
        return 1;
    }
}
