#pragma once
#include <optional>

#include "innerspring/study/figures.h"
#include "innerspring/study/truth_models.h"

namespace innerspring {

// The surface-only body judged by linear elasticity: the same surface, the same load at every point of it,
// and the displacement of the surface compared.

struct TruthOptions {
    double sphere_poisson = 0.5;    ///< nu of the series
    double element_poisson = 0.49;  ///< nu of the elements; at most largest_element_poisson
    int patches = 3;                ///< where normal loads act, spread over the surface; 1 .. 100
    double patch_share = 0.4;       ///< radius of the larger patch, of R; the other is half of it
    double amplitude = 1e-3;        ///< loads are such that the reference moves by this at most, of R
    double held_share = 0.15;       ///< of the height along gravity: what lies below is held
    int sphere_vertices = 10242;    ///< of the sphere judged by the series; at least 42
    int check_vertices = 1000;      ///< of the sphere on which the elements are judged by the series
    int tetrahedra = 0;  ///< about so many in each mesh, 0.9 to 3 times; 0: as few as keep their shape
    bool series = true;  ///< with what the series judges; false: the meshes alone
};

/// What one model answered to one load, against the reference. Ratios are 1 and errors 0 where it is right.
struct TruthRow {
    std::string subject, reference, load, model;
    double force_group = 0;  ///< F/(E R^2), F the sum of the loads' magnitudes
    double l2_error = 0;     ///< sqrt(sum A_i |u - u*|^2 / sum A_i |u*|^2)
    double peak_error = 0;   ///< largest |u - u*| over largest |u*|
    double peak_ratio = 0;   ///< u along u* where |u*| is largest, over |u*|
    double work_ratio = 0;   ///< sum f.u / sum f.u*: how soft the load finds it
    double swept_share = 0;  ///< (dV - dV*) / (integral of |u*.n|): volume gained or lost, of what moves
    double volume_percent = 0, reference_volume_percent = 0;  ///< 100 dV/V and 100 dV*/V, first order
    std::optional<double> pole, reference_pole;               ///< squeeze: inward at the poles, u E R/F
    std::optional<double> equator, reference_equator;         ///< squeeze: outward at the equator, u E R/F
};

/// Compares a model's displacements with the reference's. `nodal` are the load's forces.
TruthRow compare(const TruthSubject& subject, const TruthLoad& load, std::span<const Vector> nodal,
                 std::span<const Vector> reference, std::span<const Vector> answer);

struct TruthSubjectInfo {
    std::string name, reference;
    std::size_t vertices = 0, triangles = 0, held = 0;
    std::size_t tetrahedra = 0, nodes = 0;  ///< of the elements; 0 where there are none
    double radius_m = 0, poisson = 0;
};

struct TruthRun {
    TruthOptions options;
    bool default_mesh = true;         ///< sphere, ellipsoid and capsule instead of the scene's mesh
    int default_vertices = 1000;      ///< of each of those
    std::filesystem::path directory;  ///< made if missing
    std::string arguments;            ///< mesh and options as given, for the report
    bool resume = false;              ///< take the elements' answers that the directory has
    bool pictures = true;
    Painter paint = draw;  ///< of the pictures
    int threads = 0;       ///< 0: all cores; the same bytes
    std::function<void(const StudyProgress&)> progress = {};
    const std::atomic<bool>* stop = nullptr;
};

struct TruthResults {
    TruthOptions options;
    std::string arguments;
    std::string material_name;
    Material material;  ///< as asked for
    std::vector<TruthSubjectInfo> subjects;
    std::vector<TruthModel> models;  ///< that were judged
    std::vector<TruthRow> rows;      ///< by subject, load, model
    std::vector<Figure> figures;
    std::vector<std::string> pictures;  ///< names of PNG files
    std::vector<std::string> warnings;
    bool stopped = false;
};

/// Runs the comparison and writes summary.json, truth.csv, a CSV, SVG and PNG per figure, pictures,
/// report.html, and truth_cases.txt for resuming. The same scene and options give the same bytes;
/// pictures as far as the painter does. Throws InputError for bad input, RunError if tetgen is missing or
/// something fails.
TruthResults run_truth(const Scene& scene, const TruthRun& run);

std::string to_json(const TruthResults& results);
std::string to_csv(const TruthResults& results);
std::string to_html(const TruthResults& results, const std::filesystem::path& directory);

}  // namespace innerspring
