/// The portable register against the one that this machine's other tests are compiled with.
#include <doctest/doctest.h>

#include <npt/nn/simd/batch.hpp>
#include <npt/nn/simd/portable_batch.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace {

namespace portable = npt::simd::portable;

template <class T>
constexpr std::size_t lanes = portable::Batch<T>::size;

template <class T>
std::array<T, lanes<T>> values_of(const portable::Batch<T>& x) {
  std::array<T, lanes<T>> out;
  x.store_unaligned(out.data());
  return out;
}

template <class T>
portable::Batch<T> ascending() {
  std::array<T, lanes<T>> in;
  for (std::size_t i = 0; i < in.size(); ++i) in[i] = static_cast<T>(i) - T(1);
  return portable::Batch<T>::load_unaligned(in.data());
}

}  // namespace

TEST_CASE_TEMPLATE("a portable register is as wide as xsimd's and computes the same", T, float, double) {
  CHECK(static_cast<int>(lanes<T>) == npt::simd::lanes<T>);
  const auto x = ascending<T>(), two = portable::Batch<T>(T(2));
  const auto sums = values_of<T>(portable::fma(x, two, x) - x / two + -x);
  const auto larger = values_of<T>(portable::max(x, two));
  const auto chosen = values_of<T>(portable::select(x <= two, two, x));
  for (std::size_t i = 0; i < lanes<T>; ++i) {
    const T value = static_cast<T>(i) - T(1);
    CHECK(sums[i] == value * 2 + value - value / 2 - value);
    CHECK(larger[i] == std::max(value, T(2)));
    CHECK(chosen[i] == (value <= 2 ? T(2) : value));
  }
  const T n = static_cast<T>(lanes<T>);
  CHECK(portable::reduce_add(x) == n * (n - 1) / 2 - n);
}

TEST_CASE_TEMPLATE("a portable register keeps NaN and the sign of zero", T, float, double) {
  const portable::Batch<T> nan(std::numeric_limits<T>::quiet_NaN()), zero(T(0)), negative_zero(-T(0));
  for (const T value : values_of<T>(portable::max(zero, nan))) CHECK(std::isnan(value));
  for (const T value : values_of<T>(portable::select(portable::isnan(nan), zero, nan))) CHECK(value == 0);
  for (const T value : values_of<T>(negative_zero)) CHECK(std::signbit(value));
  for (const T value : values_of<T>(portable::tanh(nan))) CHECK(std::isnan(value));
  for (const T value : values_of<T>(portable::sqrt(portable::Batch<T>(T(9))))) CHECK(value == 3);
  for (const T value : values_of<T>(portable::exp(zero))) CHECK(value == 1);
}
