#pragma once
// Private to the readers: lines, words and numbers of a text, with the line number for messages.
#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>

#include "innerspring/mesh/read_formats.h"

namespace innerspring {

inline constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

inline bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

/// A signed integer in decimal, a leading '+' allowed; nothing if `word` is anything else or too large.
inline std::optional<std::int64_t> parse_integer(std::string_view word) {
    if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
}

/// A number as C writes it, whatever the locale, a leading '+' allowed. Too small for a double is 0, too
/// large is infinite.
inline std::optional<double> parse_number(std::string_view word) {
    if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::invalid_argument || end != word.data() + word.size()) return std::nullopt;
    if (error == std::errc()) return value;
    // Out of range either way; from_chars does not say which. The power of ten of the first digit that is not
    // 0 does.
    const std::size_t e = word.find_first_of("eE");
    const std::string_view digits = word.substr(0, e);
    const std::string_view exponent = e == word.npos ? "0" : word.substr(e + 1);
    const auto power = parse_integer(exponent);
    if (!power) return exponent.starts_with('-') ? 0 : std::numeric_limits<double>::infinity();
    const auto point = std::int64_t(std::min(digits.find('.'), digits.size()));
    const auto first = std::int64_t(digits.find_first_of("123456789"));
    return *power < first - point ? 0 : std::numeric_limits<double>::infinity();
}

struct TextScanner {
    std::string_view name;       ///< of the file, for messages
    std::string_view rest;       ///< what follows the current line
    char comment = 0;            ///< starts a comment, 0: there are none
    bool continues = false;      ///< a line ending in a backslash goes on in the next one
    std::string_view line = {};  ///< what is left of the current line
    std::size_t number = 0;      ///< of the current line, from 1

    /// Goes to the next line that holds a word; false at the end of the text.
    bool next_row() {
        while (continues && line.ends_with('\\'))
            if (!take_line()) return false;
        while (take_line()) {
            skip_blanks();
            if (!line.empty()) return true;
        }
        return false;
    }

    /// The next word of this line, empty at its end.
    std::string_view word() {
        skip_blanks();
        while (continues && line == "\\") {
            take_line();
            skip_blanks();
        }
        std::size_t end = 0;
        while (end < line.size() && !is_blank(line[end])) ++end;
        if (continues && end == line.size() && line.ends_with('\\')) --end;
        const std::string_view found = line.substr(0, end);
        line.remove_prefix(end);
        return found;
    }

    /// The next word of this line or the following ones, empty at the end of the text.
    std::string_view word_on_any_line() {
        for (;;)
            if (const std::string_view found = word(); !found.empty() || !next_row()) return found;
    }

    [[noreturn]] void fail(std::string_view message) const { fail_at_line(name, number, message); }

    /// A word as a coordinate: a number, finite, not huge.
    double coordinate(std::string_view found) const {
        const std::optional<double> x = parse_number(found);
        if (!x) fail(fmt::format("coordinate {} is not a number; write it like -1.25e-3", quoted(found)));
        if (const std::string_view fault = coordinate_fault(*x); !fault.empty())
            fail(fmt::format("coordinate {} {}", quoted(found), fault));
        return *x;
    }

    /// The next three words as a vertex.
    void add_vertex(SurfaceMesh& mesh) {
        if (is_full(mesh)) fail(full_message);
        Vector p;
        for (int i = 0; i < 3; ++i) {
            const std::string_view found = word();
            if (found.empty())
                fail(fmt::format("vertex with {} coordinate{}; it needs three", i, i == 1 ? "" : "s"));
            p[i] = coordinate(found);
        }
        mesh.positions.push_back(p);
    }

  private:
    void skip_blanks() {
        std::size_t n = 0;
        while (n < line.size() && is_blank(line[n])) ++n;
        line.remove_prefix(n);
    }

    /// LF, CR LF and CR all end a line.
    bool take_line() {
        line = {};
        if (rest.empty()) return false;
        if (number++ == 0 && rest.starts_with(byte_order_mark)) rest.remove_prefix(byte_order_mark.size());
        std::size_t end = 0;
        while (end < rest.size() && rest[end] != '\n' && rest[end] != '\r') ++end;
        line = rest.substr(0, end);
        rest.remove_prefix(end);
        rest.remove_prefix(rest.starts_with("\r\n") ? 2 : rest.empty() ? 0 : 1);
        if (comment != 0) line = line.substr(0, line.find(comment));
        while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
        return true;
    }
};

}  // namespace innerspring
