/// bfloat16 pairs, where the instruction set multiplies them (AVX512_BF16, ARM's BF16): each 32-bit lane holds two
/// values, of which one instruction multiplies and adds both to a float.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/simd/batch.hpp>

#include <bit>
#include <cstdint>

#if NPT_HAS_XSIMD && defined(__aarch64__) && defined(__ARM_FEATURE_BF16_VECTOR_ARITHMETIC)
#include <arm_neon.h>
#endif

// As in batch.hpp: g++ 12 mistakes undefined registers in its own intrinsics (GCC bug 105593).
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif

namespace npt::inline NPT_ABI::simd {

/// Whether this translation unit was compiled for bfloat16 products.
#if NPT_HAS_XSIMD && ((defined(__AVX512BF16__) && defined(__AVX512F__) && defined(__AVX512BW__)) || \
                      (defined(__aarch64__) && defined(__ARM_FEATURE_BF16_VECTOR_ARITHMETIC)))
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

#if NPT_HAS_XSIMD && defined(__AVX512BF16__) && defined(__AVX512F__) && defined(__AVX512BW__)

/// Lane by lane, (first, second) as a pair.
NPT_ALWAYS_INLINE Batch<float> bf16_pairs(const Batch<float>& first, const Batch<float>& second) {
  // The conversion puts the 16 second values above the 16 first ones; the permutation interleaves them.
  const auto halves = reinterpret_cast<__m512i>(_mm512_cvtne2ps_pbh(second, first));
  const __m512i interleave = _mm512_set_epi16(31, 15, 30, 14, 29, 13, 28, 12, 27, 11, 26, 10, 25, 9, 24, 8, 23, 7, 22,
                                              6, 21, 5, 20, 4, 19, 3, 18, 2, 17, 1, 16, 0);
  return Batch<float>(_mm512_castsi512_ps(_mm512_permutexvar_epi16(interleave, halves)));
}

NPT_ALWAYS_INLINE __m512i bits(const Batch<float>& x) { return _mm512_castps_si512(static_cast<__m512>(x)); }

/// Pairs of values that are cut off behind bfloat16's eight bits, where bf16_pairs rounds: half of the instructions.
NPT_ALWAYS_INLINE Batch<float> bf16_cut_pairs(const Batch<float>& first, const Batch<float>& second) {
  constexpr int choose = 0xD8;  // bit by bit: second where the mask has ones, else first
  const __m512i upper = _mm512_set1_epi32(static_cast<int>(0xFFFF0000U));
  return Batch<float>(
      _mm512_castsi512_ps(_mm512_ternarylogic_epi32(_mm512_srli_epi32(bits(first), 16), bits(second), upper, choose)));
}
/// A value without the eight bits that bfloat16 keeps of it: exact.
NPT_ALWAYS_INLINE Batch<float> below_bf16(const Batch<float>& x) {
  const __m512i upper = _mm512_and_si512(bits(x), _mm512_set1_epi32(static_cast<int>(0xFFFF0000U)));
  return x - Batch<float>(_mm512_castsi512_ps(upper));
}

/// The first values of pairs, and the second ones, as floats.
NPT_ALWAYS_INLINE Batch<float> first_of_pairs(const Batch<float>& pairs) {
  return Batch<float>(_mm512_castsi512_ps(_mm512_slli_epi32(bits(pairs), 16)));
}
NPT_ALWAYS_INLINE Batch<float> second_of_pairs(const Batch<float>& pairs) {
  return Batch<float>(
      _mm512_castsi512_ps(_mm512_and_si512(bits(pairs), _mm512_set1_epi32(static_cast<int>(0xFFFF0000U)))));
}

/// Two registers' values one behind the other: lane i holds values 2 i and 2 i + 1 of the sequence.
NPT_ALWAYS_INLINE Batch<float> bf16_sequence(const Batch<float>& front, const Batch<float>& back) {
  return Batch<float>(_mm512_castsi512_ps(reinterpret_cast<__m512i>(_mm512_cvtne2ps_pbh(back, front))));
}
/// The two halves of a sequence as floats.
NPT_ALWAYS_INLINE Batch<float> front_of_sequence(const Batch<float>& sequence) {
  const __m256i half = _mm512_castsi512_si256(bits(sequence));
  return Batch<float>(_mm512_castsi512_ps(_mm512_slli_epi32(_mm512_cvtepu16_epi32(half), 16)));
}
NPT_ALWAYS_INLINE Batch<float> back_of_sequence(const Batch<float>& sequence) {
  const __m256i half = _mm512_extracti64x4_epi64(bits(sequence), 1);
  return Batch<float>(_mm512_castsi512_ps(_mm512_slli_epi32(_mm512_cvtepu16_epi32(half), 16)));
}

/// Pairs or sequences to memory that holds two values a word.
NPT_ALWAYS_INLINE void store_words(std::uint32_t* to, const Batch<float>& pairs) {
  _mm512_store_si512(to, bits(pairs));
}

/// sum + a.first * b.first + a.second * b.second, lane by lane.
NPT_ALWAYS_INLINE Batch<float> dot_bf16(const Batch<float>& a, const Batch<float>& b, const Batch<float>& sum) {
  const __m512 x = a, y = b;
  return Batch<float>(_mm512_dpbf16_ps(sum, reinterpret_cast<__m512bh>(x), reinterpret_cast<__m512bh>(y)));
}

#else

#if NPT_HAS_XSIMD && defined(__aarch64__) && defined(__ARM_FEATURE_BF16_VECTOR_ARITHMETIC)
NPT_ALWAYS_INLINE Batch<float> bf16_pairs(const Batch<float>& first, const Batch<float>& second) {
  const bfloat16x8_t halves = vcvtq_high_bf16_f32(vcvtq_low_bf16_f32(first), second);
  const uint16x8_t words = vreinterpretq_u16_bf16(halves);
  return Batch<float>(vreinterpretq_f32_u16(vzip1q_u16(words, vextq_u16(words, words, 4))));
}
/// BFDOT: rounds otherwise than x86 does, and than two multiply-adds would.
NPT_ALWAYS_INLINE Batch<float> dot_bf16(const Batch<float>& a, const Batch<float>& b, const Batch<float>& sum) {
  return Batch<float>(vbfdotq_f32(sum, vreinterpretq_bf16_f32(a), vreinterpretq_bf16_f32(b)));
}
#else
// Never called: the engine refuses the precision. They keep code that names both precisions compiling.
NPT_ALWAYS_INLINE Batch<float> bf16_pairs(const Batch<float>& first, const Batch<float>&) { return first; }
NPT_ALWAYS_INLINE Batch<float> dot_bf16(const Batch<float>&, const Batch<float>&, const Batch<float>& sum) {
  return sum;
}
#endif

// Of matrix registers alone, and never called without.
NPT_ALWAYS_INLINE Batch<float> bf16_cut_pairs(const Batch<float>& first, const Batch<float>&) { return first; }
NPT_ALWAYS_INLINE Batch<float> below_bf16(const Batch<float>& x) { return x; }
NPT_ALWAYS_INLINE Batch<float> first_of_pairs(const Batch<float>& pairs) { return pairs; }
NPT_ALWAYS_INLINE Batch<float> second_of_pairs(const Batch<float>& pairs) { return pairs; }
NPT_ALWAYS_INLINE Batch<float> bf16_sequence(const Batch<float>& front, const Batch<float>&) { return front; }
NPT_ALWAYS_INLINE Batch<float> front_of_sequence(const Batch<float>& sequence) { return sequence; }
NPT_ALWAYS_INLINE Batch<float> back_of_sequence(const Batch<float>& sequence) { return sequence; }
NPT_ALWAYS_INLINE void store_words(std::uint32_t*, const Batch<float>&) {}

#endif

}  // namespace npt::inline NPT_ABI::simd

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif
