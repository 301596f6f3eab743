#pragma once

#include "support/sanitized.h"

namespace innerspring::support {

/// Calls of operator new so far in this test program; always 0 under a sanitizer.
long allocations();

}  // namespace innerspring::support
