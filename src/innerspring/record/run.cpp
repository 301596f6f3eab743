#include "innerspring/record/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/write.h"
#include "innerspring/record/json.h"
#include "innerspring/record/picture.h"
#include "innerspring/record/plot.h"
#include "innerspring/record/state_file.h"
#include "innerspring/record/vtk.h"
#include "innerspring/sim/forces.h"

namespace innerspring {

namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// More steps than this would not fit in memory as a series.
constexpr double most_steps = 1e7;

/// What loads, gravity and moved pins have put into a body; kinetic and elastic energy cannot exceed it by
/// much unless the run blows up.
class EnergyWatch {
  public:
    EnergyWatch(const Body& body, const Loads& loads, const State& state, double put_in) : put_in_(put_in) {
        pin_forces(body, loads, state);
    }

    double put_in() const { return put_in_; }
    /// The mesh has changed, which put so much energy [J] in.
    void refined(const Body& body, const Loads& loads, const State& state, double energy) {
        put_in_ += energy;
        pin_forces(body, loads, state);
    }

    void touched(double work) { put_in_ += work; }  ///< by tools [J]

    /// Accounts for the step from `before` to `now`; true if there is more energy than can be explained.
    bool exceeded(const Body& body, const Loads& loads, const State& state, const Measures& before,
                  const Measures& now) {
        put_in_ += std::abs(now.potential - before.potential);
        if (has_moving_pins(loads)) {
            std::vector<Vector> x, f;
            x.swap(x_), f.swap(f_);
            pin_forces(body, loads, state);
            for (std::size_t n = 0; n < x.size(); ++n)
                put_in_ += (f[n].norm() + f_[n].norm()) * (x_[n] - x[n]).norm();
        }
        return now.kinetic + now.elastic > 10 * put_in_ + 1e-12 * mean_modulus(body.material) * body.volume;
    }

  private:
    static bool has_moving_pins(const Loads& loads) {
        for (const Pin& pin : loads.pins)
            if (!pin.path.empty()) return true;
        return false;
    }
    void pin_forces(const Body& body, const Loads& loads, const State& state) {
        x_.clear(), f_.clear();
        if (!has_moving_pins(loads)) return;
        Team alone(1);
        const HomeFrame frame = home_frame(body, state.x, alone);
        for (const Pin& pin : loads.pins)
            for (Index i : pin.vertices) {
                x_.push_back(state.x[i]);
                const Vector home = frame.R * body.rest.positions[i] + frame.t;
                f_.push_back(surface_force(body, state.x.data(), i) +
                             inner_force(body, frame, i, state.x[i] - home));
            }
    }
    double put_in_;
    std::vector<Vector> x_, f_;  ///< of the pinned vertices
};

std::string frame_name(std::uint64_t step) {
    return fmt::format("frames/frame_{:08d}.vtp", step);
}

struct Writer {
    const std::filesystem::path& directory;
    const Body& body;
    const Loads& loads;
    std::vector<Frame> frames;

    void frame(const State& state) {
        std::vector<Vector> u(state.x.size());
        for (std::size_t i = 0; i < u.size(); ++i) u[i] = state.x[i] - body.rest.positions[i];
        const VertexField fields[] = {{"displacement_m", std::span<const Vector>(u)},
                                      {"velocity_m_s", std::span<const Vector>(state.v)},
                                      {"m_kg", std::span<const double>(body.m)},
                                      {"K_n_m", std::span<const double>(body.K)}};
        write_whole(directory / frame_name(state.steps), to_vtp(state.x, body.rest.triangles, fields));
        if (frames.empty() || frames.back().file != frame_name(state.steps))
            frames.push_back({state.time, frame_name(state.steps)});
    }

    /// All that resuming needs; the state last, so that what it refers to is there.
    void checkpoint(const SavedState& saved, std::span<const Measures> rows) const {
        write_whole(directory / "series.csv", to_csv(rows, loads));
        write_whole(directory / "frames.pvd", to_pvd(frames));
        write_state(saved, directory / "state.bin");
    }

    /// The last state, coloured by displacement.
    void picture(const State& state, const std::string& title) const {
        std::vector<double> u(state.x.size());
        for (std::size_t i = 0; i < u.size(); ++i) u[i] = (state.x[i] - body.rest.positions[i]).norm();
        PictureOptions options;
        options.title = title;
        options.legend = "displacement [m]";
        options.high =
            *std::max_element(u.begin(), u.end());  // from 0: a body that only sinks has one colour
        write_whole(directory / "picture.png", to_png(draw(state.x, body.rest.triangles, u, options)));
    }
};

/// What must be the same for a run to be resumed: all but how long it goes on and with how many threads. Of
/// the files a scene names, what came of them.
std::uint64_t resume_hash(Scene scene, const Body& body, const Loads& loads) {
    scene.duration = 0;
    scene.step.threads = 1;
    std::uint64_t hash = text_hash(to_toml(scene));
    const auto mix = [&](const auto& values) {
        const std::string_view bytes(reinterpret_cast<const char*>(values.data()),
                                     values.size() * sizeof(values[0]));
        hash = 3 * hash + text_hash(bytes);
    };
    mix(body.rest.positions), mix(body.rest.triangles), mix(body.m), mix(body.K), mix(body.N);
    for (const Tool& tool : loads.tools)
        if (tool.mesh) mix(tool.mesh->mesh.positions), mix(tool.mesh->mesh.triangles);
    return hash;
}

/// The scene with the files it names by their full paths, so that it can be run from anywhere.
Scene located(Scene scene) {
    rename_files(scene, [](const std::string& name) {
        return std::filesystem::absolute(name).lexically_normal().string();
    });
    return scene;
}

std::uint64_t step_count(const Scene& scene) {
    const double steps = std::round(scene.duration / scene.step.dt);
    if (!(steps <= most_steps))
        throw InputError(
            fmt::format("{:g} s in steps of {:g} s are more than {:g} steps; use a larger dt (it is "
                        "sub-stepped as needed)",
                        scene.duration, scene.step.dt, most_steps));
    return std::uint64_t(steps);
}

std::string blow_up(const Body& body, const State& state, Index vertex) {
    const Vector& q = body.rest.positions[vertex];
    return fmt::format(
        "stopped in step {} (t = {:.6g} s): vertex {} at rest position ({:.4g}, {:.4g}, {:.4g}) m left the "
        "numbers; the last good state is kept",
        state.steps + 1, state.time, vertex, q.x(), q.y(), q.z());
}

}  // namespace

Summary run(const Scene& scene, const RunOptions& options) {
    Setup setup = set_up(scene);
    Body& body = setup.body;
    Loads& loads = setup.loads;
    if (scene.equilibrium) require_held(body, loads);
    const std::uint64_t total = scene.equilibrium ? 0 : step_count(scene);

    Summary summary;
    summary.subject = describe(scene, setup);
    summary.warnings = std::move(setup.notes);
    summary.dt_s = scene.step.dt;
    if (!options.resume)
        for (const Tool& tool : loads.tools)
            if (const double depth = overlap(tool, 0, body.rest); depth > 0.01 * body.radius)
                summary.warnings.push_back(fmt::format(
                    "tool '{}' begins {:.3g} m inside the body: what is inside is put out first, and what it "
                    "feels then says little; let it begin outside",
                    tool.name, depth));

    Workspace workspace(body, scene.step);
    State state = rest_state(body);
    Refiner refiner(body, std::move(setup.refine));
    double released = 0;  // what refining put into the springs and the motion [J]
    auto refine_before_step = [&](double time) {
        refiner.before_step(time, scene.step.dt, body, loads, state, [&](const Transfer& transfer) {
            workspace.adapt(body, transfer);
            released += std::abs(transfer.kinetic_change_j) + std::abs(transfer.elastic_change_j);
        });
    };
    std::vector<Measures> rows;
    const std::uint64_t hash = resume_hash(scene, body, loads);
    double put_in = 0;
    Writer writer{options.directory, body, loads, {}};
    if (options.resume) {
        if (scene.equilibrium) throw InputError("an equilibrium has nothing to resume; leave --resume out");
        SavedState saved = read_state(options.directory / "state.bin");
        if (saved.scene_hash != hash)
            throw InputError(
                fmt::format("{}: holds a run of another scene, or of files that have changed since; only the "
                            "duration and "
                            "the threads may change on --resume",
                            (options.directory / "state.bin").string()));
        // The mesh as it was then: what was due before each step taken, on a body at rest.
        refiner.replay(std::move(saved.views), saved.state.time);
        for (std::uint64_t s = 0; s < saved.state.steps; ++s) refine_before_step(double(s) * scene.step.dt);
        if (saved.state.x.size() != body.vertices())
            throw InputError(fmt::format(
                "{}: a state of {} vertices where the mesh has {}; it is of another mesh",
                (options.directory / "state.bin").string(), saved.state.x.size(), body.vertices()));
        released = 0;
        state = std::move(saved.state);
        put_in = saved.energy_bound;
        rows = read_series(options.directory / "series.csv", std::size_t(state.steps) + 1, loads);
        for (std::uint64_t s = 0; s <= state.steps; ++s)
            if (s == 0 || (scene.every > 0 && s % std::uint64_t(scene.every) == 0))
                writer.frames.push_back({rows[s].time, frame_name(s)});
    }

    std::error_code failed;
    std::filesystem::create_directories(options.directory / "frames", failed);
    if (failed)
        throw RunError(fmt::format("{}: cannot be made: {}", options.directory.string(), failed.message()));
    write_whole(options.directory / "scene.resolved.toml",
                "# innerspring, the scene as it was run\n" + to_toml(located(scene)));

    if (!options.resume) {
        // What an earlier run left here is not this run's.
        for (const char* stale : {"summary.json", "state.bin"})
            std::filesystem::remove(options.directory / stale, failed);
        rows.push_back(measure(body, loads, state));
        put_in = rows.back().kinetic + rows.back().elastic;
        writer.frame(state);
    }

    int unconverged = 0;
    double vertex_steps = 0;
    summary.substeps = workspace.substeps();
    if (scene.equilibrium) {
        refine_before_step(0);
        const auto start = Clock::now();
        const EquilibriumReport report = solve_equilibrium(
            body, loads, state, {.tolerance_n = scene.residual_n, .threads = scene.step.threads});
        summary.seconds = seconds_since(start);
        state.steps = std::uint64_t(report.iterations);
        summary.equilibrium_reached = report.reached;
        summary.residual_n = report.residual_n;
        summary.tolerance_n = report.tolerance_n;
        if (!report.reached && !std::isfinite(report.tolerance_n))
            summary.failure = "no equilibrium: loads and springs are beyond the numbers; check their units";
        else if (!report.reached)
            summary.failure = fmt::format(
                "no equilibrium after {} iterations: the largest force left is {:.3g} N, {:.3g} N was asked "
                "for",
                report.iterations, report.residual_n, report.tolerance_n);
        rows.push_back(measure(body, loads, state));
        rows.back().pressure = report.pressure;
        writer.frame(state);
    } else {
        EnergyWatch watch(body, loads, state, put_in);
        const auto begin = Clock::now();
        auto reported = begin, saved = begin;
        const std::uint64_t first = state.steps;
        while (state.steps < total && summary.failure.empty() && !summary.stopped) {
            const auto start = Clock::now();
            try {
                refine_before_step(state.time);
            } catch (const InputError& error) {
                summary.failure = fmt::format("stopped at t = {:.6g} s: {}", state.time, error.what());
                break;
            }
            if (released > 0) watch.refined(body, loads, state, std::exchange(released, 0.0));
            const StepReport report = step(body, loads, state, workspace);
            summary.seconds += seconds_since(start);
            summary.substeps = std::max(summary.substeps, workspace.substeps());
            vertex_steps += double(body.vertices()) * workspace.substeps();
            if (report.not_finite != no_index) {
                summary.failure = blow_up(body, state, report.not_finite);
                break;
            }
            if (!report.converged) ++unconverged;
            rows.push_back(measure(body, loads, state));
            if (body.material.poisson > 0) rows.back().pressure = report.pressure;
            if (!loads.tools.empty()) {
                for (std::size_t n = 0; n < loads.tools.size(); ++n)
                    rows.back().tool_force[n] = workspace.contact().tools[n].force;
                watch.touched(workspace.contact().work);
            }
            if (watch.exceeded(body, loads, state, rows[rows.size() - 2], rows.back()))
                summary.failure = fmt::format(
                    "stopped in step {} (t = {:.6g} s): {:.3g} J in the body where at most {:.3g} J were put "
                    "in; it is blowing up",
                    state.steps, state.time, rows.back().kinetic + rows.back().elastic, watch.put_in());
            if (scene.every > 0 && state.steps % std::uint64_t(scene.every) == 0) writer.frame(state);
            if (options.progress && seconds_since(reported) > 0.1) {
                reported = Clock::now();
                const double done = double(state.steps - first), left = double(total - state.steps);
                options.progress({double(state.steps) / double(total), seconds_since(begin) / done * left,
                                  rows.back().volume_variation_percent});
            }
            if (seconds_since(saved) > 2) {
                writer.checkpoint({hash, watch.put_in(), state, refiner.views()}, rows);
                saved = Clock::now();
            }
            summary.stopped = options.stop && options.stop->load();
        }
        summary.residual_n = largest_imbalance(body, loads, state, workspace.contact().vertices);
        summary.tolerance_n =
            scene.residual_n > 0 ? scene.residual_n : 1e-9 * load_sum(body, loads, state.time);
        summary.equilibrium_reached = summary.residual_n <= summary.tolerance_n && !body.free;
        put_in = watch.put_in();
        if (vertex_steps > 0) summary.ns_per_vertex_step = 1e9 * summary.seconds / vertex_steps;
    }
    if (unconverged > 0)
        summary.warnings.push_back(fmt::format("{} of {} implicit steps ended above the tolerance {:g}",
                                               unconverged, state.steps, scene.step.tolerance));

    // The last frame is always there, also where `every` does not meet it.
    writer.frame(state);
    writer.checkpoint({hash, put_in, state, refiner.views()}, rows);

    summary.integrator = workspace.integrator();
    summary.precision = workspace.precision();
    summary.refinements = refiner.changes();
    summary.vertices_last = body.vertices();
    summary.duration_s = state.time;
    summary.steps = state.steps;
    summary.volume_variation_percent = volume_variation(rows);
    summary.last = rows.back();
    summary.state_hash = state_hash(state);

    Plot plot{"Volume variation: " + body.rest.name,
              "time [s]",
              "volume variation [%]",
              {{"scheme " + std::string(to_string(body.scheme)), {}, {}}}};
    for (const Measures& r : rows)
        plot.curves[0].x.push_back(r.time), plot.curves[0].y.push_back(r.volume_variation_percent);
    if (!scene.equilibrium && options.pictures)
        if (const std::string why = write_svg(plot, options.directory / "volume.svg"); !why.empty())
            summary.warnings.push_back(why);
    if (options.pictures)
        writer.picture(state, fmt::format("{}, scheme {}, t = {:.3g} s", body.rest.name,
                                          to_string(body.scheme), state.time));
    write_whole(options.directory / "summary.json", to_json(summary));
    return summary;
}

}  // namespace innerspring
