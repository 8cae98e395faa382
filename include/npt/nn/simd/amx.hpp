/// Matrix registers (AMX): eight registers of 16 rows of 64 bytes, and the product of two of them,
///   c[16][16] += a[16][32] * b[32][16],    a and b bfloat16, c fp32
/// with b's rows in pairs: b[16 pairs][16 columns][2]. On the Intel Xeon that this was written on, one core multiplies
/// 3300 GFLOP/s in them and 170 in AVX-512's fp32 registers.
#pragma once

#include <npt/config.hpp>

#include <cstdint>

#if NPT_HAS_AMX
#include <immintrin.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace npt::inline NPT_ABI::simd {

inline constexpr int matrix_rows = 16;   ///< of every matrix register
inline constexpr int matrix_words = 16;  ///< 32-bit words, and so bfloat16 pairs, in a row

#if NPT_HAS_AMX

/// Whether the system lets this process use matrix registers; asks it at the first call. Their state is large, so Linux
/// saves it only for processes that said so.
inline bool has_matrix_registers() noexcept {
  constexpr long request_permission = 0x1023, matrix_data = 18;  // ARCH_REQ_XCOMP_PERM, XFEATURE_XTILEDATA
  static const bool granted = syscall(SYS_arch_prctl, request_permission, matrix_data) == 0;
  return granted;
}

/// Matrix registers are in use by this thread from here to the end of the scope: all eight of full size.
class MatrixRegisters {
 public:
  MatrixRegisters() noexcept {
    struct alignas(64) Configuration {
      std::uint8_t palette = 1, start_row = 0;
      std::uint8_t reserved[14] = {};
      std::uint16_t row_bytes[16] = {64, 64, 64, 64, 64, 64, 64, 64};
      std::uint8_t rows[16] = {16, 16, 16, 16, 16, 16, 16, 16};
    };
    static constexpr Configuration configuration;
    _tile_loadconfig(&configuration);
  }
  ~MatrixRegisters() { _tile_release(); }
  MatrixRegisters(const MatrixRegisters&) = delete;
  MatrixRegisters& operator=(const MatrixRegisters&) = delete;
};

#else

inline bool has_matrix_registers() noexcept { return false; }

class MatrixRegisters {};

#endif

}  // namespace npt::inline NPT_ABI::simd
