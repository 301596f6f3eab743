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
constexpr std::string_view magic = "innerspring state 2\n";
constexpr std::size_t view_size = 2 * 8 + 2 * 7 * 8 + 3 * 8;  // all doubles
}  // namespace

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
    const std::uint64_t n = saved.state.x.size(), views = saved.views.size();
    add(&saved.scene_hash, 8);
    add(&saved.energy_bound, 8);
    add(&n, 8);
    add(&views, 8);
    add(&saved.state.time, 8);
    add(&saved.state.steps, 8);
    add(saved.state.x.data(), n * sizeof(Vector));
    add(saved.state.v.data(), n * sizeof(Vector));
    for (const ToolView& view : saved.views) {
        const double tool = view.tool;
        add(&view.time, 8);
        add(&tool, 8);
        for (const Pose* pose : {&view.from, &view.to}) {
            add(pose->position.data(), sizeof(Vector));
            add(pose->rotation.coeffs().data(), 4 * 8);
        }
        add(view.back.data(), sizeof(Vector));
    }
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
    const std::size_t head = magic.size() + 6 * 8 + 8;
    std::uint64_t n = 0, views = 0;
    if (bytes.size() >= head) {
        std::memcpy(&n, bytes.data() + magic.size() + 2 * 8, 8);
        std::memcpy(&views, bytes.data() + magic.size() + 3 * 8, 8);
    }
    if (n > bytes.size() || views > bytes.size() ||
        bytes.size() != head + 2 * n * sizeof(Vector) + views * view_size)
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
    take(&views, 8);
    take(&saved.state.time, 8);
    take(&saved.state.steps, 8);
    saved.state.x.resize(n);
    saved.state.v.resize(n);
    take(saved.state.x.data(), n * sizeof(Vector));
    take(saved.state.v.data(), n * sizeof(Vector));
    saved.views.resize(views);
    for (ToolView& view : saved.views) {
        double tool = 0;
        take(&view.time, 8);
        take(&tool, 8);
        view.tool = Index(tool);
        for (Pose* pose : {&view.from, &view.to}) {
            take(pose->position.data(), sizeof(Vector));
            take(pose->rotation.coeffs().data(), 4 * 8);
        }
        take(view.back.data(), sizeof(Vector));
    }
    return saved;
}

}  // namespace innerspring
