#pragma once
#include <cstddef>
#include <cstdint>

namespace innerspring {

/// splitmix64 (Steele, Lea & Flood 2014): the same numbers on every platform, unlike the distributions of
/// <random>.
class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    std::uint64_t bits() {
        std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }

    /// Uniform in [0, 1).
    double uniform() { return double(bits() >> 11) * 0x1p-53; }

    /// Uniform in [low, high).
    double uniform(double low, double high) { return low + (high - low) * uniform(); }

    /// A whole number in [0, n), n > 0.
    std::size_t below(std::size_t n) { return std::size_t(bits() % n); }

  private:
    std::uint64_t state_;
};

}  // namespace innerspring
