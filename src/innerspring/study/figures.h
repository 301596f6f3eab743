#pragma once
#include "innerspring/record/plot.h"
#include "innerspring/study/claims.h"

namespace innerspring {

/// A plot with its numbers as a table: the curves' x once, then a column for each curve.
struct Figure {
    std::string name;     ///< of the files: NAME.csv, NAME.svg, NAME.png
    std::string caption;  ///< one or two sentences
    std::string study;    ///< the command that shows it
    Plot plot;
    std::string x_column;                ///< with unit
    std::vector<std::string> y_columns;  ///< with unit, one for each curve that goes into the table
};

std::vector<Figure> figures_of(const Setting& setting, const RefinementStudy& study,
                               const Responses& responses);
std::vector<Figure> figures_of(const Setting& setting, const GravityStudy& study);
std::vector<Figure> figures_of(const Setting& setting, const ForceStudy& study);
std::vector<Figure> figures_of(const Setting& setting, const VolumeStudy& study);

/// Draws NAME.svg and NAME.png of each. Returns why one is missing, or nothing.
std::string draw_figures(const std::vector<Figure>& figures, const std::filesystem::path& directory,
                         int threads);

/// The table of a figure. Curves beyond the columns (the lines of a law) are not in it.
std::string to_csv(const Figure& figure);

/// Displacement over time of every case of one kind of load, before and after refinement, thinned to at most
/// 60 rows each: scheme, levels, vertex, force_n, time_s, then coarse and refined displacement of the load
/// and the vertex [m].
std::string refinement_series_csv(const Setting& setting, const Responses& responses, LoadKind load);

/// All rows of a study, as in summary.json.
std::string to_csv(const RefinementStudy& study);
std::string to_csv(const GravityStudy& study);
std::string to_csv(const ForceStudy& study);
std::string to_csv(const VolumeStudy& study);

}  // namespace innerspring
