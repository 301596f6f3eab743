#include "innerspring/record/tetrahedra.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/write.h"
#include "innerspring/record/program.h"

namespace innerspring {

namespace {

/// A folder of our own, gone with us.
struct Folder {
    std::filesystem::path path;
    Folder() {
        std::string name = (std::filesystem::temp_directory_path() / "innerspring-XXXXXX").string();
        if (!mkdtemp(name.data())) throw RunError("tetgen: no temporary folder can be made");
        path = name;
    }
    ~Folder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
};

/// Numbers to the last bit; every triangle is a facet of its own.
std::string to_poly(const SurfaceMesh& mesh) {
    std::string text = fmt::format("{} 3 0 0\n", mesh.positions.size());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        text += fmt::format("{} {} {} {}\n", i, mesh.positions[i].x(), mesh.positions[i].y(),
                            mesh.positions[i].z());
    text += fmt::format("{} 0\n", mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) text += fmt::format("1\n3 {} {} {}\n", t[0], t[1], t[2]);
    return text + "0\n0\n";
}

/// The numbers of a file of TetGen, comments left out.
std::vector<double> numbers_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw RunError(fmt::format("tetgen: it left no {}", file.extension().string()));
    std::vector<double> numbers;
    for (std::string line; std::getline(in, line);) {
        const char* at = line.data();
        const char* const end = at + std::min(line.find('#'), line.size());
        while (true) {
            while (at < end && (*at == ' ' || *at == '\t' || *at == '\r')) ++at;
            if (at == end) break;
            double value = 0;
            const auto [next, error] = std::from_chars(at, end, value);
            if (error != std::errc()) throw RunError("tetgen: its files cannot be read");
            numbers.push_back(value);
            at = next;
        }
    }
    return numbers;
}

/// Rows of "index value value ..." after a head of `head` numbers whose first is how many rows there are.
std::vector<std::vector<double>> rows_of(const std::filesystem::path& file, std::size_t head,
                                         std::size_t width) {
    const std::vector<double> n = numbers_of(file);
    if (n.size() < head || n.size() != head + std::size_t(n[0]) * (width + 1))
        throw RunError("tetgen: its files are not as expected");
    std::vector<std::vector<double>> rows;
    for (auto at = n.begin() + std::ptrdiff_t(head); at != n.end(); at += std::ptrdiff_t(width + 1))
        rows.emplace_back(at + 1, at + std::ptrdiff_t(width + 1));
    return rows;
}

double volume_of(const TetMesh& mesh, const std::array<Index, 4>& t) {
    const auto& x = mesh.positions;
    return (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).dot(x[t[3]] - x[t[0]]) / 6;
}

/// Throws unless the faces that only one tetrahedron has are the surface's triangles.
void require_surface(const TetMesh& mesh, const SurfaceMesh& surface) {
    std::set<Triangle> open;
    const auto meet = [&](Triangle face) {
        std::sort(face.begin(), face.end());
        if (!open.insert(face).second) open.erase(face);
    };
    for (const auto& t : mesh.tetrahedra) {
        meet({t[0], t[1], t[2]});
        meet({t[0], t[1], t[3]});
        meet({t[0], t[2], t[3]});
        meet({t[1], t[2], t[3]});
    }
    for (const Triangle& t : surface.triangles) meet(t);
    if (!open.empty())
        throw RunError(fmt::format(
            "tetgen: the surface of '{}' was not kept ({} faces differ); 'innerspring check --fix' "
            "may help",
            surface.name, open.size()));
}

}  // namespace

TetMesh fill_with_tetrahedra(const SurfaceMesh& surface, const TetrahedraOptions& options) {
    const Folder folder;
    write_whole(folder.path / "solid.poly", to_poly(surface));
    // p: a surface to fill; Y: keep its triangles; M: do not merge those in one plane; q, a: quality; Q:
    // quiet; B, F, E, z: no marks, faces or edges to read, count from 0.
    std::string switches = fmt::format("-pYMQBFzq{}", options.radius_edge_ratio);
    if (options.largest_volume > 0) switches += fmt::format("a{}", options.largest_volume);
    const ProgramOutput output =
        run_program({"tetgen", switches, (folder.path / "solid.poly").string()}, "", options.patience_s);
    if (output.failure == "tetgen is not installed")
        throw RunError(
            "tetgen is not installed: it fills the surface with tetrahedra for the reference "
            "(apt-get install tetgen)");
    if (!output.failure.empty()) throw RunError(output.failure);
    if (!std::filesystem::exists(folder.path / "solid.1.ele"))
        throw InputError(
            fmt::format("'{}' cannot be filled with tetrahedra; 'innerspring check' finds self-intersections "
                        "(tetgen: {})",
                        surface.name, last_line(output.out + output.err)));

    TetMesh mesh;
    for (const auto& row : rows_of(folder.path / "solid.1.node", 4, 3))
        mesh.positions.emplace_back(row[0], row[1], row[2]);
    for (const auto& row : rows_of(folder.path / "solid.1.ele", 3, 4)) {
        std::array<Index, 4> t{};
        for (std::size_t k = 0; k < 4; ++k) {
            if (!(row[k] >= 0 && row[k] < double(mesh.positions.size())))
                throw RunError("tetgen: its files are not as expected");
            t[k] = Index(row[k]);
        }
        mesh.tetrahedra.push_back(t);
    }
    if (mesh.positions.size() < surface.positions.size())
        throw RunError("tetgen: vertices of the surface are missing");
    for (std::size_t i = 0; i < surface.positions.size(); ++i) {
        if (!((mesh.positions[i] - surface.positions[i]).norm() <=
              1e-9 * surface.positions[i].norm() + 1e-12))
            throw RunError("tetgen: vertices of the surface were moved");
        mesh.positions[i] = surface.positions[i];
    }
    for (auto& t : mesh.tetrahedra)
        if (volume_of(mesh, t) < 0) std::swap(t[2], t[3]);
    require_surface(mesh, surface);
    return mesh;
}

}  // namespace innerspring
