#include <doctest/doctest.h>

#include <npt/nn/simd/batch.hpp>

#include <array>
#include <cmath>
#include <limits>

namespace simd = npt::simd;

template <class T>
std::array<T, simd::lanes<T>> values(const simd::Batch<T>& x) {
  std::array<T, simd::lanes<T>> out;
  x.store_unaligned(out.data());
  return out;
}

TEST_CASE_TEMPLATE("fma rounds once where the instruction set has it", T, float, double) {
  // (1 + e)(1 - e) - 1 = -e^2 exactly; a rounded product gives 0.
  volatile T e = std::is_same_v<T, float> ? T(0x1p-13) : T(0x1p-30);
  const auto x = simd::fma(simd::broadcast<T>(T(1) + e), simd::broadcast<T>(T(1) - e), simd::broadcast<T>(T(-1)));
#if defined(__FMA__) || defined(__AVX512F__) || defined(__aarch64__)
  for (const T lane : values<T>(x)) CHECK(lane == -e * e);
#else
  for (const T lane : values<T>(x)) CHECK(std::abs(lane) <= e * e);
#endif
}

TEST_CASE_TEMPLATE("relu and the running maximum keep NaN", T, float, double) {
  const T nan = std::numeric_limits<T>::quiet_NaN();
  for (const T lane : values<T>(simd::relu(simd::broadcast(nan)))) CHECK(std::isnan(lane));
  for (const T lane : values<T>(simd::relu(simd::broadcast(T(-2))))) CHECK(lane == T(0));
  for (const T lane : values<T>(simd::relu(simd::broadcast(T(2))))) CHECK(lane == T(2));
  const auto one = simd::broadcast(T(1)), two = simd::broadcast(T(2)), none = simd::broadcast(nan);
  for (const T lane : values<T>(simd::running_max(one, two))) CHECK(lane == T(2));
  for (const T lane : values<T>(simd::running_max(two, one))) CHECK(lane == T(2));
  for (const T lane : values<T>(simd::running_max(none, one))) CHECK(std::isnan(lane));
  for (const T lane : values<T>(simd::running_max(one, none))) CHECK(std::isnan(lane));
}

TEST_CASE_TEMPLATE("keep_first keeps the lanes below the count, even beside NaN", T, float, double) {
  const T nan = std::numeric_limits<T>::quiet_NaN();
  for (int count = 0; count <= simd::lanes<T>; ++count) {
    const auto kept = values<T>(simd::keep_first(simd::broadcast(nan), 100, 100 + count, simd::broadcast(T(3))));
    for (int i = 0; i < simd::lanes<T>; ++i) CHECK(std::isnan(kept[static_cast<std::size_t>(i)]) == (i < count));
  }
}

TEST_CASE_TEMPLATE("reduce_add sums all lanes", T, float, double) {
  alignas(64) std::array<T, simd::lanes<T>> in;
  for (int i = 0; i < simd::lanes<T>; ++i) in[static_cast<std::size_t>(i)] = static_cast<T>(i + 1);
  CHECK(simd::reduce_add(simd::load(in.data())) == static_cast<T>(simd::lanes<T> * (simd::lanes<T> + 1) / 2));
}

TEST_CASE_TEMPLATE("tanh and exp agree with the C library", T, float, double) {
  const double bound = 8 * static_cast<double>(std::numeric_limits<T>::epsilon());
  for (double x = -12; x < 12; x += 0.37) {
    const double argument = static_cast<double>(static_cast<T>(x));
    const double t = static_cast<double>(values<T>(simd::tanh(simd::broadcast(static_cast<T>(x))))[0]);
    CHECK(std::abs(t - std::tanh(argument)) <= bound * std::abs(std::tanh(argument)));
    const double e = static_cast<double>(values<T>(simd::exp(simd::broadcast(static_cast<T>(x))))[0]);
    CHECK(std::abs(e - std::exp(argument)) <= bound * std::exp(argument));
  }
}

TEST_CASE("unroll visits every index once and in order") {
  int next = 0;
  simd::unroll<5>([&](auto i) { CHECK(i == next++); });
  CHECK(next == 5);
}
