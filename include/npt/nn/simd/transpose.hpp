/// Transposes a square block of a register's lanes: rows that run over vertices become rows that run over channels.
/// What a product that sums over the vertices needs of both its operands.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/simd/batch.hpp>

#include <array>
#include <cstddef>
#include <cstring>
#include <utility>

namespace npt::inline NPT_ABI::simd {

namespace internal {

#if defined(__GNUC__)
/// The compilers' own vector, which their shuffles work on.
template <class T>
struct VectorOf {
  using type [[gnu::vector_size(sizeof(T) * static_cast<std::size_t>(lanes<T>))]] = T;
};
template <class T>
using Vector = typename VectorOf<T>::type;

/// a and b with the lanes exchanged in which they differ in bit `Distance` of the lane's number.
template <class T, int Distance, int... I>
NPT_ALWAYS_INLINE void exchange(Vector<T>& a, Vector<T>& b, std::integer_sequence<int, I...>) {
  constexpr int n = lanes<T>;
  const Vector<T> low = __builtin_shufflevector(a, b, ((I & Distance) == 0 ? I : n + I - Distance)...);
  b = __builtin_shufflevector(a, b, ((I & Distance) == 0 ? I + Distance : n + I)...);
  a = low;
}

template <class T, int Distance>
NPT_ALWAYS_INLINE void exchange_rows(std::array<Vector<T>, static_cast<std::size_t>(lanes<T>)>& rows) {
  if constexpr (Distance < lanes<T>) {
    unroll<lanes<T>>([&](auto r) NPT_LAMBDA_INLINE {
      if constexpr ((r & Distance) == 0)
        exchange<T, Distance>(rows[static_cast<std::size_t>(r)], rows[std::size_t{r} + std::size_t{Distance}],
                              std::make_integer_sequence<int, lanes<T>>{});
    });
    exchange_rows<T, 2 * Distance>(rows);
  }
}

#endif

}  // namespace internal

/// to[i][j] = from[j][i] for i, j < lanes<T>. Rows are `from_stride` and `to_stride` elements apart and may lie
/// anywhere; they are written in ascending order, so that a shorter `to_stride` leaves each row's first elements.
template <class T>
NPT_ALWAYS_INLINE void transpose(const T* from, std::size_t from_stride, T* to, std::size_t to_stride) {
#if defined(__GNUC__)
  std::array<internal::Vector<T>, static_cast<std::size_t>(lanes<T>)> rows;
  unroll<lanes<T>>([&](auto r) NPT_LAMBDA_INLINE {
    std::memcpy(&rows[static_cast<std::size_t>(r)], from + static_cast<std::size_t>(r) * from_stride,
                sizeof(internal::Vector<T>));
  });
  internal::exchange_rows<T, 1>(rows);
  unroll<lanes<T>>([&](auto r) NPT_LAMBDA_INLINE {
    std::memcpy(to + static_cast<std::size_t>(r) * to_stride, &rows[static_cast<std::size_t>(r)],
                sizeof(internal::Vector<T>));
  });
#else
  constexpr std::size_t n = std::size_t{lanes<T>};
  T rows[n][n];
  for (std::size_t r = 0; r < n; ++r) std::memcpy(rows[r], from + r * from_stride, sizeof rows[r]);
  for (std::size_t r = 0; r < n; ++r)
    for (std::size_t i = 0; i < n; ++i) to[r * to_stride + i] = rows[i][r];
#endif
}

}  // namespace npt::inline NPT_ABI::simd
