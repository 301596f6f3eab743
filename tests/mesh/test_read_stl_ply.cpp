#include <gtest/gtest.h>

#include <array>
#include <cctype>
#include <cmath>
#include <limits>

#include "innerspring/mesh/write.h"
#include "read_helpers.h"
#include "small_meshes.h"

namespace innerspring {
namespace {

using namespace testing;

std::string repeat(std::string_view text, int times) {
    std::string out;
    while (times-- > 0) out += text;
    return out;
}

const std::string facet =
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
const std::string ply_header =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";

TEST(ReadStl, Text) {
    const SurfaceMesh mesh =
        read_from_memory("solid a name with facet in it\n" + facet + facet + "endsolid a\n", "a.stl");
    EXPECT_EQ(mesh.positions.size(), 6u);
    EXPECT_EQ(mesh.positions[4], Vector(1, 0, 0));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 4, 5}}));
}

TEST(ReadStl, TextInOtherShapes) {
    EXPECT_EQ(read_from_memory("solid\n" + facet + "endsolid\nsolid b\n" + facet + "endsolid b\n", "a")
                  .triangles.size(),
              2u);
    std::string upper = "solid\n" + facet + "endsolid";
    for (char& c : upper) c = char(std::toupper(c));
    EXPECT_EQ(read_from_memory(upper, "a").triangles.size(), 1u);
    EXPECT_EQ(read_from_memory("\xEF\xBB\xBFsolid\r\n facet normal nan nan nan outer loop\r\n vertex 0 0 "
                               "0\r\n\r\n vertex 1 0 0\r\n vertex 0 1 0\r\n"
                               " endloop endfacet\r\nfacet\nouter loop vertex 0 0 0 vertex 1 1 1 vertex 2 2 "
                               "2 endloop\nendfacet\nendsolid",
                               "a")
                  .triangles.size(),
              2u);
}

TEST(ReadStl, BinaryIsRecognisedBySize) {
    std::string bytes = to_stl_binary(ball(0));
    for (const std::string_view header : {"solid octahedron", "ply\nformat", "OFF 1 2 3", "v 1 2 3"}) {
        bytes.replace(0, header.size(), header);
        EXPECT_EQ(detect_format(bytes, "a.obj"), MeshFormat::stl_binary);
        EXPECT_EQ(read_from_memory(bytes, "a.obj").triangles.size(), 8u);
    }
}

TEST(ReadStl, BinaryMayHaveBytesBehindIt) {
    std::string bytes = to_stl_binary(ball(0)) + "trailing";
    EXPECT_EQ(read_from_memory(bytes, "a").triangles.size(), 8u);
    bytes.replace(0, 5, "solid");
    EXPECT_EQ(read_from_memory(bytes, "a").triangles.size(), 8u);
}

TEST(ReadStl, TextErrors) {
    EXPECT_MESSAGE("solid\n" + facet, "a", "a:8: the file ends where 'facet' or 'endsolid' is due");
    EXPECT_MESSAGE("solid\n" + facet.substr(0, 50), "a", "vertex with 0 coordinates");
    EXPECT_MESSAGE("solid\nfacet normal 0 0 1\nvertex 0 0 0\n", "a", "a:3: 'vertex' where 'outer' is due");
    EXPECT_MESSAGE("solid\nfacet\nouter loop\nvertex 0 0\n", "a", "a:4: vertex with 2 coordinates");
    EXPECT_MESSAGE("solid\nfacet\nouter loop\nvertex 0 0 inf\n", "a", "a:4: coordinate 'inf' is not finite");
    EXPECT_MESSAGE("solid\nfacet\nouter loop\nvertex 0 b 0\n", "a", "a:4: coordinate 'b' is not a number");
    EXPECT_MESSAGE("solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nendloop\n", "a",
                   "a:6: 'endloop' where 'vertex' is due");
    const std::string loop = "facet\nouter loop\n" + repeat("vertex 0 0 0\n", 3);
    EXPECT_MESSAGE("solid\n" + loop + "vertex 1 1 1\nendloop\n", "a",
                   "a:7: 'vertex' where 'endloop' is due; STL holds triangles only");
    EXPECT_MESSAGE("solid\nfoo\n", "a", "a:2: 'foo' where 'facet' or 'endsolid' is due");
    EXPECT_MESSAGE("solid\nendsolid\nfoo\n", "a", "a:3: 'foo' where 'solid' is due");
    EXPECT_MESSAGE("solid\nendsolid\n", "a", "a: no triangle");
    EXPECT_MESSAGE("facet\n", "a.stl", "a.stl:1: 'facet' where 'solid' is due");
}

TEST(ReadStl, BinaryErrors) {
    const std::string bytes = to_stl_binary(ball(0));
    EXPECT_MESSAGE(bytes.substr(0, 84 + 120), "a.stl",
                   "a.stl: byte 204: the file ends after 2 of 8 triangles");
    EXPECT_MESSAGE(std::string(20, '\0'), "a.stl", "a.stl: byte 20: the file ends within the header");
    std::string damaged = bytes;
    damaged.replace(84 + 50 + 12 + 8, 4, raw(std::numeric_limits<float>::quiet_NaN()));
    EXPECT_MESSAGE(damaged, "a", "a: byte 154: coordinate nan is not finite");
    damaged.replace(84 + 50 + 12 + 8, 4, raw(2e30f));
    EXPECT_MESSAGE(damaged, "a", "a: byte 154: coordinate 2e+30 is beyond 1e30");
    EXPECT_MESSAGE(to_stl_binary({}), "a", "a: no triangle");
}

TEST(ReadPly, Ascii) {
    const SurfaceMesh mesh = read_from_memory(ply_header + "0 0 0\n1.5 0 0\n\n0 1 0\n3 2 1 0\n", "a.ply");
    EXPECT_EQ(mesh.positions[1], Vector(1.5, 0, 0));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{2, 1, 0}}));
}

/// A body where nothing is at its usual place: faces first, axes out of order, unknown elements, properties
/// and lists between.
std::string strange_header(std::string_view format, std::string_view x, std::string_view y,
                           std::string_view z, std::string_view count, std::string_view index) {
    std::string text = "\xEF\xBB\xBFply\r\nformat ";
    text += format;
    text +=
        " 1.0\ncomment x\nobj_info y z\nelement nothing 4000000000\nelement face 2\nproperty list uchar "
        "float texcoord\nproperty list ";
    text.append(count) += " ";
    text.append(index) +=
        " vertex_index\nproperty uchar red\nelement edge 2\nproperty int v\nproperty list short double "
        "w\nelement vertex 4\nproperty ";
    text.append(z) += " z\nproperty list int8 int16 l\nproperty ";
    text.append(y) += " y\nproperty double nx\nproperty ";
    text.append(x) += " x\nend_header\n";
    return text;
}

const std::vector<std::array<std::string_view, 5>> type_choices = {
    {"char", "uchar", "short", "uchar", "int"},     {"int8", "uint8", "int16", "uint8", "uint8"},
    {"ushort", "int", "uint", "ushort", "ushort"},  {"uint16", "int32", "uint32", "uint", "uint32"},
    {"float", "double", "float32", "int", "short"}, {"float64", "float64", "float64", "char", "char"},
    {"float", "float", "float", "float", "double"}, {"double", "char", "uint", "uint32", "float"}};

std::string typed(std::string_view type, double value, bool big) {
    if (type == "char" || type == "int8") return raw(std::int8_t(value), big);
    if (type == "uchar" || type == "uint8") return raw(std::uint8_t(value), big);
    if (type == "short" || type == "int16") return raw(std::int16_t(value), big);
    if (type == "ushort" || type == "uint16") return raw(std::uint16_t(value), big);
    if (type == "int" || type == "int32") return raw(std::int32_t(value), big);
    if (type == "uint" || type == "uint32") return raw(std::uint32_t(value), big);
    if (type == "float" || type == "float32") return raw(float(value), big);
    return raw(value, big);
}

void expect_strange(const SurfaceMesh& mesh) {
    EXPECT_EQ(mesh.positions, (std::vector<Vector>{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}}));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{3, 2, 1}, {0, 1, 2}, {0, 2, 3}}));
}

TEST(ReadPly, AnyOrderAndTypeInAscii) {
    for (const auto& [x, y, z, count, index] : type_choices)
        expect_strange(read_from_memory(strange_header("ascii", x, y, z, count, index) +
                                            "0 3 3 2 1 255\n1 0.5 4 0 1 2 3 0\n1 2 3.5 nan\n2 0\n3 1 7 2 0 "
                                            "1\n6 0 5 0 4\n9 0 8 0 7\n12 2 1 1 11 0 10\n",
                                        "a"));
}

TEST(ReadPly, AnyOrderAndTypeInBinary) {
    for (const bool big : {false, true})
        for (const auto& [x, y, z, count, index] : type_choices) {
            std::string bytes =
                strange_header(big ? "binary_big_endian" : "binary_little_endian", x, y, z, count, index);
            bytes += raw(std::uint8_t(0)) + typed(count, 3, big) + typed(index, 3, big) +
                     typed(index, 2, big) + typed(index, 1, big) + '\xff';
            bytes += raw(std::uint8_t(1)) + raw(0.5f, big) + typed(count, 4, big);
            for (int i = 0; i < 4; ++i) bytes += typed(index, i, big);
            bytes += '\0';
            bytes += raw(std::int32_t(7), big) + raw(std::int16_t(2), big) + raw(1.0, big) + raw(2.0, big);
            bytes += raw(std::int32_t(7), big) + raw(std::int16_t(0), big);
            for (int v = 0; v < 4; ++v) {
                bytes +=
                    typed(z, 3 * v + 3, big) + raw(std::int8_t(v)) + std::string(2 * std::size_t(v), 'l');
                bytes += typed(y, 3 * v + 2, big) + raw(std::nan(""), big) + typed(x, 3 * v + 1, big);
            }
            expect_strange(read_from_memory(bytes, "a"));
            expect_strange(read_from_memory(bytes + "behind", "a"));
            EXPECT_MESSAGE(bytes.substr(0, bytes.size() - 1), "a", "cut short");
        }
}

TEST(ReadPly, HeaderErrors) {
    EXPECT_MESSAGE("ply\nformat ascii 1.0\n", "a", "a:2: the file ends before 'end_header'");
    EXPECT_MESSAGE("ply\nend_header\n", "a", "a:2: the header has no line 'format'");
    EXPECT_MESSAGE("ply\nformat binary 1.0\n", "a", "a:2: unknown format 'binary'");
    EXPECT_MESSAGE("ply\nformat ascii 1.0\nelement vertex many\n", "a",
                   "a:3: 'many' is not a number of elements");
    EXPECT_MESSAGE("ply\nformat ascii 1.0\nelement vertex -1\n", "a",
                   "a:3: '-1' is not a number of elements");
    EXPECT_MESSAGE("ply\nformat ascii 1.0\nproperty int x\n", "a", "a:3: 'property' before any 'element'");
    EXPECT_MESSAGE("ply\nformat ascii 1.0\nelement a 1\nproperty real x\n", "a", "a:4: unknown type 'real'");
    EXPECT_MESSAGE("ply\nformat ascii 1.0\nelement a 1\nproperty list uchar x\n", "a",
                   "a:4: unknown type 'x'");
    EXPECT_MESSAGE("ply\nformat ascii 1.0\nelement a 1\nproperty int\n", "a", "a:4: property without a name");
    EXPECT_MESSAGE("ply\nformat ascii 1.0\nwhat\n", "a", "a:3: unknown header line 'what'");
    EXPECT_MESSAGE("ply\nformat ascii 1.0\nelement vertex 1\nelement vertex 1\n", "a",
                   "a:4: a second 'element vertex'");
    EXPECT_MESSAGE(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int z\nend_header\n0 0\n", "a",
        "a:3: element vertex has no scalar property y");
    EXPECT_MESSAGE("ply\nformat ascii 1.0\nelement face 1\nproperty int x\nend_header\n0\n", "a",
                   "a:3: element face has no list property vertex_indices");
    EXPECT_MESSAGE("plyx\n", "a.ply", "a.ply:1: the first line is not 'ply'");
}

TEST(ReadPly, AsciiErrors) {
    const std::string points = "0 0 0\n1 0 0\n0 1 0\n";
    EXPECT_MESSAGE(ply_header + "0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n", "a",
                   "a:11: coordinate 'x' is not a number");
    EXPECT_MESSAGE(ply_header + "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n", "a",
                   "a:11: coordinate 'nan' is not finite");
    EXPECT_MESSAGE(ply_header + "0 0 0\n1 1e31 0\n0 1 0\n3 0 1 2\n", "a",
                   "a:11: coordinate '1e31' is beyond 1e30");
    EXPECT_MESSAGE(ply_header + "0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "a",
                   "a:11: the line ends before the last value");
    EXPECT_MESSAGE(ply_header + "0 0 0\n1 0 0 7\n0 1 0\n3 0 1 2\n", "a",
                   "a:11: '7' after the last value of element 'vertex'");
    EXPECT_MESSAGE(ply_header + "0.000 0.000 0.000\n1.000 0.000 0.000\n", "a",
                   "a:11: the file ends after 2 of 3 rows of element 'vertex'");
    EXPECT_MESSAGE(ply_header + points + "3 0 1 3\n", "a",
                   "a:13: vertex index 3 is out of range; the file has 3 vertices");
    EXPECT_MESSAGE(ply_header + points + "3 0 1 -1\n", "a", "a:13: vertex index -1 is out of range");
    EXPECT_MESSAGE(ply_header + points + "3 0 1 1.5\n", "a", "a:13: vertex index 1.5 is out of range");
    EXPECT_MESSAGE(ply_header + points + "3 0 1 4294967295\n", "a",
                   "a:13: vertex index 4294967295 is out of range");
    EXPECT_MESSAGE(ply_header + points + "3 0 1\n", "a", "a:13: the line ends before the last value");
    EXPECT_MESSAGE(ply_header + points + "2 0 1\n", "a", "a:13: face with 2 corners");
    EXPECT_MESSAGE(ply_header + points + "-3 0 1 2\n", "a", "a:13: list of length -3");
    EXPECT_MESSAGE(ply_header + points + "nan 0 1 2\n", "a", "a:13: list of length nan");
    EXPECT_MESSAGE(ply_header + points + "three 0 1 2\n", "a", "a:13: 'three' is not a number");
    EXPECT_MESSAGE(ply_header + points + "3 0 1 2\n3 0 1 2\n", "a", "a:14: '3' after the last row");
}

TEST(ReadPly, BinaryErrors) {
    const std::string good = to_ply(ball(0));
    const std::size_t body = good.find("end_header\n") + 11, faces = body + 6 * 24;
    auto with = [&](std::size_t at, const std::string& bytes) {
        return std::string(good).replace(at, bytes.size(), bytes);
    };
    auto at = [](std::size_t byte) { return "a: byte " + std::to_string(byte) + ": "; };
    EXPECT_MESSAGE(with(body + 32, raw(std::nan(""))), "a", at(body + 32) + "coordinate nan is not finite");
    EXPECT_MESSAGE(with(body + 32, raw(-1e31)), "a", at(body + 32) + "coordinate -1e+31 is beyond 1e30");
    EXPECT_MESSAGE(with(faces, "\2"), "a", at(faces) + "face with 2 corners");
    EXPECT_MESSAGE(with(faces + 13 + 5, raw(std::uint32_t(6))), "a",
                   at(faces + 18) + "vertex index 6 is out of range; the file has 6 vertices");
    EXPECT_MESSAGE(with(faces + 1, raw(no_index)), "a",
                   at(faces + 1) + "vertex index 4294967295 is out of range");
    EXPECT_MESSAGE(good.substr(0, good.size() - 1), "a",
                   at(good.size() - 1) + "the file ends before the last value");
}

TEST(ReadPly, NegativeListLengthInBinary) {
    const std::string bytes =
        "ply\nformat binary_little_endian 1.0\nelement a 1\nproperty list char int b\nend_header\n\xff" +
        std::string(50, '\0');
    EXPECT_MESSAGE(bytes, "a", "list of length -1");
}

}  // namespace
}  // namespace innerspring
