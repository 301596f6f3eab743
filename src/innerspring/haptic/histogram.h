#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace innerspring {

/// Times counted in bins 1/64 wide of their power of two (so to 1.6 %): any number of them in fixed memory.
class Histogram {
  public:
    void add(std::uint64_t nanoseconds) noexcept {
        ++bins_[bin(nanoseconds)];
        ++count_;
        most_ = std::max(most_, nanoseconds);
    }
    std::uint64_t count() const noexcept { return count_; }
    double max_ms() const noexcept { return double(most_) * 1e-6; }

    /// Not less than a share of all [ms]: the upper end of the bin, at most the largest.
    double quantile_ms(double share) const noexcept {
        const double wanted = share * double(count_);
        std::uint64_t sum = 0;
        for (std::size_t b = 0; b < bins_.size(); ++b)
            if (sum += bins_[b]; sum > 0 && double(sum) >= wanted)
                return std::min(double(upper(b)) * 1e-6, max_ms());
        return 0;
    }

  private:
    static constexpr int fine = 6;
    static std::size_t bin(std::uint64_t n) noexcept {
        if (n < 128) return n;
        const int shift = int(std::bit_width(n)) - 1 - fine;
        return (std::size_t(shift) << fine) + (n >> shift);
    }
    static std::uint64_t upper(std::size_t b) noexcept {
        if (b < 128) return b;
        const std::size_t shift = (b >> fine) - 1;
        return (((b & 63) + 65) << shift) - 1;
    }
    std::array<std::uint32_t, 3840> bins_{};
    std::uint64_t count_ = 0, most_ = 0;
};

}  // namespace innerspring
