#pragma once
// Replaces operator new and delete to hold the code under test to its promise on memory. Include it in one
// source of a program.
#include <malloc.h>

#include <cstdio>
#include <cstdlib>
#include <new>

namespace allocation {

inline thread_local long long live = 0;   // bytes; below 0 where older memory was freed
inline thread_local long long limit = 0;  // 0: none

/// While it lives, more than 64 * size + 1 MiB live bytes end the program.
struct Limit {
    explicit Limit(std::size_t size) {
        live = 0;
        limit = 64 * static_cast<long long>(size) + (1 << 20);
    }
    ~Limit() { limit = 0; }
    Limit(const Limit&) = delete;
    Limit& operator=(const Limit&) = delete;
};

inline void* take(std::size_t size) {
    if (limit != 0 &&
        (size > static_cast<std::size_t>(limit) || live + static_cast<long long>(size) > limit)) {
        std::fprintf(stderr, "allocation of %zu bytes on top of %lld breaks the limit of %lld\n", size, live,
                     limit);
        std::abort();
    }
    void* memory = std::malloc(size == 0 ? 1 : size);
    if (memory == nullptr) std::abort();
    live += static_cast<long long>(malloc_usable_size(memory));
    return memory;
}

inline void give(void* memory) noexcept {
    if (memory != nullptr) live -= static_cast<long long>(malloc_usable_size(memory));
    std::free(memory);
}

}  // namespace allocation

void* operator new(std::size_t size) {
    return allocation::take(size);
}
void* operator new[](std::size_t size) {
    return allocation::take(size);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    return allocation::take(size);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
    return allocation::take(size);
}
void operator delete(void* memory) noexcept {
    allocation::give(memory);
}
void operator delete[](void* memory) noexcept {
    allocation::give(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
    allocation::give(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
    allocation::give(memory);
}
void operator delete(void* memory, const std::nothrow_t&) noexcept {
    allocation::give(memory);
}
void operator delete[](void* memory, const std::nothrow_t&) noexcept {
    allocation::give(memory);
}
