#include "innerspring/mesh/read.h"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/text_scanner.h"

namespace innerspring {

namespace {

/// Keeps messages on one line. Bytes beyond ASCII stay in names, where they are letters of UTF-8, and are
/// escaped in tokens.
std::string printable(std::string_view text, bool keep_letters) {
    std::string out;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7f || (byte >= 0x80 && !keep_letters))
            fmt::format_to(std::back_inserter(out), "\\x{:02x}", byte);
        else
            out += c;
    }
    return out;
}

bool has_extension(std::string_view name, std::string_view extension) {
    if (name.size() < extension.size()) return false;
    name.remove_prefix(name.size() - extension.size());
    for (std::size_t n = 0; n < name.size(); ++n)
        if ((name[n] >= 'A' && name[n] <= 'Z' ? char(name[n] - 'A' + 'a') : name[n]) != extension[n])
            return false;
    return true;
}

/// Control characters other than the blanks and line ends of a text.
bool looks_binary(std::string_view bytes) {
    for (const char c : bytes.substr(0, 1024))
        if (const auto byte = static_cast<unsigned char>(c); byte < 0x09 || (byte > 0x0d && byte < 0x20))
            return true;
    return false;
}

bool is_off_keyword(std::string_view word) {
    return word.ends_with("OFF") && word.find_first_not_of("STCNOF4n") == word.npos;
}

bool is_obj_statement(std::string_view word) {
    constexpr std::array<std::string_view, 14> statements{
        "v", "vt", "vn", "vp", "f", "l", "p", "o", "g", "s", "mtllib", "usemtl", "usemap", "maplib"};
    for (const std::string_view statement : statements)
        if (word == statement) return true;
    return false;
}

}  // namespace

std::string quoted(std::string_view token) {
    constexpr std::size_t most = 40;
    return fmt::format("'{}{}'", printable(token.substr(0, most), false), token.size() > most ? "..." : "");
}

void fail_in_file(std::string_view name, std::string_view message) {
    throw InputError(fmt::format("{}: {}", printable(name, true), message));
}

void fail_at_line(std::string_view name, std::size_t line, std::string_view message) {
    throw InputError(fmt::format("{}:{}: {}", printable(name, true), line, message));
}

void fail_at_byte(std::string_view name, std::size_t byte, std::string_view message) {
    throw InputError(fmt::format("{}: byte {}: {}", printable(name, true), byte, message));
}

std::string_view coordinate_fault(double x) {
    if (!std::isfinite(x)) return "is not finite; repair the vertex";
    if (std::abs(x) > largest_coordinate) return "is beyond 1e30; scale the mesh down";
    return {};
}

MeshFormat detect_format(std::string_view bytes, std::string_view name) {
    if (bytes.empty()) fail_in_file(name, "the file is empty");
    // The size decides first, because the header of a binary STL may hold any text, "solid" included.
    constexpr std::size_t start = 84, row = 50;
    std::uint32_t count = 0;
    if (bytes.size() >= start) {
        std::memcpy(&count, bytes.data() + 80, 4);
        if (bytes.size() == start + row * std::uint64_t(count)) return MeshFormat::stl_binary;
    }
    TextScanner scanner{.name = name, .rest = bytes, .comment = '#'};
    scanner.next_row();
    const std::string_view first = scanner.word();
    if (first == "ply") return MeshFormat::ply;
    if (is_off_keyword(first)) return MeshFormat::off;
    if (looks_binary(bytes)) {
        const bool holds_triangles =
            count > 0 && bytes.size() > start && count <= (bytes.size() - start) / row;
        if (holds_triangles || has_extension(name, ".stl")) return MeshFormat::stl_binary;
    }
    if (first == "solid" || first == "SOLID" || first == "Solid") return MeshFormat::stl_text;
    if (is_obj_statement(first)) return MeshFormat::obj;
    if (has_extension(name, ".obj")) return MeshFormat::obj;
    if (has_extension(name, ".stl")) return MeshFormat::stl_text;
    if (has_extension(name, ".ply")) return MeshFormat::ply;
    if (has_extension(name, ".off")) return MeshFormat::off;
    fail_in_file(name, "unknown format; OBJ, STL, PLY and OFF are read");
}

SurfaceMesh read_from_memory(std::string_view bytes, std::string_view name) {
    auto read_format = [&] {
        switch (detect_format(bytes, name)) {
            case MeshFormat::obj:
                return read_obj(bytes, name);
            case MeshFormat::stl_text:
                return read_stl_text(bytes, name);
            case MeshFormat::stl_binary:
                return read_stl_binary(bytes, name);
            case MeshFormat::ply:
                return read_ply(bytes, name);
            case MeshFormat::off:
                return read_off(bytes, name);
        }
        return SurfaceMesh{};
    };
    SurfaceMesh mesh = read_format();
    if (mesh.triangles.empty()) fail_in_file(name, "no triangle; save the surface with its faces");
    return mesh;
}

SurfaceMesh read(const std::filesystem::path& file) {
    const std::string name = file.string();
    std::error_code error;
    const auto kind = std::filesystem::status(file, error).type();
    if (kind == std::filesystem::file_type::not_found) fail_in_file(name, "no such file");
    if (error) fail_in_file(name, fmt::format("cannot be read: {}", error.message()));
    if (kind == std::filesystem::file_type::directory) fail_in_file(name, "is a directory; name a mesh file");
    if (kind == std::filesystem::file_type::block) fail_in_file(name, "is a device; name a mesh file");

    errno = 0;
    std::ifstream in(file, std::ios::binary);
    std::string bytes;
    if (kind == std::filesystem::file_type::regular) bytes.reserve(std::filesystem::file_size(file, error));
    std::array<char, 1 << 16> part;
    while (in.read(part.data(), part.size()) || in.gcount() > 0)
        bytes.append(part.data(), std::size_t(in.gcount()));
    if (!in.eof()) fail_in_file(name, fmt::format("cannot be read: {}", std::strerror(errno)));
    return read_from_memory(bytes, name);
}

}  // namespace innerspring
