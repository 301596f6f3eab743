#pragma once
#include "innerspring/study/truth.h"

namespace innerspring {

/// Answers that are drawn: the reference first, then each model.
struct TruthShown {
    const TruthSubject* subject;
    const TruthLoad* load;
    bool series;  ///< the reference
    std::vector<std::pair<std::string, std::vector<Vector>>> answers;
};

/// The sphere's modes (compliance over n) and squeezes (radial displacement over the angle).
std::vector<Figure> truth_figures(const TruthResults& results, const std::vector<TruthShown>& shown);

/// Gravity and the first patch on every mesh: the reference and the models side by side, displacements
/// magnified, in the reference's range of colours. Returns the names of the files.
std::vector<std::string> write_truth_pictures(const std::vector<TruthShown>& shown,
                                              const std::filesystem::path& directory, const Painter& paint);

}  // namespace innerspring
