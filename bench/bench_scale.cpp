// From a file to a body that steps: time and memory per vertex, phase by phase, over the sizes.
//   bench_scale [--vertices 10242,...] [--rounds N] [--csv FILE] [SHAPE ...]
// A file is written to a temporary folder and read back (from the system's cache); the shape's making is not
// counted. "Peak" is what `new` handed out beyond what there was before the file was read, at most; "rss"
// what the system gave the process, likewise.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string_view>

#include <unistd.h>

#include "heap.h"
#include "innerspring/body/estimate.h"
#include "innerspring/mesh/check.h"
#include "innerspring/mesh/medial.h"
#include "innerspring/mesh/read.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/weld.h"
#include "innerspring/mesh/write.h"
#include "innerspring/version.h"
#include "machine.h"

using namespace innerspring;

namespace {

struct Options {
    std::vector<long> vertices{10242, 100000, 1000000, 5000000};
    std::vector<std::string> shapes{"icosphere", "sphere", "organ"};
    int rounds = 3;
    std::string csv;
};

/// The most memory the process had since reset_rss_peak() [byte].
double rss_peak() {
    std::ifstream in("/proc/self/status");
    for (std::string line; std::getline(in, line);)
        if (line.starts_with("VmHWM:")) return 1024 * std::atof(line.c_str() + 6);
    return 0;
}

void reset_rss_peak() {
    std::ofstream("/proc/self/clear_refs") << "5";
}

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Phase {
    std::string name;
    bool counts = true;         // false: part of another phase, measured again by itself
    double seconds = INFINITY;  // the least of the rounds
    double peak = 0;            // [byte]
};

/// One way from file to body, noted in `phases`.
struct Way {
    std::vector<Phase>& phases;
    std::size_t before = heap_now(), next = 0;

    template <class Action>
    auto operator()(const char* name, bool counts, Action&& action) {
        if (next == phases.size()) phases.push_back({name, counts});
        Phase& phase = phases[next++];
        reset_heap_peak();
        const double start = now();
        auto result = action();
        phase.seconds = std::min(phase.seconds, now() - start);
        phase.peak = std::max(phase.peak, double(heap_peak() - before));
        return result;
    }
};

struct Sizes {
    double rss = 0, body = 0;  // [byte]
    std::size_t vertices = 0;
    std::string centre;
};

Sizes go(const std::filesystem::path& file, std::vector<Phase>& phases) {
    Sizes sizes;
    reset_rss_peak();
    const double rss_before = rss_peak();
    Way phase{phases};
    std::optional<Body> body;
    {
        SurfaceMesh mesh;
        {
            const SurfaceMesh raw = phase("read", true, [&] { return read(file); });
            mesh = phase("weld", true, [&] { return weld(raw).mesh; });
        }
        body = phase("build_body", true, [&] { return build_body(std::move(mesh)); });
    }
    phase("estimate", true, [&] { return estimate(*body).sag; });
    sizes.rss = rss_peak() - rss_before;
    sizes.body = double(heap_now() - phase.before);
    sizes.vertices = body->vertices();
    sizes.centre = to_string(body->centre.kind);
    // Once more by themselves: parts of build_body, and what `innerspring check` does.
    const SurfaceMesh mesh = body->rest;
    body.reset();
    phase.before =
        heap_now() - mesh.positions.size() * sizeof(Vector) - mesh.triangles.size() * sizeof(Triangle);
    phase("checks of build_body", false, [&] { return check(mesh, {.self_intersections = false}).vertices; });
    phase("topology", false,
          [&] { return build_topology(mesh.positions.size(), mesh.triangles).edges.size(); });
    phase("medial radius", false, [&] { return medial_radii(mesh).size(); });
    phase("check", false, [&] { return check(mesh).vertices; });
    return sizes;
}

/// Appended, and headed if the file is new.
void append(const std::string& csv, const std::string& rows) {
    if (csv.empty()) return;
    const bool fresh = !std::filesystem::exists(csv);
    std::FILE* out = std::fopen(csv.c_str(), "a");
    if (!out) throw std::runtime_error(csv + " cannot be written");
    if (fresh)
        fmt::print(out,
                   "machine,cores,compiler,date,version,mesh,vertices,centre,what,us_per_vertex,peak_bytes_"
                   "per_vertex\n");
    fmt::print(out, "{}", rows);
    std::fclose(out);
}

void run(const Options& o) {
    fmt::print("innerspring {}; {}, {} cores; {}; {}\n", version, processor(), cores(), compiler(), today());
    fmt::print("wall time, medial radii on all cores; the least of {} rounds\n", o.rounds);
    const auto folder = std::filesystem::temp_directory_path() / fmt::format("bench_scale.{}", getpid());
    std::filesystem::create_directories(folder);
    for (const std::string& shape : o.shapes)
        for (long vertices : o.vertices) {
            const auto file = folder / "mesh.stl";
            write(make_shape(fmt::format("{}{}vertices={}", shape, shape.find(':') == shape.npos ? ":" : ",",
                                         vertices)),
                  file);
            std::string rows;
            std::vector<Phase> phases;
            Sizes sizes;
            for (int round = 0; round < o.rounds; ++round) sizes = go(file, phases);
            const double N = double(sizes.vertices);
            fmt::print("\n{} of {} vertices, centre {}\n", shape, sizes.vertices, sizes.centre);
            fmt::print("  {:<32}{:>14}{:>20}\n", "", "us per vertex", "peak B per vertex");
            auto print = [&](std::string_view indent, const Phase& p) {
                fmt::print("  {:<32}{:>14.3f}{:>20.0f}\n", fmt::format("{}{}", indent, p.name),
                           1e6 * p.seconds / N, p.peak / N);
                rows += fmt::format("\"{}\",{},\"{}\",{},{},{},{},{},\"{}\",{:.4f},{:.1f}\n", processor(),
                                    cores(), compiler(), today(), version, shape, sizes.vertices,
                                    sizes.centre, p.name, 1e6 * p.seconds / N, p.peak / N);
            };
            Phase all{"file to body", true, 0, 0};
            for (const Phase& p : phases)
                if (p.counts) all.seconds += p.seconds, all.peak = std::max(all.peak, p.peak);
            for (const Phase& p : phases)
                if (p.counts) print("", p);
            print("", all);
            for (const Phase& p : phases)
                if (!p.counts) print("  by itself: ", p);
            fmt::print("  rss {:.0f} B per vertex at its peak; the body {:.0f}\n", sizes.rss / N,
                       sizes.body / N);
            std::fflush(stdout);
            append(o.csv, rows);
        }
    std::filesystem::remove_all(folder);
}

}  // namespace

int main(int argc, char** argv) {
    Options o;
    CLI::App app("Time and memory per vertex from a file to a body, phase by phase");
    app.add_option("shapes", o.shapes, "built-in shapes (default icosphere, sphere, organ)");
    app.add_option("--vertices", o.vertices)->delimiter(',')->check(CLI::Range(4, 100000000));
    app.add_option("--rounds", o.rounds, "the least of so many counts")->check(CLI::Range(1, 1000000));
    app.add_option("--csv", o.csv, "file to append to");
    CLI11_PARSE(app, argc, argv);
    try {
        run(o);
        return 0;
    } catch (const std::exception& e) {
        fmt::print(stderr, "bench_scale: {}\n", e.what());
        return 1;
    }
}
