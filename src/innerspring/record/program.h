#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace innerspring {

/// What a program that was run left.
struct ProgramOutput {
    std::string failure;  ///< why it could not be run or did not end by itself, in one line; else empty
    std::string out, err;
    int status = 0;  ///< what it returned; -1 if a signal ended it
};

/// Runs a program found on the PATH and waits for it, at most `patience_s` seconds. Nothing can block: input
/// and output are unnamed temporary files, not pipes.
ProgramOutput run_program(const std::vector<std::string>& command, std::string_view input, int patience_s);

/// The last line that says something: programs put their reason there.
std::string last_line(const std::string& text);

}  // namespace innerspring
