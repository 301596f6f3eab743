#include "innerspring/record/vtk_read.h"

#include <gtest/gtest.h>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/write.h"
#include "support/temporary_folder.h"

using namespace innerspring;

namespace {

std::string sample(SurfaceMesh& mesh, std::vector<double>& m) {
    mesh = make_shape("breast:vertices=60");
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) m.push_back(1.0 / double(i + 3));
    const VertexField fields[] = {{"m_kg", std::span<const double>(m)},
                                  {"u <&>", std::span<const Vector>(mesh.positions)}};
    return to_vtp(mesh.positions, mesh.triangles, fields);
}

}  // namespace

TEST(VtkRead, GivesBackWhatWasWritten) {
    SurfaceMesh mesh;
    std::vector<double> m;
    const VtpData read = vtp_from_memory(sample(mesh, m), "sample");
    EXPECT_EQ(read.positions, mesh.positions);
    EXPECT_EQ(read.triangles, mesh.triangles);
    ASSERT_EQ(read.fields.size(), 2u);
    EXPECT_EQ(read.fields[0].first, "m_kg");
    EXPECT_EQ(read.fields[0].second, m);
    EXPECT_EQ(read.fields[1].first, "u <&>");
    EXPECT_EQ(read.fields[1].second.size(), 3 * m.size());
}

TEST(VtkRead, DamageIsSaidAndNothingElseHappens) {
    SurfaceMesh mesh;
    std::vector<double> m;
    const std::string whole = sample(mesh, m);
    for (std::size_t cut = 0; cut + 40 < whole.size(); cut += 11)
        EXPECT_THROW(vtp_from_memory(std::string_view(whole).substr(0, cut), "cut"), InputError) << cut;
    for (std::size_t at = 0; at < whole.size(); ++at) {
        std::string bytes = whole;
        bytes[at] = char(bytes[at] ^ 0x41);
        try {
            const VtpData read = vtp_from_memory(bytes, "damaged");
            for (const Triangle& t : read.triangles)
                for (Index i : t) ASSERT_LT(i, read.positions.size());
        } catch (const InputError& error) {
            EXPECT_TRUE(std::string(error.what()).starts_with("damaged:"));
        }
    }
}

TEST(VtkRead, Collections) {
    const TemporaryFolder folder("pvd");
    const Frame frames[] = {{0, "frames/a & b.vtp"}, {0.25, "frames/c.vtp"}};
    write_whole(folder.path / "frames.pvd", to_pvd(frames));
    const auto read = read_pvd(folder.path / "frames.pvd");
    ASSERT_EQ(read.size(), 2u);
    EXPECT_EQ(read[0].file, "frames/a & b.vtp");
    EXPECT_EQ(read[1].time, 0.25);
    const Frame outside[] = {{0, "../elsewhere.vtp"}};
    write_whole(folder.path / "frames.pvd", to_pvd(outside));
    EXPECT_THROW(read_pvd(folder.path / "frames.pvd"), InputError);
    EXPECT_THROW(read_pvd(folder.path / "missing.pvd"), InputError);
}
