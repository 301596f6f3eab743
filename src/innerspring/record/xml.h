#pragma once
#include <string>
#include <string_view>

namespace innerspring {

/// `text` as UTF-8 that any XML 1.0 parser takes: control characters become spaces, bytes that are not UTF-8
/// question marks.
std::string clean_text(std::string_view text);

/// clean_text with the five special characters of XML escaped.
std::string escape_xml(std::string_view text);

}  // namespace innerspring
