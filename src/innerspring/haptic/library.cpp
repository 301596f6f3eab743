#include "innerspring/haptic/library.h"

#include <fmt/format.h>

#if defined(_WIN32)
#include <windows.h>
#else
#include <dlfcn.h>
#endif

namespace innerspring {

namespace {

#if defined(_WIN32)
void* open(const char* name) {
    return reinterpret_cast<void*>(LoadLibraryA(name));
}
void* find(void* library, const char* name) {
    return reinterpret_cast<void*>(GetProcAddress(static_cast<HMODULE>(library), name));
}
void close(void* library) {
    FreeLibrary(static_cast<HMODULE>(library));
}
std::string why() {
    return fmt::format("error {}", GetLastError());
}
constexpr const char* search_path = "the program's folder and PATH";
#else
void* open(const char* name) {
    return dlopen(name, RTLD_NOW | RTLD_LOCAL);
}
void* find(void* library, const char* name) {
    return dlsym(library, name);
}
void close(void* library) {
    dlclose(library);
}
std::string why() {
    const char* text = dlerror();
    return text ? text : "no reason given";
}
#if defined(__APPLE__)
constexpr const char* search_path = "/Library/Frameworks and DYLD_LIBRARY_PATH";
#else
constexpr const char* search_path = "LD_LIBRARY_PATH and the system's library folders (ldconfig)";
#endif
#endif

}  // namespace

void VendorLibrary::load(const std::string& file, std::span<const char* const> names, const char* advice) {
    if (handle_) return;
    std::string tried, reason;
    const auto try_one = [&](const char* name) {
        handle_ = open(name);
        if (handle_) return;
        tried += (tried.empty() ? "" : ", ") + std::string(name);
        reason = why();
    };
    if (!file.empty()) {
        try_one(file.c_str());
    } else {
        for (const char* name : names)
            if (!handle_) try_one(name);
    }
    if (!handle_)
        throw DeviceError(fmt::format("{}: its library is not there: looked for {} in {} ({}); {}", vendor_,
                                      tried, file.empty() ? search_path : "that place", reason, advice));
}

void VendorLibrary::unload() noexcept {
    if (handle_) close(handle_);
    handle_ = nullptr;
}

void* VendorLibrary::symbol(const char* name) {
    void* found = handle_ ? find(handle_, name) : nullptr;
    if (!found) {
        unload();
        throw DeviceError(fmt::format("{}: the library has no {}; is it the right one?", vendor_, name));
    }
    return found;
}

}  // namespace innerspring
