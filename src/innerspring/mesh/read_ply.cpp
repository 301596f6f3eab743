#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "innerspring/mesh/text_scanner.h"

namespace innerspring {

namespace {

enum class Scalar { i8, u8, i16, u16, i32, u32, f32, f64 };
enum class Encoding { none, ascii, little, big };

struct Property {
    std::string_view name;
    Scalar type{};
    bool list = false;
    Scalar count_type{};  // of a list
};

struct Element {
    std::string_view name;
    std::uint64_t count = 0;
    std::size_t line = 0;  // of the header
    std::vector<Property> properties{};
};

struct Header {
    Encoding encoding = Encoding::none;
    std::vector<Element> elements;
};

std::size_t size_of(Scalar type) {
    constexpr std::array<std::size_t, 8> sizes{1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[std::size_t(type)];
}

Scalar parse_type(const TextScanner& scanner, std::string_view word) {
    constexpr std::array<std::string_view, 16> names{
        "char", "uchar", "short", "ushort", "int",   "uint",   "float",   "double",
        "int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"};
    const auto found = std::find(names.begin(), names.end(), word);
    if (found == names.end())
        scanner.fail(fmt::format(
            "unknown type {}; PLY has char, uchar, short, ushort, int, uint, float, double", quoted(word)));
    return Scalar((found - names.begin()) % 8);
}

Encoding parse_encoding(const TextScanner& scanner, std::string_view word) {
    if (word == "ascii") return Encoding::ascii;
    if (word == "binary_little_endian") return Encoding::little;
    if (word == "binary_big_endian") return Encoding::big;
    scanner.fail(fmt::format("unknown format {}; it is ascii, binary_little_endian or binary_big_endian",
                             quoted(word)));
}

/// Leaves the scanner at the end of the line "end_header".
Header read_header(TextScanner& scanner) {
    if (!scanner.next_row() || scanner.word() != "ply") scanner.fail("the first line is not 'ply'");
    Header header;
    while (scanner.next_row()) {
        const std::string_view keyword = scanner.word();
        if (keyword == "end_header") {
            if (header.encoding == Encoding::none) scanner.fail("the header has no line 'format'");
            return header;
        }
        if (keyword == "comment" || keyword == "obj_info") continue;
        if (keyword == "format") {
            header.encoding = parse_encoding(scanner, scanner.word());
        } else if (keyword == "element") {
            Element element{.name = scanner.word(), .line = scanner.number};
            const std::string_view word = scanner.word();
            const std::optional<std::int64_t> count = parse_integer(word);
            if (!count || *count < 0)
                scanner.fail(
                    fmt::format("{} is not a number of elements; write 'element NAME COUNT'", quoted(word)));
            element.count = std::uint64_t(*count);
            if (element.name == "vertex")
                for (const Element& other : header.elements)
                    if (other.name == "vertex") scanner.fail("a second 'element vertex'; one is allowed");
            header.elements.push_back(element);
        } else if (keyword == "property") {
            if (header.elements.empty()) scanner.fail("'property' before any 'element'");
            Property property;
            std::string_view word = scanner.word();
            property.list = word == "list";
            if (property.list) {
                property.count_type = parse_type(scanner, scanner.word());
                word = scanner.word();
            }
            property.type = parse_type(scanner, word);
            property.name = scanner.word();
            if (property.name.empty()) scanner.fail("property without a name");
            header.elements.back().properties.push_back(property);
        } else {
            scanner.fail(fmt::format(
                "unknown header line {}; known are format, element, property, comment and end_header",
                quoted(keyword)));
        }
    }
    scanner.fail("the file ends before 'end_header'; it is cut short");
}

// A Source gives the values of a body one after the other and fails at a place: a line of text or a byte.

template <class Source>
std::uint64_t list_size(Source& source, const Property& property) {
    const std::size_t where = source.place();
    const double n = source.value(property.count_type);
    if (!(n >= 0 && n <= no_index && n == std::floor(n)))
        source.fail(where, fmt::format("list of length {}; it must be a whole number, 0 or more", n));
    return std::uint64_t(n);
}

template <class Source>
void skip_property(Source& source, const Property& property) {
    source.skip(property.type, property.list ? list_size(source, property) : 1);
}

/// Values of a text body: one row of an element per line.
struct TextSource {
    TextScanner& scanner;

    std::size_t place() const { return scanner.number; }
    std::size_t bytes_left() const { return scanner.rest.size() + 1; }  // the last line end may be missing
    static std::size_t least_size(Scalar) { return 2; }
    [[noreturn]] void fail(std::size_t where, std::string_view message) const {
        fail_at_line(scanner.name, where, message);
    }

    void begin_row(const Element& element, std::uint64_t n) {
        if (!scanner.next_row())
            scanner.fail(fmt::format(
                "the file ends after {} of {} rows of element {}; it is cut short or its header is wrong", n,
                element.count, quoted(element.name)));
    }
    void end_row(const Element& element) {
        if (const std::string_view word = scanner.word(); !word.empty())
            scanner.fail(fmt::format("{} after the last value of element {}; correct the line or the header",
                                     quoted(word), quoted(element.name)));
    }
    void end_body() {
        if (scanner.next_row())
            scanner.fail(fmt::format("{} after the last row; correct the counts in the header",
                                     quoted(scanner.word())));
    }
    void skip_row(const Element&) { scanner.line = {}; }
    std::string_view word() {
        const std::string_view found = scanner.word();
        if (found.empty()) scanner.fail("the line ends before the last value the header declares");
        return found;
    }
    void skip(Scalar, std::uint64_t n) {
        while (n-- > 0) word();
    }
    double coordinate(Scalar) { return scanner.coordinate(word()); }
    double value(Scalar) {
        const std::string_view found = word();
        const std::optional<double> x = parse_number(found);
        if (!x) scanner.fail(fmt::format("{} is not a number", quoted(found)));
        return *x;
    }
};

/// Values of a binary body, which starts at byte `at` of the file.
struct BinarySource {
    std::string_view name, bytes;
    std::size_t at = 0;
    bool swap = false;

    std::size_t place() const { return at; }
    std::size_t bytes_left() const { return bytes.size() - at; }
    static std::size_t least_size(Scalar type) { return size_of(type); }
    [[noreturn]] void fail(std::size_t where, std::string_view message) const {
        fail_at_byte(name, where, message);
    }

    void begin_row(const Element&, std::uint64_t) {}
    void end_row(const Element&) {}
    void end_body() {}
    void skip_row(const Element& element) {
        for (const Property& property : element.properties) skip_property(*this, property);
    }
    void require(std::uint64_t n, std::size_t size) const {
        if (n > bytes_left() / size)
            fail(bytes.size(), "the file ends before the last value its header declares; it is cut short");
    }
    void skip(Scalar type, std::uint64_t n) {
        require(n, size_of(type));
        at += n * size_of(type);
    }
    double coordinate(Scalar type) {
        const double x = value(type);
        if (const std::string_view fault = coordinate_fault(x); !fault.empty())
            fail(at - size_of(type), fmt::format("coordinate {} {}", x, fault));
        return x;
    }
    double value(Scalar type) {
        switch (type) {
            case Scalar::i8:
                return load<std::int8_t>();
            case Scalar::u8:
                return load<std::uint8_t>();
            case Scalar::i16:
                return load<std::int16_t>();
            case Scalar::u16:
                return load<std::uint16_t>();
            case Scalar::i32:
                return load<std::int32_t>();
            case Scalar::u32:
                return load<std::uint32_t>();
            case Scalar::f32:
                return load<float>();
            case Scalar::f64:
                return load<double>();
        }
        return 0;
    }
    template <class T>
    T load() {
        require(1, sizeof(T));
        std::array<char, sizeof(T)> raw;
        std::memcpy(raw.data(), bytes.data() + at, sizeof(T));
        if (swap) std::reverse(raw.begin(), raw.end());
        at += sizeof(T);
        return std::bit_cast<T>(raw);
    }
};

/// Refuses counts the rest of the file cannot hold. Returns how many rows there will be, or a little less:
/// safe to reserve.
template <class Source>
std::uint64_t room_for_rows(const Source& source, const TextScanner& scanner, const Element& element,
                            std::size_t more_bytes) {
    std::size_t least = 0;
    for (const Property& p : element.properties) least += Source::least_size(p.list ? p.count_type : p.type);
    if (element.count > source.bytes_left() / least)
        fail_at_line(scanner.name, element.line,
                     fmt::format("element {} of {} rows is more than the {} bytes after the header can hold; "
                                 "the file is cut short or "
                                 "the count is wrong",
                                 quoted(element.name), element.count, source.bytes_left()));
    return std::min<std::uint64_t>(element.count, source.bytes_left() / (least + more_bytes));
}

template <class Source>
void read_vertices(Source& source, const TextScanner& scanner, const Element& element, SurfaceMesh& mesh) {
    constexpr std::array<std::string_view, 3> axes{"x", "y", "z"};
    std::vector<int> axis(element.properties.size(), -1);
    for (int i = 0; i < 3; ++i) {
        const auto found =
            std::find_if(element.properties.begin(), element.properties.end(),
                         [&](const Property& p) { return p.name == axes[std::size_t(i)] && !p.list; });
        if (found == element.properties.end())
            fail_at_line(scanner.name, element.line,
                         fmt::format("element vertex has no scalar property {}", axes[std::size_t(i)]));
        axis[std::size_t(found - element.properties.begin())] = i;
    }
    if (element.count >= no_index) fail_at_line(scanner.name, element.line, full_message);
    mesh.positions.reserve(room_for_rows(source, scanner, element, 0));
    for (std::uint64_t n = 0; n < element.count; ++n) {
        source.begin_row(element, n);
        Vector p;
        for (std::size_t k = 0; k < axis.size(); ++k) {
            if (axis[k] >= 0)
                p[axis[k]] = source.coordinate(element.properties[k].type);
            else
                skip_property(source, element.properties[k]);
        }
        mesh.positions.push_back(p);
        source.end_row(element);
    }
}

template <class Source>
void read_faces(Source& source, const TextScanner& scanner, const Element& element, SurfaceMesh& mesh,
                LargestIndex& largest) {
    const auto corners = std::find_if(
        element.properties.begin(), element.properties.end(),
        [](const Property& p) { return p.list && (p.name == "vertex_indices" || p.name == "vertex_index"); });
    if (corners == element.properties.end())
        fail_at_line(scanner.name, element.line, "element face has no list property vertex_indices");
    mesh.triangles.reserve(mesh.triangles.size() +
                           room_for_rows(source, scanner, element, 3 * Source::least_size(corners->type)));
    for (std::uint64_t n = 0; n < element.count; ++n) {
        source.begin_row(element, n);
        for (auto property = element.properties.begin(); property != element.properties.end(); ++property) {
            if (property != corners) {
                skip_property(source, *property);
                continue;
            }
            const std::size_t start = source.place();
            const std::uint64_t size = list_size(source, *property);
            if (size < 3)
                source.fail(start, fmt::format("face with {} corners; a face needs three or more", size));
            Fan fan{mesh};
            while (fan.corners < size) {
                const std::size_t where = source.place();
                const double index = source.value(property->type);
                if (!(index >= 0 && index < no_index && index == std::floor(index)))
                    source.fail(where,
                                fmt::format("vertex index {} is out of range; correct the face", index));
                fan.add(Index(index));
                largest.see(fan.last, where);
            }
        }
        source.end_row(element);
    }
}

template <class Source>
SurfaceMesh read_body(Source source, const TextScanner& scanner, const Header& header) {
    SurfaceMesh mesh;
    mesh.name = scanner.name;
    LargestIndex largest;
    for (const Element& element : header.elements) {
        if (element.count == 0 ||
            (element.properties.empty() && element.name != "vertex" && element.name != "face"))
            continue;
        if (element.name == "vertex") {
            read_vertices(source, scanner, element, mesh);
        } else if (element.name == "face") {
            read_faces(source, scanner, element, mesh, largest);
        } else {
            for (std::uint64_t n = 0; n < element.count; ++n) {
                source.begin_row(element, n);
                source.skip_row(element);
            }
        }
    }
    source.end_body();
    if (largest.any && largest.value >= mesh.positions.size())
        source.fail(largest.place,
                    fmt::format("vertex index {} is out of range; the file has {} vertices, counted from 0",
                                largest.value, mesh.positions.size()));
    return mesh;
}

}  // namespace

SurfaceMesh read_ply(std::string_view bytes, std::string_view name) {
    TextScanner scanner{.name = name, .rest = bytes};
    const Header header = read_header(scanner);
    if (header.encoding == Encoding::ascii) return read_body(TextSource{scanner}, scanner, header);
    const std::size_t start = bytes.size() - scanner.rest.size();
    return read_body(BinarySource{name, bytes, start, header.encoding == Encoding::big}, scanner, header);
}

}  // namespace innerspring
