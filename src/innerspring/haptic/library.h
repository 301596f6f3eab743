#pragma once
#include <span>
#include <string>

#include "innerspring/haptic/device.h"

namespace innerspring {

/// A vendor's library, loaded at run time, so that one program serves with and without it.
class VendorLibrary {
  public:
    /// `vendor`: as errors name it, "OpenHaptics".
    explicit VendorLibrary(std::string vendor) : vendor_(std::move(vendor)) {}
    ~VendorLibrary() { unload(); }
    VendorLibrary(const VendorLibrary&) = delete;
    VendorLibrary& operator=(const VendorLibrary&) = delete;

    /// `file`, or if that is empty the first of `names` that the system finds. Throws DeviceError saying what
    /// was looked for and where, and `advice`. Nothing to do if it is loaded already.
    void load(const std::string& file, std::span<const char* const> names, const char* advice);
    void unload() noexcept;
    bool loaded() const { return handle_; }

    /// Throws DeviceError if the library has no such function, and unloads it.
    template <class Function>
    void bind(Function& function, const char* name) {
        function = reinterpret_cast<Function>(symbol(name));
    }

  private:
    void* symbol(const char* name);
    std::string vendor_;
    void* handle_ = nullptr;
};

}  // namespace innerspring
