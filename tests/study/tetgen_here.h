#pragma once
#include "innerspring/record/program.h"

namespace innerspring {

/// TetGen is a program of its own; where it is not installed, tests that need it are skipped and say so.
inline bool tetgen_here() {
    return run_program({"tetgen", "-h"}, "", 10).failure.empty();
}

}  // namespace innerspring
