#pragma once
#include <span>
#include <string>
#include <string_view>

namespace innerspring {

/// The candidate with the least edit distance to `word`; empty if none is near enough to be meant. For
/// "unknown key" messages.
std::string nearest_name(std::string_view word, std::span<const std::string_view> candidates);

}  // namespace innerspring
