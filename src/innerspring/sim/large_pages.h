#pragma once
#include <algorithm>
#include <cstddef>
#include <new>
#include <vector>
#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace innerspring {

/// An array that a step walks over. If it is large it asks for pages of 2 MiB: neighbours are looked up all
/// over it, and small pages are more than the processor keeps the addresses of.
template <class T>
struct LargePages {
    using value_type = T;
    static constexpr std::size_t page = std::size_t(2) << 20;

    LargePages() = default;
    template <class Other>
    LargePages(const LargePages<Other>&) {}

    /// Small ones to a cache line, the longest vector.
    static constexpr std::size_t alignment(std::size_t n) {
        return n * sizeof(T) < page ? std::max<std::size_t>(alignof(T), 64) : page;
    }
    static T* allocate(std::size_t n) {
        void* const p = ::operator new(n * sizeof(T), std::align_val_t(alignment(n)));
#if defined(__linux__)
        if (alignment(n) == page)
            madvise(p, n * sizeof(T), MADV_HUGEPAGE);  // a wish; refused, nothing is lost
#endif
        return static_cast<T*>(p);
    }
    static void deallocate(T* p, std::size_t n) {
        ::operator delete(p, std::align_val_t(alignment(n)));
    }
    friend bool operator==(const LargePages&, const LargePages&) {
        return true;
    }
};

template <class T>
using LargeArray = std::vector<T, LargePages<T>>;

}  // namespace innerspring
