#include "innerspring/record/scene_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "innerspring/mesh/error.h"

namespace innerspring::scene_text {

void fail(const Source& source, std::size_t line, std::string_view message) {
    if (source.lines && line > 0) throw InputError(fmt::format("{}:{}: {}", source.name, line, message));
    throw InputError(fmt::format("{}: {}", source.name, message));
}

std::string shown(std::string_view text, std::size_t longest) {
    std::size_t end = std::min(text.size(), longest);
    while (end < text.size() && end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
    std::string s(text.substr(0, end));
    for (char& c : s)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
    return end < text.size() ? s + "..." : s;
}

namespace {

/// The index just behind the string that opens at `i`. An unclosed one ends with its line or the text; there
/// the parser complains.
std::size_t after_string(std::string_view text, std::size_t i, std::size_t& line) {
    const char quote = text[i];
    const std::string triple(3, quote);
    const bool multi_line = text.substr(i, 3) == triple;
    for (i += multi_line ? 3 : 1; i < text.size(); ++i) {
        if (text[i] == '\\' && quote == '"') {
            if (i + 1 < text.size() && text[i + 1] != '\n') ++i;
        } else if (text[i] == '\n') {
            if (!multi_line) return i;
            ++line;
        } else if (text[i] == quote && (!multi_line || text.substr(i, 3) == triple)) {
            i += multi_line ? 3 : 1;
            for (int extra = 0; multi_line && extra < 2 && i < text.size() && text[i] == quote; ++extra) ++i;
            return i;
        }
    }
    return i;
}

bool may_begin_name(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '"' || c == '\'' || c == ']';  // of ] the parser complains itself
}

/// At the [ of a table: a name must follow, which the parser of toml++ 3.3 takes for granted.
void require_name(const Source& source, std::string_view text, std::size_t i, std::size_t line) {
    i += text.substr(i, 2) == "[[" ? 2 : 1;
    while (i < text.size() && (text[i] == ' ' || text[i] == '\t')) ++i;
    if (i < text.size() && !may_begin_name(text[i]))
        fail(source, line, "a table without a name; write [name] or [[name]]");
}

}  // namespace

void require_shallow(const Source& source, std::string_view text) {
    if (text.size() > largest_file) fail(source, 0, "larger than 1 MiB; this is not a scene");
    std::size_t line = 1;
    int depth = 0, dots = 0;
    bool line_begins = true;
    for (std::size_t i = 0; i < text.size();) {
        const char c = text[i];
        if (c == '"' || c == '\'') {
            i = after_string(text, i, line);
            line_begins = false;
            continue;
        }
        if (c == '#') {
            i = std::min(text.find('\n', i), text.size());
            continue;
        }
        if (c == '\n') ++line;
        if (c == '[' && depth == 0 && line_begins) require_name(source, text, i, line);
        line_begins = c == '\n' || (line_begins && (c == ' ' || c == '\t'));
        if (c == '[' || c == '{') ++depth;
        if ((c == ']' || c == '}') && depth > 0) --depth;
        if (c == '.') ++dots;
        if (c == '=' && depth > 0 && dots > 0)
            fail(source, line, "a dot in a key between braces; write the keys of one table only");
        if (c == '\n' || c == ',' || c == '=' || c == '[' || c == ']' || c == '{' || c == '}') dots = 0;
        if (depth > deepest_bracket) fail(source, line, "brackets nest deeper than in any scene");
        if (dots > 1)
            fail(source, line, "two dots in one key or number; a scene has no tables within tables");
        ++i;
    }
}

}  // namespace innerspring::scene_text
