#pragma once
#include <stdexcept>

namespace innerspring {

/// What the user gave cannot be used: one line saying what is wrong, where (file and line, element, key), and
/// what to do. The command line prints it and exits with 2. A numerical failure is RunError (exit 1).
struct InputError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A run that was well posed did not succeed (blow-up, no convergence, disk full).
struct RunError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace innerspring
