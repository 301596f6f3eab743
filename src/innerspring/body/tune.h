#pragma once
#include "innerspring/body/body.h"

namespace innerspring {

/// The same body, refined or not, of another material or scheme: masses, springs and damping by the formulas
/// of build_body(), about the same centre. Costs as much as the body. Throws InputError as resolve() does,
/// with all as before.
void tune(Body& body, const Material& material, Scheme scheme);

}  // namespace innerspring
