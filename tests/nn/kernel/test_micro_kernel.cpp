#include <doctest/doctest.h>

#include <npt/base/aligned.hpp>
#include <npt/base/random.hpp>
#include <npt/nn/kernel/bf16_square_tile.hpp>
#include <npt/nn/kernel/micro_kernel.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "support/needs.hpp"

namespace kernel = npt::kernel;

TEST_CASE_TEMPLATE("the micro-kernel of every height equals a plain product", T, float, double) {
  constexpr int width = kernel::panel_width<T>;
  npt::Random random(1);
  for (int rows = 1; rows <= kernel::max_tile_rows; ++rows)
    for (const int k_count : {0, 1, 3, 67, 1027}) {
      const auto fill = [&](int n) {
        npt::AlignedBuffer<T> buffer(static_cast<std::size_t>(n) + 1);
        for (T& x : buffer.span()) x = static_cast<T>(random.uniform(-1, 1));
        return buffer;
      };
      const auto weights = fill(rows * k_count), operand = fill(width * k_count), bias = fill(rows);
      npt::AlignedBuffer<T> tile(static_cast<std::size_t>(rows * width));
      kernel::micro_kernel_of<T>(rows)(k_count, weights.data(), operand.data(), bias.data(), tile.data());
      double worst = 0;
      for (int r = 0; r < rows; ++r)
        for (int v = 0; v < width; ++v) {
          double expected = static_cast<double>(bias.data()[r]), size = std::abs(expected);
          for (int k = 0; k < k_count; ++k) {
            const double term =
                static_cast<double>(weights.data()[k * rows + r]) * static_cast<double>(operand.data()[k * width + v]);
            expected += term;
            size += std::abs(term);
          }
          worst = std::max(worst, std::abs(static_cast<double>(tile.data()[r * width + v]) - expected) / size);
        }
      CAPTURE(rows);
      CAPTURE(k_count);
      CHECK(worst < 30 * static_cast<double>(std::numeric_limits<T>::epsilon()));
    }
}

namespace {

struct Pair {
  double first, second;
};
Pair values_of(float pair) {
  const auto bits = std::bit_cast<std::uint32_t>(pair);
  return {static_cast<double>(std::bit_cast<float>(bits << 16)),
          static_cast<double>(std::bit_cast<float>(bits & 0xFFFF0000U))};
}

}  // namespace

TEST_CASE("the micro-kernel of bfloat16 pairs equals a plain product" *
          support::Needs(npt::simd::has_bf16, "bfloat16")) {
  constexpr int width = kernel::panel_width<float>;
  npt::Random random(2);
  for (int rows = 1; rows <= kernel::max_tile_rows; ++rows)
    for (const int k_count : {0, 1, 2, 5, 514}) {
      const auto fill = [&](int n, bool pairs) {
        npt::AlignedBuffer<float> buffer(static_cast<std::size_t>(n) + 1);
        for (float& x : buffer.span()) {
          const auto first = static_cast<float>(random.uniform(-1, 1)),
                     second = static_cast<float>(random.uniform(-1, 1));
          x = pairs ? npt::simd::bf16_pair(first, second) : first;
        }
        return buffer;
      };
      const auto weights = fill(rows * k_count, true), operand = fill(width * k_count, true), bias = fill(rows, false);
      npt::AlignedBuffer<float> tile(static_cast<std::size_t>(rows * width));
      kernel::micro_kernel_of<float, kernel::Product::bf16_pairs>(rows)(k_count, weights.data(), operand.data(),
                                                                        bias.data(), tile.data());
      double worst = 0;
      for (int r = 0; r < rows; ++r)
        for (int v = 0; v < width; ++v) {
          double expected = static_cast<double>(bias.data()[r]), size = std::abs(expected);
          for (int k = 0; k < k_count; ++k) {
            const Pair w = values_of(weights.data()[k * rows + r]), x = values_of(operand.data()[k * width + v]);
            expected += w.first * x.first + w.second * x.second;
            size += std::abs(w.first * x.first) + std::abs(w.second * x.second);
          }
          worst = std::max(worst, std::abs(static_cast<double>(tile.data()[r * width + v]) - expected) / size);
        }
      CAPTURE(rows);
      CAPTURE(k_count);
      CHECK(worst < 1e-5);  // units of bfloat16 round sums as they like
    }
}
