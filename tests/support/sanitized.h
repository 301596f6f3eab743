#pragma once

/// 1 when this program runs under a sanitizer, which brings its own operator new and is ten and more times
/// slower.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define INNERSPRING_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define INNERSPRING_SANITIZED 1
#endif
#endif
#ifndef INNERSPRING_SANITIZED
#define INNERSPRING_SANITIZED 0
#endif
