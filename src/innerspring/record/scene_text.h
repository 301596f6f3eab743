#pragma once
#include <string>
#include <string_view>

namespace innerspring::scene_text {

/// Where the text came from: a file with lines, or an option of the command line.
struct Source {
    std::string name;
    bool lines;
};

inline constexpr std::size_t largest_file = 1 << 20;  ///< [byte]
inline constexpr int deepest_bracket = 8;             ///< force = [{profile = [[...]]}] needs 4

/// Throws InputError "NAME:LINE: message"; without the line if there is none.
[[noreturn]] void fail(const Source& source, std::size_t line, std::string_view message);

/// The user's own words for a message: one line, not too long, cut between characters.
std::string shown(std::string_view text, std::size_t longest = 60);

/// Refuses what would cost the parser much memory or stack: big files, deep brackets, keys of many dots. With
/// these limits toml++ takes at most 64 times the text (+ 1 MiB); without them a dotted key takes 100 times
/// its length and a stack frame per dot. A cheap look that knows TOML only as far as strings and comments
/// (and is right about them up to the first error); everything else is the parser's.
void require_shallow(const Source& source, std::string_view text);

}  // namespace innerspring::scene_text
