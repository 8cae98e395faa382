/// A count of every allocation of a test program, for tests that a warm call makes none. One unit of a program includes
/// it.
#pragma once

#include <atomic>
#include <cstddef>

// Every allocation of the program is counted: through malloc where the C library lets us stand in front of it, through
// operator new elsewhere (the sanitizers bring their own malloc).
namespace support {
inline std::atomic<long> allocations{0};
}  // namespace support

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define NPT_TEST_COUNTS_MALLOC 1
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void* malloc(std::size_t size) noexcept {
  support::allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  support::allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) noexcept {
  support::allocations.fetch_add(1, std::memory_order_relaxed);
  *out = __libc_memalign(alignment, size);
  return *out == nullptr ? 12 : 0;
}
}
#endif

namespace support {
#ifdef NPT_TEST_COUNTS_MALLOC
inline constexpr bool counts_malloc = true;
#else
inline constexpr bool counts_malloc = false;
#endif
}  // namespace support
