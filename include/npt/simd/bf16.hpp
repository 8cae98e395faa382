/// bfloat16 pairs, where the instruction set multiplies them (AVX512_BF16): each 32-bit lane holds two values, of which
/// one instruction multiplies and adds both to a float.
#pragma once

#include <npt/config.hpp>
#include <npt/simd/batch.hpp>

#include <bit>
#include <cstdint>

namespace npt::inline NPT_ABI::simd {

/// Whether this translation unit was compiled for bfloat16 products.
#if defined(__AVX512BF16__) && defined(__AVX512F__) && defined(__AVX512BW__)
inline constexpr bool has_bf16 = true;
#else
inline constexpr bool has_bf16 = false;
#endif

/// Round to nearest even; NaN stays NaN.
inline std::uint16_t to_bf16(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  if (x != x) return static_cast<std::uint16_t>((bits >> 16) | 0x40U);
  return static_cast<std::uint16_t>((bits + 0x7FFFU + ((bits >> 16) & 1U)) >> 16);
}

/// Two values in one 32-bit lane, the first in its lower half, in the guise of a float that is never computed with.
inline float bf16_pair(float first, float second) {
  return std::bit_cast<float>(std::uint32_t{to_bf16(first)} | std::uint32_t{to_bf16(second)} << 16);
}

#if defined(__AVX512BF16__) && defined(__AVX512F__) && defined(__AVX512BW__)

/// Lane by lane, (first, second) as a pair.
NPT_ALWAYS_INLINE Batch<float> bf16_pairs(const Batch<float>& first, const Batch<float>& second) {
  // The conversion puts the 16 second values above the 16 first ones; the permutation interleaves them.
  const auto halves = reinterpret_cast<__m512i>(_mm512_cvtne2ps_pbh(second, first));
  const __m512i interleave = _mm512_set_epi16(31, 15, 30, 14, 29, 13, 28, 12, 27, 11, 26, 10, 25, 9, 24, 8, 23, 7, 22,
                                              6, 21, 5, 20, 4, 19, 3, 18, 2, 17, 1, 16, 0);
  return Batch<float>(_mm512_castsi512_ps(_mm512_permutexvar_epi16(interleave, halves)));
}

/// sum + a.first * b.first + a.second * b.second, lane by lane.
NPT_ALWAYS_INLINE Batch<float> dot_bf16(const Batch<float>& a, const Batch<float>& b, const Batch<float>& sum) {
  const __m512 x = a, y = b;
  return Batch<float>(_mm512_dpbf16_ps(sum, reinterpret_cast<__m512bh>(x), reinterpret_cast<__m512bh>(y)));
}

#else

// Never called: the engine refuses the precision. They keep code that names both precisions compiling.
NPT_ALWAYS_INLINE Batch<float> bf16_pairs(const Batch<float>& first, const Batch<float>&) { return first; }
NPT_ALWAYS_INLINE Batch<float> dot_bf16(const Batch<float>&, const Batch<float>&, const Batch<float>& sum) {
  return sum;
}

#endif

}  // namespace npt::inline NPT_ABI::simd
