#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstring>

#include "innerspring/mesh/team.h"
#include "innerspring/mesh/text_scanner.h"

namespace innerspring {

namespace {

static_assert(std::endian::native == std::endian::little, "STL and PLY are loaded as they lie in memory");

bool same_keyword(std::string_view word, std::string_view keyword) {
    return std::equal(word.begin(), word.end(), keyword.begin(), keyword.end(),
                      [](char a, char b) { return (a >= 'A' && a <= 'Z' ? char(a - 'A' + 'a') : a) == b; });
}

/// Reads `keyword`, after as many as `skip` other words.
void expect(TextScanner& scanner, std::string_view keyword, int skip = 0) {
    std::string_view word = scanner.word_on_any_line();
    while (skip-- > 0 && !same_keyword(word, keyword)) word = scanner.word_on_any_line();
    if (word.empty()) scanner.fail(fmt::format("the file ends where '{}' is due; it is cut short", keyword));
    if (!same_keyword(word, keyword))
        scanner.fail(fmt::format("{} where '{}' is due; STL holds triangles only", quoted(word), keyword));
}

/// What stands between "facet" and "endfacet". The normal is not used, so it may be missing or not a number.
void read_facet(TextScanner& scanner, SurfaceMesh& mesh) {
    expect(scanner, "outer", 4);
    expect(scanner, "loop");
    const Index first = Index(mesh.positions.size());
    for (int corner = 0; corner < 3; ++corner) {
        expect(scanner, "vertex");
        scanner.add_vertex(mesh);
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
    expect(scanner, "endloop");
    expect(scanner, "endfacet");
}

}  // namespace

SurfaceMesh read_stl_text(std::string_view bytes, std::string_view name) {
    TextScanner scanner{.name = name, .rest = bytes};
    SurfaceMesh mesh;
    mesh.name = name;
    for (std::string_view word = scanner.word_on_any_line(); !word.empty();
         word = scanner.word_on_any_line()) {
        if (!same_keyword(word, "solid")) scanner.fail(fmt::format("{} where 'solid' is due", quoted(word)));
        scanner.line = {};  // the name of the solid
        for (;;) {
            word = scanner.word_on_any_line();
            if (word.empty())
                scanner.fail("the file ends where 'facet' or 'endsolid' is due; it is cut short");
            if (same_keyword(word, "endsolid")) break;
            if (!same_keyword(word, "facet"))
                scanner.fail(fmt::format("{} where 'facet' or 'endsolid' is due", quoted(word)));
            read_facet(scanner, mesh);
        }
        scanner.line = {};
    }
    return mesh;
}

/// 80 bytes of anything, the number of triangles, then per triangle a normal, three corners (floats) and two
/// bytes of anything.
SurfaceMesh read_stl_binary(std::string_view bytes, std::string_view name) {
    constexpr std::size_t start = 84, row = 50;
    if (bytes.size() < start)
        fail_at_byte(name, bytes.size(), "the file ends within the header of 84 bytes; it is cut short");
    std::uint32_t count = 0;
    std::memcpy(&count, bytes.data() + 80, 4);
    if (count > (bytes.size() - start) / row)
        fail_at_byte(name, bytes.size(),
                     fmt::format("the file ends after {} of {} triangles; it is cut short or no STL",
                                 (bytes.size() - start) / row, count));
    if (count > (no_index - 1) / 3) fail_at_byte(name, 80, full_message);
    SurfaceMesh mesh;
    mesh.name = name;
    mesh.positions.resize(3 * std::size_t(count));
    mesh.triangles.resize(count);
    const auto corners_of = [&](std::size_t t) {
        std::array<float, 9> corners;
        std::memcpy(corners.data(), bytes.data() + start + t * row + 12, sizeof corners);
        return corners;
    };
    // Blocks by themselves; which is the first fault is looked up afterwards.
    std::atomic<bool> faulty = false;
    Team team(count < 16000 ? 1 : 0);  // waking others is not worth it for a few
    team.run(block_count(count), [&](std::size_t block) {
        for (std::size_t t = block * block_size; t < std::min<std::size_t>(count, (block + 1) * block_size);
             ++t) {
            const std::array<float, 9> corners = corners_of(t);
            for (const float x : corners)
                if (!coordinate_fault(x).empty()) faulty = true;
            for (std::size_t k = 0; k < 3; ++k) {
                mesh.positions[3 * t + k] = {corners[3 * k], corners[3 * k + 1], corners[3 * k + 2]};
                mesh.triangles[t][k] = Index(3 * t + k);
            }
        }
    });
    for (std::size_t t = 0; faulty && t < count; ++t) {
        const std::array<float, 9> corners = corners_of(t);
        for (std::size_t n = 0; n < 9; ++n)
            if (const std::string_view fault = coordinate_fault(corners[n]); !fault.empty())
                fail_at_byte(name, start + t * row + 12 + 4 * n,
                             fmt::format("coordinate {} {}", corners[n], fault));
    }
    return mesh;
}

}  // namespace innerspring
