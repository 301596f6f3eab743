#include "innerspring/record/xml.h"

#include <cstddef>
#include <cstdint>

namespace innerspring {
namespace {

// Bytes of the valid UTF-8 sequence at the front of `s`, 0 if there is none. XML forbids the surrogates and
// U+FFFE, U+FFFF too.
std::size_t sequence_length(std::string_view s) {
    const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(s[i]); };
    if (byte(0) < 0x80) return 1;
    const std::size_t n = byte(0) >= 0xF0 && byte(0) < 0xF5   ? 4
                          : byte(0) >= 0xE0 && byte(0) < 0xF0 ? 3
                          : byte(0) >= 0xC2 && byte(0) < 0xE0 ? 2
                                                              : 0;
    if (n == 0 || s.size() < n) return 0;
    std::uint32_t code = byte(0) & (0x7Fu >> n);
    for (std::size_t i = 1; i < n; ++i) {
        if ((byte(i) & 0xC0) != 0x80) return 0;
        code = code << 6 | (byte(i) & 0x3Fu);
    }
    if (n == 3 && (code < 0x800 || (code >= 0xD800 && code < 0xE000) || code >= 0xFFFE)) return 0;
    if (n == 4 && (code < 0x10000 || code > 0x10FFFF)) return 0;
    return n;
}

}  // namespace

std::string clean_text(std::string_view text) {
    std::string clean;
    while (!text.empty()) {
        const std::size_t n = sequence_length(text);
        if (n == 0) {
            clean += '?';
        } else if (n == 1 && (text[0] < ' ' || text[0] == 0x7F)) {
            clean += ' ';
        } else {
            clean += text.substr(0, n);
        }
        text.remove_prefix(n == 0 ? 1 : n);
    }
    return clean;
}

std::string escape_xml(std::string_view text) {
    std::string escaped;
    for (const char c : clean_text(text)) {
        switch (c) {
            case '&':
                escaped += "&amp;";
                break;
            case '<':
                escaped += "&lt;";
                break;
            case '>':
                escaped += "&gt;";
                break;
            case '"':
                escaped += "&quot;";
                break;
            case '\'':
                escaped += "&apos;";
                break;
            default:
                escaped += c;
        }
    }
    return escaped;
}

}  // namespace innerspring
