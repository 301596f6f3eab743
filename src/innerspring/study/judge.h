#pragma once
#include "innerspring/study/claims.h"

namespace innerspring {

/// A number that a claim bounds, at one force (and level or centre: `where`).
struct Judged {
    double group = 0;   ///< F/(E R^2); 0: it is not about a force
    std::string where;  ///< what tells it from the others at the same force; may be empty
    double number = 0;
};

/// Fills in the outcome, the number (the worst) and the condition: holds if no number exceeds the threshold,
/// fails if all do, else holds only where they do not.
void judge(Claim& claim, const std::vector<Judged>& numbers);

}  // namespace innerspring
