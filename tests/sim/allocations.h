#pragma once

// Counts the calls of operator new in this test program. Sanitizers bring their own operator new, so there
// nothing is counted.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define INNERSPRING_COUNTS_ALLOCATIONS 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define INNERSPRING_COUNTS_ALLOCATIONS 0
#endif
#endif
#ifndef INNERSPRING_COUNTS_ALLOCATIONS
#define INNERSPRING_COUNTS_ALLOCATIONS 1
#endif

namespace innerspring::support {

/// Calls of operator new so far.
long allocations();

}  // namespace innerspring::support
