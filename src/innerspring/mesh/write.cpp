#include "innerspring/mesh/write.h"

#include <fmt/format.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "STL and PLY are stored as they lie in memory");

template <class T>
void append(std::string& out, T value, bool big_endian = false) {
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (big_endian) std::reverse(raw.begin(), raw.end());
    out.append(raw.data(), raw.size());
}

/// Unit normal, or 0 for a degenerate triangle.
Vector normal_of(const SurfaceMesh& mesh, const Triangle& t) {
    const Vector& a = mesh.positions[t[0]];
    const Vector n = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
    const double length = n.stableNorm();
    return length > 0 && std::isfinite(length) ? Vector(n / length) : Vector::Zero();
}

/// "{}" writes the shortest decimal that reads back as the same double.
void append_rows(std::string& out, const SurfaceMesh& mesh, std::string_view vertex, std::string_view face,
                 Index first) {
    const auto end = std::back_inserter(out);
    for (const Vector& p : mesh.positions) fmt::format_to(end, "{}{} {} {}\n", vertex, p[0], p[1], p[2]);
    for (const Triangle& t : mesh.triangles)
        fmt::format_to(end, "{} {} {} {}\n", face, std::uint64_t(t[0]) + first, std::uint64_t(t[1]) + first,
                       std::uint64_t(t[2]) + first);
}

[[noreturn]] void fail(const fs::path& file, int error) {
    throw RunError(fmt::format("{}: cannot be written: {}", file.string(), std::strerror(error)));
}

/// Returns 0 or the errno of what went wrong.
int write_bytes(const fs::path& file, const char* mode, std::string_view bytes) {
    errno = 0;
    std::FILE* out = std::fopen(file.c_str(), mode);
    if (out == nullptr) return errno;
    int error = std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size() ? 0 : errno;
    if (std::fclose(out) != 0 && error == 0) error = errno;
    return error;
}

}  // namespace

std::string to_obj(const SurfaceMesh& mesh) {
    std::string out;
    append_rows(out, mesh, "v ", "f", 1);
    return out;
}

std::string to_off(const SurfaceMesh& mesh) {
    std::string out = fmt::format("OFF\n{} {} 0\n", mesh.positions.size(), mesh.triangles.size());
    append_rows(out, mesh, "", "3", 0);
    return out;
}

std::string to_ply(const SurfaceMesh& mesh, PlyEncoding encoding) {
    const bool ascii = encoding == PlyEncoding::ascii, big = encoding == PlyEncoding::binary_big;
    std::string out = fmt::format(
        "ply\nformat {} 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
        "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        ascii ? "ascii"
        : big ? "binary_big_endian"
              : "binary_little_endian",
        mesh.positions.size(), mesh.triangles.size());
    if (ascii) {
        append_rows(out, mesh, "", "3", 0);
        return out;
    }
    out.reserve(out.size() + 24 * mesh.positions.size() + 13 * mesh.triangles.size());
    for (const Vector& p : mesh.positions)
        for (int i = 0; i < 3; ++i) append(out, p[i], big);
    for (const Triangle& t : mesh.triangles) {
        out += '\3';
        for (const Index v : t) append(out, v, big);
    }
    return out;
}

std::string to_stl_text(const SurfaceMesh& mesh) {
    std::string out = "solid innerspring\n";
    const auto end = std::back_inserter(out);
    for (const Triangle& t : mesh.triangles) {
        const Vector n = normal_of(mesh, t);
        fmt::format_to(end, "facet normal {} {} {}\nouter loop\n", float(n[0]), float(n[1]), float(n[2]));
        for (const Index v : t) {
            const Vector& p = mesh.positions[v];
            fmt::format_to(end, "vertex {} {} {}\n", p[0], p[1], p[2]);
        }
        out += "endloop\nendfacet\n";
    }
    return out += "endsolid innerspring\n";
}

std::string to_stl_binary(const SurfaceMesh& mesh) {
    if (mesh.triangles.size() > no_index)
        throw RunError("binary STL holds at most 4294967295 triangles; write PLY");
    std::string out = "binary STL by innerspring";  // must not start with "solid"
    out.resize(80, ' ');
    out.reserve(84 + 50 * mesh.triangles.size());
    append(out, std::uint32_t(mesh.triangles.size()));
    for (const Triangle& t : mesh.triangles) {
        const Vector n = normal_of(mesh, t);
        for (int i = 0; i < 3; ++i) append(out, float(n[i]));
        for (const Index v : t)
            for (int i = 0; i < 3; ++i) append(out, float(mesh.positions[v][i]));
        append(out, std::uint16_t(0));
    }
    return out;
}

void write(const SurfaceMesh& mesh, const fs::path& file) {
    std::string extension = file.extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    if (extension == ".obj") return write_whole(file, to_obj(mesh));
    if (extension == ".stl") return write_whole(file, to_stl_binary(mesh));
    if (extension == ".ply") return write_whole(file, to_ply(mesh));
    if (extension == ".off") return write_whole(file, to_off(mesh));
    throw InputError(fmt::format("{}: unknown mesh format; name it .obj, .stl, .ply or .off", file.string()));
}

void write_whole(const fs::path& file, std::string_view bytes) {
    std::error_code error;
    // Through a link to what it means; and a device or pipe is written to, never replaced.
    const fs::path target = fs::is_symlink(file, error) ? fs::weakly_canonical(file, error) : file;
    if (fs::exists(target, error) && !fs::is_regular_file(target, error)) {
        if (const int reason = write_bytes(target, "wb", bytes); reason != 0) fail(file, reason);
        return;
    }
    static std::atomic<unsigned> counter = 0;
    fs::path temporary;
    int reason = 0;
    do {  // a run that was killed may have left the name behind
        temporary = target.parent_path() / fmt::format(".innerspring-{}-{}.tmp", ::getpid(), counter++);
        reason = write_bytes(temporary, "wbx", bytes);
    } while (reason == EEXIST);
    if (reason == 0 && std::rename(temporary.c_str(), target.c_str()) != 0) reason = errno;
    if (reason == 0) return;
    std::remove(temporary.c_str());
    fail(file, reason);
}

}  // namespace innerspring
