#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/read.h"
#include "innerspring/mesh/write.h"
#include "small_meshes.h"

namespace innerspring {
namespace {

namespace fs = std::filesystem;

using testing::ball;

/// Unrelated triangles over doubles of every magnitude a file may hold, subnormal ones and both zeros
/// included.
SurfaceMesh soup(unsigned seed, double largest) {
    std::mt19937_64 random(seed);
    SurfaceMesh mesh;
    const std::vector<double> special = {0.0,     -0.0,     5e-324, -5e-324, 2.2250738585072014e-308,
                                         largest, -largest, 0.1,    1.0 / 3, 123456789.123456789};
    auto coordinate = [&]() -> double {
        if (random() % 8 == 0) return special[random() % special.size()];
        for (;;)
            if (const double x = std::bit_cast<double>(random()); std::abs(x) <= largest) return x;
    };
    while (mesh.positions.size() < 400) {
        const double x = coordinate(), y = coordinate(), z = coordinate();
        mesh.positions.emplace_back(x, y, z);
    }
    while (mesh.triangles.size() < 500) {
        const Index a = Index(random() % 400), b = Index(random() % 400), c = Index(random() % 400);
        mesh.triangles.push_back({a, b, c});
    }
    return mesh;
}

bool same_bits(const Vector& a, const Vector& b) {
    for (int i = 0; i < 3; ++i)
        if (std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i])) return false;
    return true;
}

void expect_equal(const SurfaceMesh& a, const SurfaceMesh& b) {
    ASSERT_EQ(a.positions.size(), b.positions.size());
    for (std::size_t v = 0; v < a.positions.size(); ++v)
        EXPECT_TRUE(same_bits(a.positions[v], b.positions[v])) << v;
    EXPECT_EQ(a.triangles, b.triangles);
}

/// STL gives every triangle its own corners, in order.
template <class Round>
void expect_equal_corners(const SurfaceMesh& a, const SurfaceMesh& b, Round round) {
    ASSERT_EQ(a.triangles.size(), b.triangles.size());
    for (std::size_t t = 0; t < a.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vector expected = a.positions[a.triangles[t][k]].unaryExpr(round);
            EXPECT_TRUE(same_bits(expected, b.positions[b.triangles[t][k]])) << t;
        }
}

TEST(Write, RoundTripsKeepEveryBit) {
    for (const SurfaceMesh& mesh : {ball(0), soup(1, largest_coordinate), soup(2, 1e3)}) {
        expect_equal(mesh, read_from_memory(to_obj(mesh), "a"));
        expect_equal(mesh, read_from_memory(to_off(mesh), "a"));
        for (const PlyEncoding encoding :
             {PlyEncoding::ascii, PlyEncoding::binary_little, PlyEncoding::binary_big})
            expect_equal(mesh, read_from_memory(to_ply(mesh, encoding), "a"));
    }
}

TEST(Write, StlRoundTrips) {
    // The float next to 1e30 lies beyond the largest coordinate.
    for (const SurfaceMesh& mesh : {ball(0), soup(3, 0.99 * largest_coordinate)}) {
        expect_equal_corners(mesh, read_from_memory(to_stl_text(mesh), "a"), [](double x) { return x; });
        expect_equal_corners(mesh, read_from_memory(to_stl_binary(mesh), "a"),
                             [](double x) { return double(float(x)); });
    }
}

TEST(Write, FormatsAreRecognised) {
    const SurfaceMesh mesh = ball(0);
    EXPECT_EQ(detect_format(to_obj(mesh), ""), MeshFormat::obj);
    EXPECT_EQ(detect_format(to_off(mesh), ""), MeshFormat::off);
    EXPECT_EQ(detect_format(to_ply(mesh), ""), MeshFormat::ply);
    EXPECT_EQ(detect_format(to_stl_text(mesh), ""), MeshFormat::stl_text);
    EXPECT_EQ(detect_format(to_stl_binary(mesh), ""), MeshFormat::stl_binary);
}

TEST(Write, StlNormalsPointOutwards) {
    SurfaceMesh mesh;
    mesh.positions = {{0, 0, 0}, {2, 0, 0}, {0, 3, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 1}, {0, 0, 1}};
    const std::string text = to_stl_text(mesh);
    EXPECT_NE(text.find("facet normal 0 0 1\n"), std::string::npos);
    EXPECT_NE(text.find("-1\n"), std::string::npos);
    EXPECT_NE(text.find("facet normal 0 0 0\n"), std::string::npos);
}

struct WriteFile : ::testing::Test {
    fs::path folder = fs::path(::testing::TempDir()) / ("innerspring_write_" + std::to_string(::getpid()));
    void SetUp() override { fs::create_directories(folder); }
    void TearDown() override {
        ::chmod(folder.c_str(), 0755);
        fs::remove_all(folder);
    }
    std::size_t entries() const {
        return std::size_t(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
    }
    static std::string content(const fs::path& file) {
        std::ifstream in(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    static std::string message_of(const fs::path& file) {
        try {
            write_whole(file, "x");
        } catch (const RunError& error) {
            return error.what();
        }
        return "no error";
    }
};

TEST_F(WriteFile, ExtensionChoosesTheFormat) {
    const SurfaceMesh mesh = ball(0);
    for (const char* name : {"a.obj", "a.off", "a.PLY"}) {
        write(mesh, folder / name);
        expect_equal(mesh, read(folder / name));
    }
    write(mesh, folder / "a.stl");
    EXPECT_EQ(read(folder / "a.stl").triangles.size(), 8u);
    EXPECT_EQ(entries(), 4u);
    EXPECT_THROW(write(mesh, folder / "a.vtk"), InputError);
    EXPECT_THROW(write(mesh, folder / "obj"), InputError);
}

TEST_F(WriteFile, ReplacesTheWholeFile) {
    write_whole(folder / "a", "something long");
    write_whole(folder / "a", std::string_view("b\0c", 3));
    EXPECT_EQ(content(folder / "a"), std::string("b\0c", 3));
    EXPECT_EQ(entries(), 1u);
}

TEST_F(WriteFile, WritesThroughLinksAndToDevices) {
    write_whole(folder / "a", "old");
    fs::create_symlink("a", folder / "link");
    write_whole(folder / "link", "new");
    EXPECT_TRUE(fs::is_symlink(folder / "link"));
    EXPECT_EQ(content(folder / "a"), "new");
    write_whole("/dev/null", "x");
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(WriteFile, FailureNamesFileAndReasonAndLeavesNothing) {
    EXPECT_EQ(message_of(folder / "none" / "a"),
              (folder / "none" / "a").string() + ": cannot be written: No such file or directory");
    EXPECT_NE(message_of(folder).find("Is a directory"), std::string::npos);
    EXPECT_NE(message_of(folder / std::string(300, 'n')).find("File name too long"), std::string::npos);
    EXPECT_EQ(entries(), 0u);
    if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
    EXPECT_EQ(message_of("/dev/full"), "/dev/full: cannot be written: No space left on device");
}

TEST_F(WriteFile, NamesWithoutDirectory) {
    const fs::path before = fs::current_path();
    fs::current_path(folder);
    write_whole("plain", "x");
    fs::current_path(before);
    EXPECT_EQ(content(folder / "plain"), "x");
}

}  // namespace
}  // namespace innerspring
