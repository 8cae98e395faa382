/// Matrix registers (AMX) in plain loops: included in front of a whole unit (-include), it lets a machine without them
/// run the code that is written for them. Needs AVX512_BF16, as that code does. Sums in fp32, in another order than the
/// hardware's.
#pragma once

#if !defined(__AMX_TILE__) && !defined(__AMXTILE__)

#include <immintrin.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace emulated_amx {

/// 16 rows of 64 bytes: all that npt configures.
struct Register {
  std::uint32_t words[16][16];
};
inline thread_local Register registers[8];

inline void load(int r, const void* from, std::size_t stride) {
  for (std::size_t row = 0; row < 16; ++row)
    std::memcpy(registers[r].words[row], static_cast<const char*>(from) + row * stride, 64);
}
inline void store(int r, void* to, std::size_t stride) {
  for (std::size_t row = 0; row < 16; ++row)
    std::memcpy(static_cast<char*>(to) + row * stride, registers[r].words[row], 64);
}
inline void configure(const void*) {}
inline void clear(int r) { std::memset(&registers[r], 0, sizeof registers[r]); }

inline float first(std::uint32_t pair) { return std::bit_cast<float>(pair << 16); }
inline float second(std::uint32_t pair) { return std::bit_cast<float>(pair & 0xFFFF0000U); }
inline void multiply(int c, int a, int b) {
  for (int m = 0; m < 16; ++m)
    for (int n = 0; n < 16; ++n) {
      float sum = std::bit_cast<float>(registers[c].words[m][n]);
      for (int k = 0; k < 16; ++k) {
        const std::uint32_t x = registers[a].words[m][k], y = registers[b].words[k][n];
        sum += first(x) * first(y) + second(x) * second(y);
      }
      registers[c].words[m][n] = std::bit_cast<std::uint32_t>(sum);
    }
}

}  // namespace emulated_amx

#define __AMX_TILE__ 1
#define __AMX_BF16__ 1
#undef _tile_loadd
#undef _tile_stored
#undef _tile_zero
#undef _tile_dpbf16ps
#undef _tile_loadconfig
#undef _tile_release
#define _tile_loadd(r, from, stride) emulated_amx::load(r, from, static_cast<std::size_t>(stride))
#define _tile_stored(r, to, stride) emulated_amx::store(r, to, static_cast<std::size_t>(stride))
#define _tile_zero(r) emulated_amx::clear(r)
#define _tile_dpbf16ps(c, a, b) emulated_amx::multiply(c, a, b)
#define _tile_loadconfig(configuration) emulated_amx::configure(configuration)
#define _tile_release() emulated_amx::configure(nullptr)
// The call that asks for matrix registers becomes one that is always granted.
#undef SYS_arch_prctl
#define SYS_arch_prctl SYS_sched_yield

#endif
