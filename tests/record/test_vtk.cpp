#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "innerspring/mesh/error.h"
#include "innerspring/record/vtk.h"

namespace innerspring {
namespace {

// A reader that knows the format from its description only.
struct Array {
    std::string type;
    int components = 0;
    std::string bytes;

    template <class T>
    std::vector<T> as() const {
        std::vector<T> values(bytes.size() / sizeof(T));
        if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
        return values;
    }
};

std::string attribute(const std::string& element, const std::string& name) {
    const std::size_t key = element.find(" " + name + "=\"");
    if (key == std::string::npos) return "";
    const std::size_t begin = key + name.size() + 3;
    return element.substr(begin, element.find('"', begin) - begin);
}

std::map<std::string, Array> arrays_of(const std::string& file) {
    std::map<std::string, Array> arrays;
    const std::size_t appended = file.find("<AppendedData encoding=\"raw\">");
    const std::size_t base = file.find('_', file.find('>', appended)) + 1;
    std::size_t at = 0;
    while ((at = file.find("<DataArray", at)) < appended) {
        const std::string element = file.substr(at, file.find('>', at) - at);
        EXPECT_EQ(attribute(element, "format"), "appended");
        const std::size_t block = base + std::stoull(attribute(element, "offset"));
        std::uint64_t size = 0;
        std::memcpy(&size, file.data() + block, sizeof size);
        EXPECT_LE(block + sizeof size + size, file.size());
        arrays[attribute(element, "Name")] = {attribute(element, "type"),
                                              std::stoi(attribute(element, "NumberOfComponents")),
                                              file.substr(block + sizeof size, size)};
        at += element.size();
    }
    return arrays;
}

const std::vector<Vector> corners = {{0, -0.0, 1.0 / 3},
                                     {1e-310, 1e308, -1},
                                     {3.141592653589793, 0.1, 2},
                                     {std::numeric_limits<double>::quiet_NaN(), 7, 8}};
const std::vector<Triangle> tetrahedron = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

void expect_same_bits(const std::vector<double>& read, const double* written, std::size_t count) {
    ASSERT_EQ(read.size(), count);
    for (std::size_t i = 0; i < count; ++i)
        EXPECT_EQ(std::bit_cast<std::uint64_t>(read[i]), std::bit_cast<std::uint64_t>(written[i])) << i;
}

TEST(Vtk, EveryNumberComesBackBitForBit) {
    const std::vector<double> mass = {0.1, -0.0, std::numeric_limits<double>::infinity(), 5e-324};
    const std::vector<VertexField> fields = {{"mass_kg", std::span<const double>(mass)},
                                             {"displacement_m", std::span<const Vector>(corners)}};
    const std::string file = to_vtp(corners, tetrahedron, fields);
    const auto arrays = arrays_of(file);
    ASSERT_EQ(arrays.size(), 5u);
    for (const char* name : {"Points", "displacement_m"}) {
        EXPECT_EQ(arrays.at(name).type, "Float64");
        EXPECT_EQ(arrays.at(name).components, 3);
        expect_same_bits(arrays.at(name).as<double>(), corners[0].data(), 12);
    }
    EXPECT_EQ(arrays.at("mass_kg").components, 1);
    expect_same_bits(arrays.at("mass_kg").as<double>(), mass.data(), 4);
    EXPECT_EQ(arrays.at("connectivity").type, "Int32");
    EXPECT_EQ(arrays.at("connectivity").as<std::int32_t>(),
              (std::vector<std::int32_t>{0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2}));
    EXPECT_EQ(arrays.at("offsets").as<std::int32_t>(), (std::vector<std::int32_t>{3, 6, 9, 12}));
}

TEST(Vtk, SaysWhatItHolds) {
    const std::string file = to_vtp(corners, tetrahedron, {});
    const std::string root = file.substr(file.find("<VTKFile"), 200);
    EXPECT_EQ(attribute(root, "type"), "PolyData");
    EXPECT_EQ(attribute(root, "version"), "1.0");
    EXPECT_EQ(attribute(root, "header_type"), "UInt64");
    EXPECT_EQ(attribute(root, "byte_order"),
              std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian");
    const std::string piece = file.substr(file.find("<Piece"), 200);
    EXPECT_EQ(attribute(piece, "NumberOfPoints"), "4");
    EXPECT_EQ(attribute(piece, "NumberOfPolys"), "4");
}

TEST(Vtk, EmptySurfaceIsAFile) {
    const auto arrays = arrays_of(to_vtp({}, {}, {}));
    EXPECT_EQ(arrays.size(), 3u);
    for (const auto& [name, array] : arrays) EXPECT_TRUE(array.bytes.empty()) << name;
}

TEST(Vtk, NamesAreEscaped) {
    const std::vector<double> values(4, 1.0);
    const std::vector<VertexField> fields = {{"a<b>&\"c\"'\n\xff", std::span<const double>(values)}};
    const auto arrays = arrays_of(to_vtp(corners, tetrahedron, fields));
    EXPECT_TRUE(arrays.contains("a&lt;b&gt;&amp;&quot;c&quot;&apos; ?"));
}

TEST(Vtk, FieldOfAnotherLengthIsRefused) {
    const std::vector<double> values(3, 1.0);
    const std::vector<VertexField> fields = {{"mass_kg", std::span<const double>(values)}};
    EXPECT_THROW(to_vtp(corners, tetrahedron, fields), RunError);
}

TEST(Vtk, CollectionKeepsTimesAndNames) {
    const std::vector<Frame> frames = {{0, "a&b_0.vtp"}, {0.1 + 0.2, "b.vtp"}, {1e-7, "c.vtp"}};
    const std::string file = to_pvd(frames);
    std::size_t at = 0;
    for (const Frame& frame : frames) {
        at = file.find("<DataSet", at + 1);
        ASSERT_NE(at, std::string::npos);
        const std::string element = file.substr(at, file.find("/>", at) - at);
        EXPECT_EQ(std::stod(attribute(element, "timestep")), frame.time);
        EXPECT_EQ(attribute(element, "file"), frame.file == "a&b_0.vtp" ? "a&amp;b_0.vtp" : frame.file);
    }
    EXPECT_EQ(file.find("<DataSet", at + 1), std::string::npos);
}

}  // namespace
}  // namespace innerspring
