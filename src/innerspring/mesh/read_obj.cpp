#include "innerspring/mesh/text_scanner.h"

namespace innerspring {

namespace {

/// The vertex of a corner "v", "v/vt", "v//vn" or "v/vt/vn", counted from 0. Negative counts back from the
/// last vertex so far.
Index corner_vertex(const TextScanner& scanner, std::string_view corner, std::size_t vertices) {
    const std::size_t slash = std::min(corner.find('/'), corner.size());
    const std::optional<std::int64_t> index = parse_integer(corner.substr(0, slash));
    if (!index || corner.substr(slash).find_first_not_of("+-0123456789/") != corner.npos)
        scanner.fail(fmt::format("{} is not a corner of a face; write it as v, v/vt, v//vn or v/vt/vn",
                                 quoted(corner)));
    if (*index == 0) scanner.fail("vertex index 0; OBJ counts from 1, or backwards from -1");
    const std::int64_t vertex = *index > 0 ? *index - 1 : *index + std::int64_t(vertices);
    if (vertex < 0)
        scanner.fail(fmt::format(
            "vertex index {} reaches before the first of the {} vertices so far; correct the face", *index,
            vertices));
    if (vertex >= std::int64_t(no_index))
        scanner.fail(fmt::format("vertex index {} is out of range; correct the face", *index));
    return Index(vertex);
}

}  // namespace

SurfaceMesh read_obj(std::string_view bytes, std::string_view name) {
    TextScanner scanner{.name = name, .rest = bytes, .comment = '#', .continues = true};
    SurfaceMesh mesh;
    mesh.name = name;
    LargestIndex largest;
    while (scanner.next_row()) {
        const std::string_view statement = scanner.word();
        if (statement == "v") {
            scanner.add_vertex(mesh);  // a weight or a colour after it is of no use here
        } else if (statement == "f") {
            Fan fan{mesh};
            for (std::string_view word = scanner.word(); !word.empty(); word = scanner.word()) {
                fan.add(corner_vertex(scanner, word, mesh.positions.size()));
                largest.see(fan.last, scanner.number);
            }
            if (fan.corners < 3)
                scanner.fail(fmt::format("face with {} corner{}; a face needs three or more", fan.corners,
                                         fan.corners == 1 ? "" : "s"));
        }
    }
    if (largest.any && largest.value >= mesh.positions.size())
        fail_at_line(name, largest.place,
                     fmt::format("vertex index {} is out of range; the file has {} vertices",
                                 largest.value + 1, mesh.positions.size()));
    return mesh;
}

}  // namespace innerspring
