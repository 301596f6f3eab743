#pragma once
#include <optional>

#include "innerspring/study/claims.h"
#include "innerspring/study/figures.h"

namespace innerspring {

/// Which of the paper's experiments; volume is Fig. 9 with Poisson's ratio.
enum class StudyKind { refinement, gravity, force, volume, all };
std::string_view to_string(StudyKind kind);
StudyKind parse_study(std::string_view text);  ///< throws InputError

struct StudyRun {
    StudyKind kind = StudyKind::all;
    StudyOptions options;
    std::filesystem::path directory;  ///< made if missing
    std::string arguments;            ///< mesh and options as given, for the commands in the report
    bool resume = false;              ///< take the cases that the directory has from a run that was stopped
    bool pictures = true;             ///< false: tables and numbers only, no report
    Painter paint = draw;             ///< of the pictures
    int threads = 0;                  ///< 0: all cores; the results are the same bits
    std::function<void(const StudyProgress&)> progress = {};
    const std::atomic<bool>* stop = nullptr;
};

/// What the studies found; what summary.json holds.
struct StudyResults {
    Setting setting;
    StudyKind kind = StudyKind::all;
    std::string arguments;
    std::optional<RefinementStudy> refinement;
    std::optional<GravityStudy> gravity;
    std::optional<ForceStudy> force;
    std::optional<VolumeStudy> volume;
    std::vector<Claim> claims;
    std::vector<std::string> warnings;
    std::size_t cases = 0;  ///< simulations
    double largest_imbalance =
        0;                 ///< of all cases, at the end: largest force left on a vertex, of the load [1]
    bool stopped = false;  ///< by StudyRun::stop: only the finished cases are saved
};

/// Runs the studies on the scene's mesh, material, centre and gravity (its scheme, forces and Poisson's ratio
/// play no part) and writes into the directory: summary.json, report.html, a CSV, SVG and PNG for each
/// figure, CSVs of all rows and of displacements over time, and cases.txt for resuming. The same scene and
/// options give the same bytes, whatever the threads and whether or not stopped in between; pictures as far
/// as the painter does. Throws InputError for bad input, RunError for a blow-up or a file that cannot be
/// written.
StudyResults run_study(const Scene& scene, const StudyRun& run);

/// "innerspring study refinement sphere -o DIR": what shows a claim or figure again.
std::string study_command(const StudyResults& results, std::string_view study);

std::string to_json(const StudyResults& results);

/// One HTML page with everything in it; pictures are taken from the directory, those that are missing are
/// named.
std::string to_html(const StudyResults& results, const std::vector<Figure>& figures,
                    const std::filesystem::path& directory);

}  // namespace innerspring
