#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace innerspring {

// What the reports of the studies share: one HTML page that needs no other file and no network.

/// From the first line to <body>, with the style. `title` is already escaped.
std::string page_head(std::string_view title);

/// A picture inside the page ("svg+xml", "png"), or its name where there is none.
std::string embedded(const std::filesystem::path& file, std::string_view type, std::string_view alt);

}  // namespace innerspring
