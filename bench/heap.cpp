#include "heap.h"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::size_t> now{0}, peak{0};

void* counted(void* p) {
    if (!p) throw std::bad_alloc();
    const std::size_t n = now += malloc_usable_size(p);
    std::size_t most = peak;
    while (n > most && !peak.compare_exchange_weak(most, n)) {
    }
    return p;
}

void release(void* p) {
    now -= malloc_usable_size(p);
    std::free(p);
}

}  // namespace

std::size_t heap_now() {
    return now;
}
std::size_t heap_peak() {
    return peak;
}
void reset_heap_peak() {
    peak = now.load();
}

void* operator new(std::size_t size) {
    return counted(std::malloc(size));
}
void* operator new(std::size_t size, std::align_val_t align) {
    const std::size_t a = std::size_t(align);
    return counted(std::aligned_alloc(a, (size + a - 1) / a * a));
}
void operator delete(void* p) noexcept {
    release(p);
}
void operator delete(void* p, std::size_t) noexcept {
    release(p);
}
void operator delete(void* p, std::align_val_t) noexcept {
    release(p);
}
void operator delete(void* p, std::size_t, std::align_val_t) noexcept {
    release(p);
}
