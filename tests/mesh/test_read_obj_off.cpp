#include <gtest/gtest.h>

#include <cmath>

#include "read_helpers.h"

namespace innerspring {
namespace {

using namespace testing;

TEST(ReadObj, PolygonsBecomeFans) {
    const SurfaceMesh mesh = read_from_memory(four_corners + "f 1 2 3 4\n", "a.obj");
    EXPECT_EQ(mesh.name, "a.obj");
    EXPECT_EQ(mesh.positions.size(), 4u);
    EXPECT_EQ(mesh.positions[2], Vector(1, 1, 0));
    EXPECT_EQ(mesh.triangles, fan_of_four);
}

TEST(ReadObj, NegativeIndicesCountBackFromTheFace) {
    const SurfaceMesh mesh = read_from_memory(four_corners + "f -4 -3 -2\nv 5 5 5\nf -1 -2 -3\n", "a.obj");
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {4, 3, 2}}));
}

TEST(ReadObj, EveryFormOfCorner) {
    const std::string text = "vt 0 0\nvn 0 0 1\n" + four_corners +
                             "f 1/1 2/1 3/1\nf 1//1 2//1 3//1\nf 1/1/1 2/1/-1 -2/1/1\nf +1 2 3/\n";
    EXPECT_EQ(read_from_memory(text, "a").triangles, std::vector<Triangle>(4, {0, 1, 2}));
}

TEST(ReadObj, LinesGoOnAfterBackslash) {
    const SurfaceMesh mesh =
        read_from_memory("v 0 \\\n0 \\\r\n 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2\\\n3 \\ \n\\\n 4\n", "a.obj");
    EXPECT_EQ(mesh.triangles, fan_of_four);
    EXPECT_EQ(read_from_memory("g a \\\nf 1 1 1\n" + four_corners + "f 1 2 3\\", "a.obj").triangles.size(),
              1u);
    EXPECT_EQ(read_from_memory("# C:\\\n" + four_corners + "f 1 2 3", "a.obj").positions.size(), 4u);
}

TEST(ReadObj, CommentsBlanksAndUnknownStatements) {
    const std::string text =
        "\n  # v 9 9 9\nmtllib a.mtl\no cube\ng b c\ns off\nusemtl \xc3\xa4\n\tv  0 0\t0 # here\nv 1 0 0\nv "
        "1 1 0\nl 1 2\ncurv 0 1\n\nf 1 2 3 # f\n";
    EXPECT_EQ(read_from_memory(text, "a.obj").triangles.size(), 1u);
}

TEST(ReadObj, WeightsAndColoursAreIgnored) {
    const SurfaceMesh mesh =
        read_from_memory("v 1 2 3 0.5\nv 4 5 6 1 0 0\nv 7 8 9 .1 .2 .3 1\nf 1 2 3\n", "a");
    EXPECT_EQ(mesh.positions[1], Vector(4, 5, 6));
    EXPECT_EQ(mesh.positions[2], Vector(7, 8, 9));
}

TEST(ReadObj, FacesMayComeBeforeTheirVertices) {
    EXPECT_EQ(read_from_memory("f 1 2 3 4\n" + four_corners, "a").triangles, fan_of_four);
}

TEST(ReadObj, EveryLineEnd) {
    for (const std::string_view end : {"\n", "\r\n", "\r"}) {
        std::string text;
        for (const char c : four_corners + "f 1 2 3 4\n") c == '\n' ? text.append(end) : text.append(1, c);
        EXPECT_EQ(read_from_memory(text, "a").triangles, fan_of_four);
        EXPECT_MESSAGE(text + "f 1 2", "a", "a:6: face with 2 corners");
    }
}

TEST(ReadObj, Numbers) {
    const SurfaceMesh mesh =
        read_from_memory("v +1 -.5 1.\nv 1e+3 1E-3 +2.5e0\nv 1e-400 0.1 -0\nf 1 2 3", "a");
    EXPECT_EQ(mesh.positions[0], Vector(1, -0.5, 1));
    EXPECT_EQ(mesh.positions[1], Vector(1000, 0.001, 2.5));
    EXPECT_EQ(mesh.positions[2], Vector(0, 0.1, 0));
    EXPECT_TRUE(std::signbit(mesh.positions[2][2]));
    const std::string zeros(500, '0');
    EXPECT_EQ(read_from_memory("v 0." + zeros + "1 1" + zeros + "e-500 1e-99999999999999999999\nf 1 1 1", "a")
                  .positions[0],
              Vector(0, 1, 0));
}

TEST(ReadObj, Errors) {
    EXPECT_MESSAGE("v 0 0 0\nv 1 x2 0\n", "a.obj", "a.obj:2: coordinate 'x2' is not a number");
    EXPECT_MESSAGE("v 0 0 1,5\n", "a", "a:1: coordinate '1,5' is not a number");
    EXPECT_MESSAGE("v 0 0 0x10\n", "a", "a:1: coordinate '0x10' is not a number");
    EXPECT_MESSAGE("v 0 0 +-1\n", "a", "'+-1' is not a number");
    EXPECT_MESSAGE("v 0 nan 0\n", "a", "a:1: coordinate 'nan' is not finite");
    EXPECT_MESSAGE("v -inf 0 0\n", "a", "a:1: coordinate '-inf' is not finite");
    EXPECT_MESSAGE("v 1e400 0 0\n", "a", "a:1: coordinate '1e400' is not finite");
    EXPECT_MESSAGE("v 1e31 0 0\n", "a", "a:1: coordinate '1e31' is beyond 1e30");
    EXPECT_MESSAGE("\n\nv 1 2\n", "a", "a:3: vertex with 2 coordinates; it needs three");
    EXPECT_MESSAGE("v\n", "a", "a:1: vertex with 0 coordinates");
    EXPECT_MESSAGE(four_corners + "f 1 2\n", "a", "a:5: face with 2 corners");
    EXPECT_MESSAGE(four_corners + "f\n", "a", "a:5: face with 0 corners");
    EXPECT_MESSAGE(four_corners + "f 1 2 5\nf 1 2 3\n", "a",
                   "a:5: vertex index 5 is out of range; the file has 4 vertices");
    EXPECT_MESSAGE(four_corners + "f 1 2 0\n", "a", "a:5: vertex index 0; OBJ counts from 1");
    EXPECT_MESSAGE(four_corners + "f 1 2 -5\n", "a",
                   "a:5: vertex index -5 reaches before the first of the 4 vertices");
    EXPECT_MESSAGE(four_corners + "f 1 2 4294967296\n", "a", "a:5: vertex index 4294967296 is out of range");
    EXPECT_MESSAGE(four_corners + "f 1 2 99999999999999999999\n", "a",
                   "a:5: '99999999999999999999' is not a corner");
    EXPECT_MESSAGE(four_corners + "f 1 2 3.0\n", "a", "a:5: '3.0' is not a corner");
    EXPECT_MESSAGE(four_corners + "f 1 \\\n 2 \\\n b\n", "a", "a:7: 'b' is not a corner");
    EXPECT_MESSAGE(four_corners + "f /1 2 3\n", "a", "a:5: '/1' is not a corner");
    EXPECT_MESSAGE(four_corners, "a", "a: no triangle");
}

TEST(ReadObj, MessagesAreOneShortPrintableLine) {
    EXPECT_MESSAGE("v 0 0 a\x01\xff\n", "a", "'a\\x01\\xff'");
    const std::string message = message_of("v 0 0 " + std::string(5000, 'x') + "\n", "new\nline.obj");
    EXPECT_LT(message.size(), 150u);
    EXPECT_EQ(message.find('\n'), std::string::npos);
    EXPECT_NE(message.find("'" + std::string(40, 'x') + "...'"), std::string::npos);
}

TEST(ReadOff, HeaderVariants) {
    const std::string points = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n", face = "4 0 1 2 3\n";
    for (const std::string header :
         {"OFF\n4 1 0\n", "OFF 4 1 0\n", "OFF\n\n# c\n4 1\n", "# c\nOFF # c\n 4 1 4 # c\n", "COFF\n4 1 0\n",
          "NOFF 4 1 0\n", "STOFF\n4 1 0\n", "STCNOFF\n4 1 0\n", "CNOFF\n4 1 0\n", "\xEF\xBB\xBFOFF\n4 1 0\n"})
        EXPECT_EQ(read_from_memory(header + points + face, "a").triangles, fan_of_four) << header;
    EXPECT_EQ(read_from_memory("4 1 0\n" + points + face, "a.off").triangles, fan_of_four);
}

TEST(ReadOff, ColoursAndNormalsAreIgnored) {
    const SurfaceMesh mesh = read_from_memory(
        "CNOFF\r\n3 2 0\r\n0 0 0 0 0 1 255 0 0 255\r\n1 0 0 0 0 1 1 1 1 1\r\n\r\n0 1 0 0 0 1 # c\r\n"
        "3 0 1 2 0.5 0.5 0.5\r\n 3 2 1 0 255 0 0",
        "a");
    EXPECT_EQ(mesh.positions[1], Vector(1, 0, 0));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 0}}));
}

TEST(ReadOff, Errors) {
    const std::string start = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n";
    EXPECT_MESSAGE("OFF", "a", "a:1: the file ends before the numbers");
    EXPECT_MESSAGE("OFF\n3\n", "a", "a:2: the number of faces is missing");
    EXPECT_MESSAGE("OFF\nx 1 0\n", "a", "a:2: the number of vertices is 'x'");
    EXPECT_MESSAGE("OFF -3 1 0\n", "a", "a:1: the number of vertices is '-3'");
    EXPECT_MESSAGE("OFF BINARY\n", "a", "a:1: binary OFF is not read");
    EXPECT_MESSAGE("4OFF\n3 1 0\n", "a", "a:1: OFF variant '4OFF' is not read");
    EXPECT_MESSAGE("nonsense\n3 1 0\n", "a.off", "a.off:1: 'nonsense' where the word OFF is due");
    EXPECT_MESSAGE("# c\n", "a.off", "a.off:1: nothing but blanks and comments");
    EXPECT_MESSAGE("OFF\n3 1 0\n0 0 0\n1 0 0\n", "a", "a:4: the file ends after 2 of 3 vertices");
    EXPECT_MESSAGE("OFF\n3 1 0\n0 0\n", "a", "a:3: vertex with 2 coordinates");
    EXPECT_MESSAGE("OFF\n3 1 0\n0 0 nan\n", "a", "a:3: coordinate 'nan' is not finite");
    EXPECT_MESSAGE("OFF\n3 1 0\n0 0 -2e30\n", "a", "a:3: coordinate '-2e30' is beyond 1e30");
    EXPECT_MESSAGE(start, "a", "a:5: the file ends after 0 of 1 faces");
    EXPECT_MESSAGE(start + "2 0 1\n", "a", "a:6: face with '2' corners");
    EXPECT_MESSAGE(start + "-3 0 1 2\n", "a", "a:6: face with '-3' corners");
    EXPECT_MESSAGE(start + "4000000000 0 1 2\n", "a", "a:6: face of 4000000000 corners lists only 3");
    EXPECT_MESSAGE(start + "3 0 1 3\n", "a", "a:6: vertex index 3 is out of range; the file has 3 vertices");
    EXPECT_MESSAGE(start + "3 0 1 -1\n", "a", "a:6: vertex index -1 is out of range");
    EXPECT_MESSAGE(start + "3 0 1 2.5\n", "a", "a:6: vertex index '2.5' is not a whole number");
    EXPECT_MESSAGE(start + "3 0 1 2\n3 0 1 2\n", "a", "a:7: '3' after the last of 1 faces");
    EXPECT_MESSAGE("OFF 1 0 0\n0 0 0\n", "a", "a: no triangle");
    EXPECT_MESSAGE("OFF 9000000000000000000 9000000000000000000 0\n0 0 0\n", "a",
                   "a:2: the file ends after 1 of");
}

}  // namespace
}  // namespace innerspring
