#include "innerspring/study/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/nearest_name.h"
#include "innerspring/mesh/write.h"

namespace innerspring {

namespace {

/// A case rests when no vertex is left with more than this share of the load.
constexpr double at_rest = 1e-3;

constexpr std::array<std::string_view, 5> kinds = {"refinement", "gravity", "force", "volume", "all"};

template <class Part>
void append(std::vector<Part>& all, std::vector<Part> more) {
    std::move(more.begin(), more.end(), std::back_inserter(all));
}

/// What an earlier study left here is not this one's.
void remove_results(const std::filesystem::path& directory, bool cases) {
    std::error_code ignored;
    for (const char* stale : {"summary.json", "report.html"})
        std::filesystem::remove(directory / stale, ignored);
    if (cases) std::filesystem::remove(directory / "cases.txt", ignored);
}

}  // namespace

std::string_view to_string(StudyKind kind) {
    return kinds[std::size_t(kind)];
}

StudyKind parse_study(std::string_view text) {
    for (std::size_t n = 0; n < kinds.size(); ++n)
        if (text == kinds[n]) return StudyKind(n);
    const std::string nearest = nearest_name(text, kinds);
    throw InputError(fmt::format("study '{}': expected refinement, gravity, force, volume, all or truth{}",
                                 text, nearest.empty() ? "" : "; did you mean " + nearest + "?"));
}

std::string study_command(const StudyResults& r, std::string_view study) {
    return fmt::format("innerspring study {} {}{}-o DIR", study, r.arguments, r.arguments.empty() ? "" : " ");
}

StudyResults run_study(const Scene& scene, const StudyRun& run) {
    StudyResults results;
    results.kind = run.kind;
    results.arguments = run.arguments;
    results.setting = set_up_study(scene, run.options);
    const Setting& s = results.setting;
    results.warnings = s.notes;
    const auto has = [&](StudyKind kind) { return run.kind == kind || run.kind == StudyKind::all; };

    std::vector<Job> jobs;
    std::vector<RefusedCentre> refused;
    if (has(StudyKind::gravity)) append(jobs, gravity_jobs(s, refused));
    if (has(StudyKind::refinement)) append(jobs, refinement_jobs(s));
    if (has(StudyKind::force)) append(jobs, force_jobs(s));
    if (has(StudyKind::volume)) append(jobs, volume_jobs(s));

    Responses responses;
    CasesOptions cases{s.sampling,      run.threads,  run.directory / "cases.txt",
                       setting_hash(s), run.progress, run.stop};
    if (run.resume) responses = read_cases(cases.file, cases.hash);
    std::error_code failed;
    std::filesystem::create_directories(run.directory, failed);
    if (failed)
        throw RunError(fmt::format("{}: cannot be made: {}", run.directory.string(), failed.message()));
    remove_results(run.directory, !run.resume);
    results.stopped = !run_cases(jobs, cases, responses);
    // The directory may hold cases of the other studies too.
    std::set<std::string_view> asked;
    for (const Job& job : jobs)
        for (const Case& c : job.cases) asked.insert(c.key);
    std::size_t moving = 0;
    for (const auto& [key, response] : responses) {
        if (!asked.contains(key)) continue;
        ++results.cases;
        results.largest_imbalance = std::max(results.largest_imbalance, response.imbalance);
        moving += response.imbalance > at_rest;
    }
    if (results.stopped) return results;
    if (moving > 0)
        results.warnings.push_back(fmt::format(
            "{} of {} cases have not quite come to rest: at the end up to {:.2g} of the load is left "
            "unbalanced on a vertex",
            moving, results.cases, results.largest_imbalance));

    std::vector<Figure> figures;
    if (has(StudyKind::refinement)) {
        results.refinement = refinement_study(s, responses);
        append(results.claims, claims_of(s, *results.refinement));
        append(figures, figures_of(s, *results.refinement, responses));
        write_whole(run.directory / "refinement.csv", to_csv(*results.refinement));
        for (const LoadKind load : load_kinds)
            write_whole(run.directory / fmt::format("refinement_series_{}.csv", to_string(load)),
                        refinement_series_csv(s, responses, load));
    }
    if (has(StudyKind::gravity)) {
        results.gravity = gravity_study(s, responses, std::move(refused));
        append(results.claims, claims_of(s, *results.gravity));
        append(figures, figures_of(s, *results.gravity));
        write_whole(run.directory / "gravity.csv", to_csv(*results.gravity));
        if (run.pictures) write_whole(run.directory / "fig7.png", to_png(gravity_picture(s, run.paint)));
    }
    if (has(StudyKind::force)) {
        results.force = force_study(s, responses);
        append(results.claims, claims_of(s, *results.force));
        append(figures, figures_of(s, *results.force));
        write_whole(run.directory / "force.csv", to_csv(*results.force));
    }
    if (has(StudyKind::volume)) {
        results.volume = volume_study(s, responses);
        append(results.claims, claims_of(s, *results.volume));
        append(figures, figures_of(s, *results.volume));
        write_whole(run.directory / "volume.csv", to_csv(*results.volume));
    }
    for (const Figure& figure : figures) write_whole(run.directory / (figure.name + ".csv"), to_csv(figure));
    write_whole(run.directory / "summary.json", to_json(results));
    if (run.pictures) {
        if (std::string why = draw_figures(figures, run.directory, run.threads); !why.empty())
            results.warnings.push_back(std::move(why));
        write_whole(run.directory / "report.html", to_html(results, figures, run.directory));
    }
    return results;
}

}  // namespace innerspring
