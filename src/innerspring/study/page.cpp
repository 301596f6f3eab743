#include "innerspring/study/page.h"

#include <fmt/format.h>

#include <cstdint>
#include <fstream>
#include <iterator>

#include "innerspring/record/xml.h"

namespace innerspring {

namespace {

constexpr std::string_view style = R"(
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fff; max-width: 1180px; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.7rem; margin-bottom: .2rem; } h2 { font-size: 1.3rem; margin: 2.4rem 0 .6rem; border-bottom: 1px solid #ddd; }
p.lead { color: #555; margin-top: 0; }
table { border-collapse: collapse; width: 100%; font-size: .88rem; }
th, td { text-align: left; vertical-align: top; padding: .4rem .6rem; border-bottom: 1px solid #e4e4e4; }
th { border-bottom: 2px solid #bbb; } tr.group th { padding-top: 1.2rem; border-bottom: 1px solid #bbb; } tr.group code { font-weight: 400; margin-left: .6em; } small { color: #666; } td.number { white-space: nowrap; font-variant-numeric: tabular-nums; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1.2rem; font-size: .92rem; } dt { color: #666; } dd { margin: 0; }
.verdict { font-weight: 600; white-space: nowrap; } .holds { color: #00694c; } .only { color: #955000; } .fails { color: #b02020; } .open { color: #666; }
.figures { display: grid; grid-template-columns: repeat(auto-fill, minmax(520px, 1fr)); gap: 1.2rem; }
figure { margin: 0; } img { max-width: 100%; height: auto; display: block; }
figcaption { font-size: .85rem; color: #444; } code { font: .85em ui-monospace, monospace; background: #f4f4f4; padding: 0 .25em; overflow-wrap: anywhere; }
@media print { figure, tr { break-inside: avoid; } }
)";

std::string base64(std::string_view bytes) {
    static constexpr std::string_view digits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve(bytes.size() * 4 / 3 + 4);
    for (std::size_t n = 0; n < bytes.size(); n += 3) {
        std::uint32_t three = 0;
        for (std::size_t k = 0; k < 3; ++k)
            three = three << 8 | (n + k < bytes.size() ? static_cast<unsigned char>(bytes[n + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            text += n + k > bytes.size() ? '=' : digits[three >> (18 - 6 * k) & 63];
    }
    return text;
}

std::string bytes_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

std::string page_head(std::string_view title) {
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width\">\n<title>innerspring: {}</title>\n"
        "<style>{}</style>\n</head>\n<body>\n",
        title, style);
}

std::string embedded(const std::filesystem::path& file, std::string_view type, std::string_view alt) {
    const std::string bytes = bytes_of(file);
    if (bytes.empty()) return fmt::format("<p>No picture: {}.</p>", escape_xml(file.filename().string()));
    return fmt::format("<img src=\"data:image/{};base64,{}\" alt=\"{}\">", type, base64(bytes),
                       escape_xml(alt));
}

}  // namespace innerspring
