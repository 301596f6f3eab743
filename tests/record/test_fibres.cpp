#include "innerspring/record/fibres.h"

#include <gtest/gtest.h>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/random.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/record/setup.h"
#include "innerspring/record/vtk.h"
#include "support/bodies.h"
#include "support/temporary_folder.h"

// Fields of fibres from files.
namespace innerspring {
namespace {

TEST(Fibres, CsvIsReadByItsHeadings) {
    const FibreSamples s = fibres_from_csv(
        "vertex,fibre_z,x_m,y_m,z_m,\"fibre_x\",fibre_y\r\n0,3,0.5,1e-1,-2,1,2\r\n\r\n1, 0, 4 ,5,6,-1,0\r\n",
        "f.csv");
    ASSERT_EQ(s.places.size(), 2u);
    EXPECT_EQ(s.places[0], Vector(0.5, 0.1, -2));
    EXPECT_EQ(s.directions[0], Vector(1, 2, 3));
    EXPECT_EQ(s.places[1], Vector(4, 5, 6));
    EXPECT_EQ(s.directions[1], Vector(-1, 0, 0));
    // As spreadsheets write it.
    const FibreSamples other = fibres_from_csv(
        "\xEF\xBB\xBFx_m,y_m,z_m,fibre_x,fibre_y,fibre_z\r\n+1,-2,+3e0,0,+0.5,1\r\n", "f.csv");
    EXPECT_EQ(other.places[0], Vector(1, -2, 3));
    EXPECT_EQ(other.directions[0], Vector(0, 0.5, 1));
}

TEST(Fibres, WhatIsNoFieldIsRefusedWithItsLine) {
    const std::string head = "x_m,y_m,z_m,fibre_x,fibre_y,fibre_z\n";
    const std::pair<std::string, const char*> wrong[] = {
        {"", "f.csv:1: no column 'x_m'"},
        {"x_m,y_m,z_m,fibre_x,fibre_y\n", "'fibre_z'"},
        {head, "no fibre"},
        {head + "1,2,3,0,0,1\n1,2,3,0,0\n", "f.csv:3"},
        {head + "1,2,3,0,x,1\n", "f.csv:2: column 'fibre_y'"},
        {head + "1,2,+-3,0,0,1\n", "f.csv:2: column 'z_m'"},
        {head + "1,2,inf,0,0,1\n", "f.csv:2: column 'z_m'"},
        {head + "1,2,3,0,0,0\n", "f.csv:2: the fibre has no"}};
    for (const auto& [text, part] : wrong) {
        try {
            fibres_from_csv(text, "f.csv");
            ADD_FAILURE() << text;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
    }
}

// Any bytes are read or refused.
TEST(Fibres, RandomDamageIsReadOrRefused) {
    const std::string whole =
        "x_m,y_m,z_m,fibre_x,fibre_y,fibre_z\n1,2,3,0,0,1\n4,5,6,1,0,0\n7,8,9,0,1,1e2\n";
    Random random(5);
    for (int n = 0; n < 3000; ++n) {
        std::string text = whole;
        for (int k = 0; k < 3; ++k) text[random.bits() % text.size()] = char(random.bits());
        if (n % 3 == 0) text.resize(random.bits() % text.size());
        try {
            for (const Vector& a : fibres_from_csv(text, "f").directions) ASSERT_GT(a.stableNorm(), 0);
        } catch (const InputError&) {
        }
    }
}

TEST(Fibres, TheNearestSampleCounts) {
    Random random(2);
    FibreSamples s;
    for (int n = 0; n < 500; ++n) {
        s.places.push_back(support::random_vector(random));
        s.directions.push_back(Vector(n + 1, 0, 0));
    }
    const auto field = nearest_fibre(s);
    for (int n = 0; n < 200; ++n) {
        const Vector q = 2 * support::random_vector(random);
        std::size_t least = 0;
        for (std::size_t k = 1; k < s.places.size(); ++k)
            if ((s.places[k] - q).norm() < (s.places[least] - q).norm()) least = k;
        EXPECT_EQ(field(q).x(), double(least + 1));
    }
}

// A scene with a field gives each vertex the direction that the file has where it lies, whichever format.
TEST(Fibres, ASceneTakesThemFromAFile) {
    TemporaryFolder folder("fibres");
    const SurfaceMesh mesh = make_shape("breast:vertices=200");
    std::vector<Vector> a;
    std::string csv = "x_m,y_m,z_m,fibre_x,fibre_y,fibre_z\n";
    for (const Vector& q : mesh.positions) {
        a.push_back(Vector(1 + q.y(), q.z(), 0.5));
        csv += std::to_string(q.x()) + ',' + std::to_string(q.y()) + ',' + std::to_string(q.z()) + ',' +
               std::to_string(a.back().x()) + ',' + std::to_string(a.back().y()) + ",0.5\n";
    }
    const VertexField fields[] = {{"fibre", std::span<const Vector>(a)}};
    std::ofstream(folder.path / "f.vtp", std::ios::binary) << to_vtp(mesh.positions, mesh.triangles, fields);
    std::ofstream(folder.path / "f.csv") << csv;
    for (const char* file : {"f.vtp", "f.csv"}) {
        std::ofstream(folder.path / "s.toml") << "mesh = \"breast:vertices=200\"\n[anisotropy]\nkind = "
                                                 "\"fibres\"\nalong_pa = 30\nfield = \""
                                              << file << "\"\n";
        const innerspring::Setup setup = set_up(read_scene(folder.path / "s.toml"));
        for (Index i = 0; i < setup.body.vertices(); ++i)
            ASSERT_LT((fibre_direction(setup.body, i) - a[i].normalized()).norm(), 2e-6) << file << ' ' << i;
    }
    std::ofstream(folder.path / "s.toml")
        << "[anisotropy]\nkind = \"fibres\"\nalong_pa = 30\nfield = \"none.csv\"\n";
    EXPECT_THROW(set_up(read_scene(folder.path / "s.toml")), InputError);
    const VertexField others[] = {{"direction", std::span<const Vector>(a)}};
    std::ofstream(folder.path / "g.vtp", std::ios::binary) << to_vtp(mesh.positions, mesh.triangles, others);
    EXPECT_THROW(read_fibres(folder.path / "g.vtp"), InputError);
}

}  // namespace
}  // namespace innerspring
