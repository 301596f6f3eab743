#pragma once
#include <cstddef>

/// Bytes that `new` has handed out and not got back, and the most there were since reset_heap_peak().
std::size_t heap_now();
std::size_t heap_peak();
void reset_heap_peak();
