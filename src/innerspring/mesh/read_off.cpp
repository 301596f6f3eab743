#include <algorithm>

#include "innerspring/mesh/text_scanner.h"

namespace innerspring {

namespace {

struct Counts {
    std::uint64_t vertices = 0, faces = 0;
};

std::uint64_t parse_count(TextScanner& scanner, std::string_view what) {
    const std::string_view word = scanner.word();
    const std::optional<std::int64_t> count = parse_integer(word);
    if (!count || *count < 0)
        scanner.fail(
            fmt::format("the number of {} is {}; after OFF come the numbers of vertices, faces and edges",
                        what, word.empty() ? "missing" : quoted(word)));
    return std::uint64_t(*count);
}

/// "OFF" with any of the prefixes ST, C, N for what follows the coordinates of a vertex; the keyword may be
/// left out, and the counts may follow on the same line.
Counts read_header(TextScanner& scanner) {
    if (!scanner.next_row()) scanner.fail("nothing but blanks and comments; OFF starts with the word OFF");
    const std::string_view row = scanner.line;
    const std::string_view keyword = scanner.word();
    if (keyword.find_first_not_of("+0123456789") == keyword.npos) {
        scanner.line = row;
    } else {
        std::string_view prefix = keyword;
        if (!prefix.ends_with("OFF"))
            scanner.fail(fmt::format("{} where the word OFF is due", quoted(keyword)));
        prefix.remove_suffix(3);
        for (const std::string_view letters : {"ST", "C", "N"})
            if (prefix.starts_with(letters)) prefix.remove_prefix(letters.size());
        if (!prefix.empty())
            scanner.fail(fmt::format("OFF variant {} is not read; save as plain OFF in three dimensions",
                                     quoted(keyword)));
        const std::string_view after = scanner.line;
        if (scanner.word() == "BINARY") scanner.fail("binary OFF is not read; save as text");
        scanner.line = after;
        if (after.empty() && !scanner.next_row())
            scanner.fail("the file ends before the numbers of vertices and faces");
    }
    Counts counts;
    counts.vertices = parse_count(scanner, "vertices");
    counts.faces = parse_count(scanner, "faces");
    return counts;  // the number of edges is of no use, and often wrong or missing
}

void read_face(TextScanner& scanner, SurfaceMesh& mesh) {
    const std::string_view size = scanner.word();
    const std::optional<std::int64_t> corners = parse_integer(size);
    if (!corners || *corners < 3)
        scanner.fail(fmt::format("face with {} corners; a face starts with their number, three or more",
                                 quoted(size)));
    Fan fan{mesh};
    while (std::int64_t(fan.corners) < *corners) {
        const std::string_view word = scanner.word();
        if (word.empty())
            scanner.fail(fmt::format("face of {} corners lists only {}", *corners, fan.corners));
        const std::optional<std::int64_t> index = parse_integer(word);
        if (!index)
            scanner.fail(
                fmt::format("vertex index {} is not a whole number; correct the face", quoted(word)));
        if (*index < 0 || *index >= std::int64_t(mesh.positions.size()))
            scanner.fail(
                fmt::format("vertex index {} is out of range; the file has {} vertices, counted from 0",
                            *index, mesh.positions.size()));
        fan.add(Index(*index));
    }
}

}  // namespace

SurfaceMesh read_off(std::string_view bytes, std::string_view name) {
    TextScanner scanner{.name = name, .rest = bytes, .comment = '#'};
    SurfaceMesh mesh;
    mesh.name = name;
    const Counts counts = read_header(scanner);
    auto row = [&](std::string_view what, std::uint64_t n, std::uint64_t count) {
        if (!scanner.next_row())
            scanner.fail(fmt::format(
                "the file ends after {} of {} {}; it is cut short or its counts are wrong", n, count, what));
    };
    // The shortest rows are "0 0 0" and "3 0 0 0".
    mesh.positions.reserve(std::min<std::uint64_t>(counts.vertices, scanner.rest.size() / 6 + 1));
    for (std::uint64_t n = 0; n < counts.vertices; ++n) {
        row("vertices", n, counts.vertices);
        scanner.add_vertex(mesh);
    }
    mesh.triangles.reserve(std::min<std::uint64_t>(counts.faces, scanner.rest.size() / 8 + 1));
    for (std::uint64_t n = 0; n < counts.faces; ++n) {
        row("faces", n, counts.faces);
        read_face(scanner, mesh);
    }
    if (scanner.next_row())
        scanner.fail(fmt::format("{} after the last of {} faces; correct the counts", quoted(scanner.word()),
                                 counts.faces));
    return mesh;
}

}  // namespace innerspring
