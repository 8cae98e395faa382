/// A register on the compiler's vector extensions (g++ and clang), for what xsimd doesn't know: WebAssembly, RISC-V,
/// POWER with Debian 12's version. Holds what batch.hpp asks of xsimd, by the same names.
#pragma once

#include <npt/config.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>

#if !defined(__GNUC__)
#error "npt: this compiler has no vector extensions, and there is no xsimd for this architecture"
#endif

namespace npt::inline NPT_ABI::simd::portable {

/// Of the widest register that the compiler was told of; else 16, which every vector unit of today has and compilers
/// split where there is none.
#if defined(__AVX512F__)
inline constexpr std::size_t register_bytes = 64;
#elif defined(__AVX__)
inline constexpr std::size_t register_bytes = 32;
#else
inline constexpr std::size_t register_bytes = 16;
#endif

template <class T>
struct VectorOf {
  using type [[gnu::vector_size(register_bytes)]] = T;
};

template <class T>
class Batch {
 public:
  using value_type = T;
  using Vector = typename VectorOf<T>::type;
  using Mask = decltype(Vector{} < Vector{});
  static constexpr std::size_t size = register_bytes / sizeof(T);

  Batch() = default;
  explicit NPT_ALWAYS_INLINE Batch(T x) : lanes(x - Vector{}) {}  // x - 0 is x, also for -0
  NPT_ALWAYS_INLINE Batch(Vector x) : lanes(x) {}

  static NPT_ALWAYS_INLINE Batch load_unaligned(const T* from) {
    Batch x;
    std::memcpy(&x.lanes, from, sizeof x.lanes);
    return x;
  }
  static NPT_ALWAYS_INLINE Batch load_aligned(const T* from) {
    return load_unaligned(static_cast<const T*>(__builtin_assume_aligned(from, register_bytes)));
  }
  NPT_ALWAYS_INLINE void store_unaligned(T* to) const { std::memcpy(to, &lanes, sizeof lanes); }
  NPT_ALWAYS_INLINE void store_aligned(T* to) const {
    store_unaligned(static_cast<T*>(__builtin_assume_aligned(to, register_bytes)));
  }

  friend NPT_ALWAYS_INLINE Batch operator+(const Batch& a, const Batch& b) { return a.lanes + b.lanes; }
  friend NPT_ALWAYS_INLINE Batch operator-(const Batch& a, const Batch& b) { return a.lanes - b.lanes; }
  friend NPT_ALWAYS_INLINE Batch operator*(const Batch& a, const Batch& b) { return a.lanes * b.lanes; }
  friend NPT_ALWAYS_INLINE Batch operator/(const Batch& a, const Batch& b) { return a.lanes / b.lanes; }
  NPT_ALWAYS_INLINE Batch operator-() const { return -lanes; }
  NPT_ALWAYS_INLINE Batch& operator+=(const Batch& b) { return *this = *this + b; }
  NPT_ALWAYS_INLINE Batch& operator-=(const Batch& b) { return *this = *this - b; }
  NPT_ALWAYS_INLINE Batch& operator*=(const Batch& b) { return *this = *this * b; }
  NPT_ALWAYS_INLINE Batch& operator/=(const Batch& b) { return *this = *this / b; }
  friend NPT_ALWAYS_INLINE Mask operator<(const Batch& a, const Batch& b) { return a.lanes < b.lanes; }
  friend NPT_ALWAYS_INLINE Mask operator<=(const Batch& a, const Batch& b) { return a.lanes <= b.lanes; }
  friend NPT_ALWAYS_INLINE Mask operator>(const Batch& a, const Batch& b) { return a.lanes > b.lanes; }
  friend NPT_ALWAYS_INLINE Mask operator>=(const Batch& a, const Batch& b) { return a.lanes >= b.lanes; }

  Vector lanes;
};

/// Contracted to one instruction where there is one: -ffp-contract=off takes that away.
template <class T>
NPT_ALWAYS_INLINE Batch<T> fma(const Batch<T>& a, const Batch<T>& b, const Batch<T>& c) {
  return a.lanes * b.lanes + c.lanes;
}

/// b where either is NaN, as x86 does it.
template <class T>
NPT_ALWAYS_INLINE Batch<T> max(const Batch<T>& a, const Batch<T>& b) {
  return a.lanes > b.lanes ? a.lanes : b.lanes;
}
template <class T>
NPT_ALWAYS_INLINE typename Batch<T>::Mask isnan(const Batch<T>& x) {
  return x.lanes != x.lanes;
}
template <class T>
NPT_ALWAYS_INLINE Batch<T> select(const typename Batch<T>::Mask& mask, const Batch<T>& a, const Batch<T>& b) {
  return mask ? a.lanes : b.lanes;
}

namespace internal {
template <class T, class F>
NPT_ALWAYS_INLINE Batch<T> lane_by_lane(const Batch<T>& x, F f) {
  std::array<T, Batch<T>::size> values;
  x.store_unaligned(values.data());
  for (T& value : values) value = f(value);
  return Batch<T>::load_unaligned(values.data());
}
}  // namespace internal

// By the C library, value by value: a network asks for them in its last layer only.
template <class T>
NPT_ALWAYS_INLINE Batch<T> tanh(const Batch<T>& x) {
  return internal::lane_by_lane(x, [](T value) { return std::tanh(value); });
}
template <class T>
NPT_ALWAYS_INLINE Batch<T> exp(const Batch<T>& x) {
  return internal::lane_by_lane(x, [](T value) { return std::exp(value); });
}
template <class T>
NPT_ALWAYS_INLINE Batch<T> sqrt(const Batch<T>& x) {
  return internal::lane_by_lane(x, [](T value) { return std::sqrt(value); });
}

/// The lanes' sum: halves upon each other.
template <class T>
NPT_ALWAYS_INLINE T reduce_add(const Batch<T>& x) {
  std::array<T, Batch<T>::size> sums;
  x.store_unaligned(sums.data());
  for (std::size_t half = sums.size() / 2; half > 0; half /= 2)
    for (std::size_t i = 0; i < half; ++i) sums[i] += sums[i + half];
  return sums[0];
}

}  // namespace npt::inline NPT_ABI::simd::portable
