#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "innerspring/mesh/weld.h"
#include "innerspring/mesh/write.h"
#include "read_helpers.h"
#include "small_meshes.h"

namespace innerspring {
namespace {

using namespace testing;

TEST(Read, HugeCountsCostNothing) {
    for (const std::string format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
        const std::string head = "ply\nformat " + format + " 1.0\n";
        const std::string xyz = "property char x\nproperty char y\nproperty char z\n";
        const std::string corners = "property list uint int vertex_indices\n";
        EXPECT_MESSAGE(head + "element vertex 4000000000\n" + xyz + "end_header\n0 0 0\n", "a",
                       "a:3: element 'vertex' of 4000000000 rows is more than");
        EXPECT_MESSAGE(head + "element face 9000000000000000000\n" + corners + "end_header\n3 0 1 2\n", "a",
                       "a:3: element 'face' of");
        EXPECT_MESSAGE(head + "element vertex 9000000000000000000\n" + xyz + "end_header\n0 0 0\n", "a",
                       "a:3: more than 4294967294 vertices");
        EXPECT_MESSAGE(head + "element empty 9000000000000000000\nend_header\n", "a", "a: no triangle");
        EXPECT_NE(message_of(
                      head + "element other 9000000000000000000\nproperty int x\nend_header\n0 1 2 3\n", "a"),
                  "no error");
        EXPECT_NE(
            message_of(head + "element face 1\n" + corners + "end_header\n\xff\xff\xff\xff 4294967295 0 0 0",
                       "a"),
            "no error");
    }
}

TEST(Read, DetectsByContentThenByExtension) {
    EXPECT_EQ(detect_format("v 0 0 0\n", "a.stl"), MeshFormat::obj);
    EXPECT_EQ(detect_format("# c\nmtllib x\n", "a"), MeshFormat::obj);
    EXPECT_EQ(detect_format("solid a\n", "a.obj"), MeshFormat::stl_text);
    EXPECT_EQ(detect_format("ply\nformat", "a.obj"), MeshFormat::ply);
    EXPECT_EQ(detect_format("# c\nCOFF\n", "a.obj"), MeshFormat::off);
    EXPECT_EQ(detect_format("# only a comment", "A.OBJ"), MeshFormat::obj);
    EXPECT_EQ(detect_format(std::string(10, '\0'), "a.stl"), MeshFormat::stl_binary);
    EXPECT_MESSAGE("hello world", "a.txt", "a.txt: unknown format");
    EXPECT_MESSAGE("", "a.obj", "a.obj: the file is empty");
}

TEST(Read, Files) {
    const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) /
                                       ("innerspring_read_" + std::to_string(::getpid()) + ".obj");
    std::ofstream(file) << four_corners << "f 1 2 3 4\n";
    const SurfaceMesh mesh = read(file);
    EXPECT_EQ(mesh.triangles, fan_of_four);
    EXPECT_EQ(mesh.name, file.string());
    std::filesystem::remove(file);
    EXPECT_THROW(read(file), InputError);
    EXPECT_THROW(read(::testing::TempDir()), InputError);
}

/// Any bytes either read as a valid mesh or throw InputError.
void expect_read_or_refused(const std::string& bytes, std::string_view name) {
    try {
        const SurfaceMesh mesh = read_from_memory(bytes, name);
        ASSERT_FALSE(mesh.triangles.empty());
        for (const Vector& p : mesh.positions) ASSERT_LE(p.lpNorm<Eigen::Infinity>(), largest_coordinate);
        for (const Triangle& t : mesh.triangles)
            for (const Index v : t) ASSERT_LT(v, mesh.positions.size());
    } catch (const InputError& error) {
        ASSERT_TRUE(std::string_view(error.what()).starts_with(name)) << error.what();
        ASSERT_EQ(std::string_view(error.what()).find('\n'), std::string_view::npos);
    }
}

TEST(Read, RandomDamage) {
    std::mt19937 random(7);
    auto below = [&](std::size_t n) { return std::size_t(random() % n); };
    const SurfaceMesh mesh = ball(0);
    const std::vector<std::pair<std::string, std::string>> files = {
        {"a.obj", to_obj(mesh) + "f 1/2/3 2//1 \\\n3/1 -1\n"},
        {"a.off", to_off(mesh)},
        {"a.stl", to_stl_text(mesh)},
        {"a.stl", to_stl_binary(mesh)},
        {"a.ply", to_ply(mesh, PlyEncoding::ascii)},
        {"a.ply", to_ply(mesh, PlyEncoding::binary_little)},
        {"a.ply", to_ply(mesh, PlyEncoding::binary_big)}};
    const std::string likely = "0123456789-+.e \n\r/#\\\xff";
    for (const auto& [name, good] : files) {
        expect_read_or_refused(good, name);
        for (int n = 0; n < 3000; ++n) {
            std::string bytes = good;
            for (std::size_t damages = 1 + below(4); damages > 0 && !bytes.empty(); --damages) {
                const char c = below(2) == 0 ? likely[below(likely.size())] : char(random());
                const std::size_t at = below(bytes.size());
                switch (below(5)) {
                    case 0:
                        bytes.resize(at);
                        break;
                    case 1:
                        bytes.insert(at, 1 + below(3), c);
                        break;
                    case 2:
                        bytes.erase(at, 1 + below(8));
                        break;
                    case 3:
                        bytes.insert(at, bytes.substr(below(bytes.size()), below(40)));
                        break;
                    default:
                        bytes[at] = c;
                }
            }
            expect_read_or_refused(bytes, name);
        }
    }
}

TEST(Read, RealMeshes) {
    const std::filesystem::path folder = SHARED_MESHES;
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no meshes in " << folder;
    auto expect_vertices = [&](const char* file, std::size_t before, std::size_t after) {
        const SurfaceMesh mesh = read(folder / file);
        EXPECT_EQ(mesh.positions.size(), before) << file;
        EXPECT_EQ(weld(mesh).mesh.positions.size(), after) << file;
    };
    expect_vertices("liver.obj", 181, 139);
    expect_vertices("liver2.obj", 1170, 1170);
    expect_vertices("Bunny.stl", 3 * 2728, 1366);
    expect_vertices("torus.obj", 800, 800);
    expect_vertices("spot.obj", 2930, 2930);
}

}  // namespace
}  // namespace innerspring
