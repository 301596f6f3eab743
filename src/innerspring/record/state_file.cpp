#include "innerspring/record/state_file.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <fstream>
#include <iterator>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/write.h"

namespace innerspring {

static_assert(std::endian::native == std::endian::little, "the state file is little endian");

namespace {
constexpr std::string_view magic = "innerspring state 1\n";
}

std::uint64_t text_hash(std::string_view text) {
    std::uint64_t hash = 14695981039346656037u;  // FNV-1a
    for (char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
    return hash;
}

void write_state(const SavedState& saved, const std::filesystem::path& file) {
    std::string bytes(magic);
    auto add = [&](const void* data, std::size_t size) {
        bytes.append(static_cast<const char*>(data), size);
    };
    const std::uint64_t n = saved.state.x.size();
    add(&saved.scene_hash, 8);
    add(&saved.energy_bound, 8);
    add(&n, 8);
    add(&saved.state.time, 8);
    add(&saved.state.steps, 8);
    add(saved.state.x.data(), n * sizeof(Vector));
    add(saved.state.v.data(), n * sizeof(Vector));
    const std::uint64_t check = text_hash(bytes);
    add(&check, 8);
    write_whole(file, bytes);
}

SavedState read_state(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw InputError(fmt::format("{}: there is no saved state to resume from", file.string()));
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    if (!bytes.starts_with(magic))
        throw InputError(fmt::format("{}: not a saved state of this version", file.string()));
    const std::size_t head = magic.size() + 5 * 8 + 8;
    std::uint64_t n = 0;
    if (bytes.size() >= head) std::memcpy(&n, bytes.data() + magic.size() + 2 * 8, 8);
    if (n > bytes.size() || bytes.size() != head + 2 * n * sizeof(Vector))
        throw InputError(fmt::format("{}: damaged ({} bytes long)", file.string(), bytes.size()));
    std::uint64_t check;
    std::memcpy(&check, bytes.data() + bytes.size() - 8, 8);
    if (check != text_hash(std::string_view(bytes).substr(0, bytes.size() - 8)))
        throw InputError(fmt::format("{}: damaged (its checksum does not match)", file.string()));

    SavedState saved;
    const char* p = bytes.data() + magic.size();
    auto take = [&](void* data, std::size_t size) {
        std::memcpy(data, p, size);
        p += size;
    };
    take(&saved.scene_hash, 8);
    take(&saved.energy_bound, 8);
    take(&n, 8);
    take(&saved.state.time, 8);
    take(&saved.state.steps, 8);
    saved.state.x.resize(n);
    saved.state.v.resize(n);
    take(saved.state.x.data(), n * sizeof(Vector));
    take(saved.state.v.data(), n * sizeof(Vector));
    return saved;
}

}  // namespace innerspring
