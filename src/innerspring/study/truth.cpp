#include "innerspring/study/truth.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/team.h"
#include "innerspring/mesh/write.h"
#include "innerspring/record/setup.h"
#include "innerspring/record/state_file.h"
#include "innerspring/study/truth_loads.h"
#include "innerspring/study/truth_report.h"

namespace innerspring {

namespace {

using Clock = std::chrono::steady_clock;
using Field = std::vector<Vector>;

constexpr std::string_view magic = "innerspring truth cases 1";
constexpr std::array modes = {2, 3, 4, 10};
constexpr std::array caps = {0.1, 0.2, 0.3, 0.5};

void require_valid(const TruthOptions& o) {
    const auto check = [](const char* option, double value, double low, double high) {
        if (!(value >= low && value <= high))
            throw InputError(
                fmt::format("{} is {:g}: it must be from {:g} to {:g}", option, value, low, high));
    };
    check("the reference's Poisson's ratio", o.sphere_poisson, 0, 0.5);
    check("the elements' Poisson's ratio", o.element_poisson, 0, largest_element_poisson);
    check("the number of vertices", o.patches, 1, 100);
    check("the number of tetrahedra", o.tetrahedra, 0, 1e6);
    check("the radius of influence, as a share of R,", o.patch_share, 0.01, 2);
}

/// A subject with what is asked of it: who refers, who is judged.
struct Work {
    TruthSubject subject;
    std::vector<Field> series;  ///< the series' answers; empty where the elements are the reference
    bool elements = false;      ///< they are needed: as the reference, or to be judged
};

/// The elements' answer to one load: kept for resuming.
struct Solved {
    std::string key;
    Field u;  ///< of the load of unit size
    std::size_t tetrahedra = 0, nodes = 0;
    std::atomic<bool> done{false};
};

/// No tetrahedron is larger than the mean of so many; most are smaller.
void refine_elements(TruthSubject& s, int tetrahedra) {
    if (tetrahedra > 0) s.filling.largest_volume = s.volume / tetrahedra;
}

Work sphere_work(const TruthOptions& o, const Material& material, int vertices, bool elements) {
    SurfaceMesh mesh = make_shape(fmt::format("icosphere:vertices={}", vertices));
    Work work{make_subject(std::move(mesh), material, {CentreKind::given, Vector::Zero()},
                           elements ? std::min(o.sphere_poisson, o.element_poisson) : o.sphere_poisson),
              {},
              elements};
    TruthSubject& s = work.subject;
    s.name = elements ? "sphere, elements" : "sphere, series";
    refine_elements(s, o.tetrahedra);
    s.radius = s.mesh.positions[0].norm();  // of the sphere itself, not of the polyhedron in it
    s.axis = s.mesh.positions[0] / s.radius;
    for (const int n : modes) {
        s.loads.push_back(mode_load(s, n));
        work.series.push_back(mode_answer(s, n));
    }
    for (const double alpha : caps) {
        if (elements && alpha < 0.25) continue;  // a few triangles of so coarse a mesh
        s.loads.push_back(squeeze_load(s, alpha));
        work.series.push_back(squeeze_answer(s, alpha));
    }
    return work;
}

Work mesh_work(const TruthOptions& o, const Scene& scene, SurfaceMesh mesh, std::string name) {
    Work work{make_subject(std::move(mesh), scene.material, scene.centre, o.element_poisson), {}, true};
    work.subject.name = std::move(name);
    refine_elements(work.subject, o.tetrahedra);
    hold_base(work.subject, scene.gravity, o.held_share);
    add_loads_of(work.subject, scene.gravity, o.patches, o.patch_share * work.subject.radius);
    return work;
}

std::uint64_t hash_of(const std::vector<Work>& works) {
    std::string text;
    for (const Work& w : works) {
        const TruthSubject& s = w.subject;
        text += fmt::format("{} {} {} {} {} {} {}\n", s.name, s.material.young, s.material.mass, s.poisson,
                            s.held.size(), s.loads.size(), s.filling.largest_volume);
        for (const TruthLoad& l : s.loads) {
            text += fmt::format("{} {} {} {}\n", l.name, l.gravity.x(), l.gravity.y(), l.gravity.z());
            for (const SurfaceForce& f : l.surface)
                text += fmt::format("{} {} {}\n", f.triangle, f.force.x(), f.force.norm());
        }
        for (const Vector& q : s.mesh.positions) text += fmt::format("{} {} {}\n", q.x(), q.y(), q.z());
        for (const Triangle& t : s.mesh.triangles) text += fmt::format("{} {} {}\n", t[0], t[1], t[2]);
    }
    return text_hash(text);
}

double largest(const Field& u) {
    double norm = 0;
    for (const Vector& v : u) norm = std::max(norm, v.norm());
    return norm;
}

class Runner {
  public:
    Runner(std::vector<Work> works, const TruthRun& run, TruthResults& results)
        : works_(std::move(works)), run_(run), results_(results), hash_(hash_of(works_)) {
        std::size_t count = 0;
        for (const Work& w : works_) count += w.elements ? w.subject.loads.size() : 0;
        solved_ = std::vector<Solved>(count);
        parts_.resize(works_.size());
        for (std::size_t n = 0, next = 0; n < works_.size(); ++n) {
            parts_[n].first = next;
            if (works_[n].elements)
                for (const TruthLoad& l : works_[n].subject.loads)
                    solved_[next++].key = works_[n].subject.name + " | " + l.name;
        }
        if (run.resume) resume();
    }

    /// Returns false if stopped.
    bool run() {
        Team team(run_.threads);
        team.run(std::size_t(team.threads()), [&](std::size_t) {
            for (std::size_t n; (n = next_.fetch_add(1)) < works_.size() && !stopped();) {
                try {
                    judge(works_[n], parts_[n]);
                } catch (...) {
                    parts_[n].failure = std::current_exception();
                }
            }
        });
        save();
        for (const Part& part : parts_)
            if (part.failure) std::rethrow_exception(part.failure);
        if (stopped()) return false;
        for (Part& part : parts_) {
            results_.subjects.push_back(std::move(part.info));
            std::move(part.rows.begin(), part.rows.end(), std::back_inserter(results_.rows));
            std::move(part.notes.begin(), part.notes.end(), std::back_inserter(results_.warnings));
        }
        return true;
    }

    std::vector<TruthShown> shown() const {
        std::vector<TruthShown> all;
        for (std::size_t n = 0; n < works_.size(); ++n)
            for (const auto& [load, answers] : parts_[n].shown)
                all.push_back(
                    {&works_[n].subject, &works_[n].subject.loads[load], !works_[n].series.empty(), answers});
        return all;
    }

  private:
    struct Part {
        std::size_t first = 0;  ///< of solved_
        TruthSubjectInfo info;
        std::vector<TruthRow> rows;
        std::vector<std::string> notes;
        std::vector<std::pair<std::size_t, std::vector<std::pair<std::string, Field>>>> shown;
        std::exception_ptr failure;
    };

    bool stopped() const { return run_.stop && run_.stop->load(); }

    void judge(Work& w, Part& part) {
        TruthSubject& s = w.subject;
        const bool by_series = !w.series.empty();
        part.info = {s.name,
                     by_series ? "series" : "elements",
                     s.mesh.positions.size(),
                     s.mesh.triangles.size(),
                     s.held.size(),
                     0,
                     0,
                     s.radius,
                     s.poisson};
        std::optional<ElementReference> elements;  // made when the first load needs it
        for (std::size_t n = 0; n < s.loads.size() && !stopped(); ++n) {
            TruthLoad& load = s.loads[n];
            Solved* solved = w.elements ? &solved_[part.first + n] : nullptr;
            if (solved && !solved->done.load()) {
                if (!elements) elements.emplace(s);
                solved->u = elements->answer(s, load);
                solved->tetrahedra = elements->tetrahedra();
                solved->nodes = elements->nodes();
                solved->done.store(true, std::memory_order_release);
                tell();
            }
            if (solved) part.info.tetrahedra = solved->tetrahedra, part.info.nodes = solved->nodes;
            Field reference = by_series ? w.series[n] : solved->u;
            if (!(largest(reference) > 0)) continue;  // a load that moves nothing
            const double factor = run_.options.amplitude * s.radius / largest(reference);
            scale(load, factor);
            for (Vector& u : reference) u *= factor;
            std::vector<Vector> nodal = nodal_forces(s, load);
            for (std::size_t i = 0; i < nodal.size(); ++i) nodal[i] += s.mass[i] * load.gravity;

            std::vector<std::pair<std::string, Field>> answers{
                {by_series ? "series" : "elements", reference}};
            const auto add = [&](const std::string& model, Field u) {
                part.rows.push_back(compare(s, load, nodal, reference, u));
                part.rows.back().reference = part.info.reference;
                part.rows.back().model = model;
                answers.emplace_back(model, std::move(u));
            };
            if (by_series && w.elements) {
                Field u = solved->u;
                for (Vector& v : u) v *= factor;
                add("elements", std::move(u));
            } else {
                for (const TruthModel& model : results_.models) {
                    if (model.needs_hold && s.held.empty()) continue;
                    TruthAnswer answer = model.answer(s, load);
                    if (!answer.note.empty())
                        part.notes.push_back(
                            fmt::format("{}, {}, {}: {}", s.name, load.name, model.name, answer.note));
                    add(model.name, std::move(answer.u));
                }
            }
            const bool first_patch = load.kind == TruthLoad::Kind::patch && n == 1;
            if (load.kind == TruthLoad::Kind::squeeze || load.kind == TruthLoad::Kind::gravity || first_patch)
                part.shown.emplace_back(n, std::move(answers));
        }
    }

    void tell() {
        if (busy_.test_and_set(std::memory_order_acquire)) return;
        const double passed = std::chrono::duration<double>(Clock::now() - begin_).count();
        std::size_t done = 0;
        for (const Solved& s : solved_) done += s.done.load(std::memory_order_acquire);
        const double share = double(done) / double(solved_.size());
        if (run_.progress)
            run_.progress({share,
                           passed * double(solved_.size() - done) / std::max(1.0, double(done - resumed_)),
                           done, solved_.size()});
        if (passed - saved_ > 2) {
            save();
            saved_ = passed;
        }
        busy_.clear(std::memory_order_release);
    }

    /// Never by two threads at once.
    void save() const {
        SeriesTable table;
        for (const Solved& s : solved_) {
            if (!s.done.load(std::memory_order_acquire)) continue;
            std::vector<double> flat;
            for (const Vector& u : s.u) flat.insert(flat.end(), {u.x(), u.y(), u.z()});
            table[s.key] = {std::move(flat), {double(s.tetrahedra), double(s.nodes)}};
        }
        write_table(table, magic, hash_, run_.directory / "truth_cases.txt");
    }

    void resume() {
        const SeriesTable table = read_table(magic, hash_, run_.directory / "truth_cases.txt");
        for (Solved& s : solved_) {
            const auto found = table.find(s.key);
            if (found == table.end()) continue;
            const std::vector<double>& flat = found->second.at(0);
            for (std::size_t i = 0; i + 2 < flat.size(); i += 3)
                s.u.emplace_back(flat[i], flat[i + 1], flat[i + 2]);
            s.tetrahedra = std::size_t(found->second.at(1).at(0));
            s.nodes = std::size_t(found->second.at(1).at(1));
            s.done.store(true);
            ++resumed_;
        }
    }

    std::vector<Work> works_;
    const TruthRun& run_;
    TruthResults& results_;
    std::uint64_t hash_;
    std::vector<Solved> solved_;
    std::vector<Part> parts_;
    std::atomic<std::size_t> next_{0};
    std::size_t resumed_ = 0;
    Clock::time_point begin_ = Clock::now();
    double saved_ = 0;
    std::atomic_flag busy_;
};

}  // namespace

TruthResults run_truth(const Scene& scene, const TruthRun& run) {
    const TruthOptions& o = run.options;
    require_valid(o);
    if (!(scene.gravity.norm() > 0)) throw InputError("the study needs a direction of gravity: it is zero");
    TruthResults results;
    results.options = o;
    results.arguments = run.arguments;
    results.material_name = scene.material_name;
    results.material = scene.material;
    results.models = truth_models();

    std::vector<Work> works;
    if (run.default_mesh) {
        for (const char* shape : {"sphere", "ellipsoid", "capsule"})
            works.push_back(mesh_work(
                o, scene, make_shape(fmt::format("{}:vertices={}", shape, run.default_vertices)), shape));
    } else {
        LoadedMesh loaded = load_mesh(scene.mesh, scene.unit, scene.normalize, scene.weld);
        results.warnings = std::move(loaded.notes);
        std::string name = std::filesystem::path(loaded.mesh.name).filename().string();
        works.push_back(mesh_work(o, scene, std::move(loaded.mesh), std::move(name)));
    }
    if (o.series) {
        works.push_back(sphere_work(o, scene.material, o.check_vertices, true));
        works.push_back(sphere_work(o, scene.material, o.sphere_vertices, false));
    }

    std::error_code failed;
    std::filesystem::create_directories(run.directory, failed);
    if (failed)
        throw RunError(fmt::format("{}: cannot be made: {}", run.directory.string(), failed.message()));
    Runner runner(std::move(works), run, results);
    for (const char* stale : {"summary.json", "report.html"})
        std::filesystem::remove(run.directory / stale, failed);
    results.stopped = !runner.run();
    if (results.stopped) return results;

    const std::vector<TruthShown> shown = runner.shown();
    results.figures = truth_figures(results, shown);
    for (const Figure& figure : results.figures)
        write_whole(run.directory / (figure.name + ".csv"), to_csv(figure));
    write_whole(run.directory / "truth.csv", to_csv(results));
    if (run.pictures) {
        if (std::string why = draw_figures(results.figures, run.directory, run.threads); !why.empty())
            results.warnings.push_back(std::move(why));
        results.pictures = write_truth_pictures(shown, run.directory, run.paint);
    }
    write_whole(run.directory / "summary.json", to_json(results));
    if (run.pictures) write_whole(run.directory / "report.html", to_html(results, run.directory));
    return results;
}

}  // namespace innerspring
