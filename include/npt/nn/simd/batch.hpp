/// The SIMD vocabulary of the kernels: the only folder that includes xsimd.
///
/// Batch<T> is the widest register of the translation unit's instruction set. Only what the kernels need is named here,
/// so that what xsimd's versions (8.1 to 14.3 were tried) call differently or get wrong (8.1 has no fused multiply-add
/// for AVX-512) is mended in one place. Without xsimd it is the compiler's own vector (portable_batch.hpp).
#pragma once

#include <npt/config.hpp>
#if NPT_HAS_XSIMD
#include <xsimd/xsimd.hpp>
#else
#include <npt/nn/simd/portable_batch.hpp>
#endif

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

// g++ 12 takes the deliberately undefined register in its own AVX-512 intrinsics for a mistake of whoever uses them
// (GCC bug 105593).
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif

namespace npt::inline NPT_ABI::simd {

#if !NPT_HAS_XSIMD
namespace library = portable;  ///< what the functions below are made of

template <class T>
using Batch = portable::Batch<T>;
#else
namespace library = ::xsimd;

#if defined(__aarch64__)
// Not the default, which may be SVE: its width is a flag's and no part of npt's tag.
template <class T>
using Batch = xsimd::batch<T, xsimd::neon64>;
#else
template <class T>
using Batch = xsimd::batch<T>;
#endif
#endif

namespace internal {
/// The sum of a register's lanes.
template <class B>
NPT_ALWAYS_INLINE typename B::value_type lane_sum(const B& x) {
#if NPT_HAS_XSIMD && XSIMD_VERSION_MAJOR < 9
  return library::hadd(x);
#else
  return library::reduce_add(x);
#endif
}

/// a > b ? a : b in each lane: b where either is NaN (on ARM64 NaN). Not xsimd's max on x86, which gives the instruction
/// its operands in another order from 8.1 to 14.3, nor on WebAssembly, where it keeps a.
template <class B>
NPT_ALWAYS_INLINE B max_or_second(const B& a, const B& b) {
#if !NPT_HAS_XSIMD || defined(__aarch64__)
  return library::max(a, b);
#else
  using T = typename B::value_type;
#if XSIMD_WITH_AVX512F
  if constexpr (sizeof(B) == 64) {
    if constexpr (std::is_same_v<T, float>)
      return B(_mm512_max_ps(a, b));
    else
      return B(_mm512_max_pd(a, b));
  }
#endif
#if XSIMD_WITH_AVX
  if constexpr (sizeof(B) == 32) {
    if constexpr (std::is_same_v<T, float>)
      return B(_mm256_max_ps(a, b));
    else
      return B(_mm256_max_pd(a, b));
  }
#endif
#if XSIMD_WITH_SSE2
  if constexpr (sizeof(B) == 16) {
    if constexpr (std::is_same_v<T, float>)
      return B(_mm_max_ps(a, b));
    else
      return B(_mm_max_pd(a, b));
  }
#endif
  return library::select(a > b, a, b);
#endif
}
}  // namespace internal

/// Lanes of a register.
template <class T>
inline constexpr int lanes = static_cast<int>(Batch<T>::size);

template <class T>
NPT_ALWAYS_INLINE Batch<T> load(const T* from) {
  return Batch<T>::load_aligned(from);
}
template <class T>
NPT_ALWAYS_INLINE void store(T* to, const Batch<T>& x) {
  x.store_aligned(to);
}
/// Loads from and stores to any address, aligned or not.
template <class T>
NPT_ALWAYS_INLINE Batch<T> load_unaligned(const T* from) {
  return Batch<T>::load_unaligned(from);
}
template <class T>
NPT_ALWAYS_INLINE void store_unaligned(T* to, const Batch<T>& x) {
  x.store_unaligned(to);
}
template <class T>
NPT_ALWAYS_INLINE Batch<T> broadcast(T x) {
  return Batch<T>(x);
}

/// Asks for a cache line that will be read soon. An address beyond any array is harmless.
NPT_ALWAYS_INLINE void prefetch_to_second_level([[maybe_unused]] std::uintptr_t address) {
#if defined(__GNUC__)
  // A pointer beyond an array may not even be computed, a number may.
  __builtin_prefetch(reinterpret_cast<const void*>(address), 0, 2);  // NOLINT(performance-no-int-to-ptr)
#endif
}

template <class T>
NPT_ALWAYS_INLINE void prefetch_to_first_level([[maybe_unused]] const T* address) {
#if defined(__GNUC__)
  __builtin_prefetch(address, 1, 3);
#endif
}

/// a * b + c, rounded once wherever the instruction set has it.
template <class T>
NPT_ALWAYS_INLINE Batch<T> fma(const Batch<T>& a, const Batch<T>& b, const Batch<T>& c) {
  // xsimd 8.1 has no AVX-512 overload: g++ contracts its a * b + c, clang 14 does not and runs at half of the peak.
#if NPT_HAS_XSIMD && defined(__AVX512F__)
  if constexpr (std::is_same_v<T, float> && lanes<T> == 16)
    return Batch<T>(_mm512_fmadd_ps(a, b, c));
  else if constexpr (std::is_same_v<T, double> && lanes<T> == 8)
    return Batch<T>(_mm512_fmadd_pd(a, b, c));
  else
    return library::fma(a, b, c);
#else
  return library::fma(a, b, c);
#endif
}

/// max(0, x) that keeps NaN.
template <class T>
NPT_ALWAYS_INLINE Batch<T> relu(const Batch<T>& x) {
  return internal::max_or_second(Batch<T>(T(0)), x);
}

/// dy where x > 0 and 0 elsewhere; dy where x is NaN.
template <class T>
NPT_ALWAYS_INLINE Batch<T> zero_where_not_positive(const Batch<T>& x, const Batch<T>& dy) {
  return library::select(x <= Batch<T>(T(0)), Batch<T>(T(0)), dy);
}

/// The larger of the running maximum m and x; NaN from either side stays.
template <class T>
NPT_ALWAYS_INLINE Batch<T> running_max(const Batch<T>& m, const Batch<T>& x) {
  // xsimd's m != m is false for NaN with AVX-512.
  return library::select(library::isnan(m), m, internal::max_or_second(m, x));
}

template <class T>
NPT_ALWAYS_INLINE Batch<T> tanh(const Batch<T>& x) {
  return library::tanh(x);
}
template <class T>
NPT_ALWAYS_INLINE Batch<T> exp(const Batch<T>& x) {
  return library::exp(x);
}

template <class T>
NPT_ALWAYS_INLINE Batch<T> sqrt(const Batch<T>& x) {
  return library::sqrt(x);
}

/// Sum over the lanes, in an order fixed by the instruction set.
template <class T>
NPT_ALWAYS_INLINE T reduce_add(const Batch<T>& x) {
#if NPT_HAS_XSIMD && defined(__AVX512F__)
  // The sum of the halves first, as xsimd does, but by an intrinsic without an undefined register: where g++ doesn't
  // inline xsimd's function, its warning (above) can't be switched off from here.
  using Half = xsimd::batch<T, xsimd::avx2>;
  if constexpr (std::is_same_v<T, float>) {
    const __m256d upper = _mm512_maskz_extractf64x4_pd(0xFF, _mm512_castps_pd(x), 1);
    return internal::lane_sum(Half(_mm256_add_ps(_mm512_castps512_ps256(x), _mm256_castpd_ps(upper))));
  } else {
    return internal::lane_sum(Half(_mm256_add_pd(_mm512_castpd512_pd256(x), _mm512_maskz_extractf64x4_pd(0xFF, x, 1))));
  }
#else
  return internal::lane_sum(x);
#endif
}

/// The sums of four registers' lanes: cheaper than four reduce_add, and in another order.
template <class T>
NPT_ALWAYS_INLINE std::array<T, 4> reduce_add(const std::array<Batch<T>, 4>& x) {
#if NPT_HAS_XSIMD && defined(__AVX512F__)
  if constexpr (std::is_same_v<T, float>) {
    const auto halves = [](__m512 r) {
      return _mm256_add_ps(_mm512_castps512_ps256(r),
                           _mm256_castpd_ps(_mm512_maskz_extractf64x4_pd(0xFF, _mm512_castps_pd(r), 1)));
    };
    const __m256 pairs =
        _mm256_hadd_ps(_mm256_hadd_ps(halves(x[0]), halves(x[1])), _mm256_hadd_ps(halves(x[2]), halves(x[3])));
    alignas(16) std::array<T, 4> sums;
    _mm_store_ps(sums.data(), _mm_add_ps(_mm256_castps256_ps128(pairs), _mm256_extractf128_ps(pairs, 1)));
    return sums;
  }
#endif
  // By their full names: xsimd has functions of this name, too.
  return {simd::reduce_add(x[0]), simd::reduce_add(x[1]), simd::reduce_add(x[2]), simd::reduce_add(x[3])};
}

/// x where lane + first < count, else `other`.
template <class T>
NPT_ALWAYS_INLINE Batch<T> keep_first(const Batch<T>& x, int first, int count, const Batch<T>& other) {
  alignas(64) static constexpr auto iota = [] {
    std::array<T, lanes<T>> values{};
    for (int i = 0; i < lanes<T>; ++i) values[static_cast<std::size_t>(i)] = static_cast<T>(i);
    return values;
  }();
  return library::select(load(iota.data()) < Batch<T>(static_cast<T>(count - first)), x, other);
}

/// Calls f(integral_constant 0), ..., f(integral_constant N - 1): the loop that compilers can't leave rolled, so that
/// accumulators indexed by it stay in registers (g++ 12 spills them in plain loops).
template <int N, class F>
NPT_ALWAYS_INLINE void unroll(F&& f) {
  [&]<int... I>(std::integer_sequence<int, I...>) NPT_LAMBDA_INLINE { (f(std::integral_constant<int, I>{}), ...); }
  (std::make_integer_sequence<int, N>{});
}

}  // namespace npt::inline NPT_ABI::simd

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif
