#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "allocation_limit.h"
#include "innerspring/mesh/error.h"
#include "innerspring/record/scene.h"

namespace {

void require(bool holds) {
    if (!holds) std::abort();
}

/// Calls `read`; all it may do is return or throw an InputError of one line that begins with `prefix`.
template <class Read>
void read_or_refuse(std::size_t size, std::string_view prefix, Read read) {
    const allocation::Limit limit(size);
    try {
        read();
    } catch (const innerspring::InputError& error) {
        const std::string_view message = error.what();
        require(message.starts_with(prefix) && message.find('\n') == message.npos && message.size() < 600);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    std::string written;
    read_or_refuse(size, "fuzz:", [&] { written = to_toml(innerspring::scene_from_text(text, "fuzz")); });
    if (!written.empty()) {
        const allocation::Limit limit(written.size());
        require(to_toml(innerspring::scene_from_text(written, "again")) == written);
    }
    read_or_refuse(size, "--force:", [&] { innerspring::parse_force(text); });
    read_or_refuse(size, "--pin:", [&] { innerspring::parse_pin(text); });
    return 0;
}
