#include <doctest/doctest.h>

#include <npt/base/aligned.hpp>
#include <npt/base/random.hpp>
#include <npt/nn/kernel/amx_product.hpp>
#include <npt/nn/kernel/product.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

#include "support/needs.hpp"
#include "support/needs_bf16.hpp"

namespace kernel = npt::kernel;

namespace {

constexpr int width = kernel::panel_width<float>;

std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// Largest error of a product of random matrices, each relative to the sum of its terms' sizes.
double product_error(int rows, int columns, int parts, bool biased = true, int valid = width) {
  npt::Random random(3);
  const auto fill = [&](std::size_t n) {
    npt::AlignedBuffer<float> buffer(n);
    for (float& x : buffer.span()) x = static_cast<float>(random.uniform(-1, 1));
    return buffer;
  };
  const auto weights = fill(index(rows) * index(columns)), operand = fill(index(columns) * width),
             drawn = fill(index(rows));
  const auto bias = [&](int r) { return biased ? drawn[index(r)] : 0.0F; };
  const kernel::AmxWeights packed(
      rows, columns, parts, [&](int r, int c) { return weights[index(r) * index(columns) + index(c)]; }, bias);
  npt::AlignedBuffer<kernel::Word> words(packed.operand_words(1));
  for (kernel::Word& w : words.span()) w = 0x7FC07FC0;  // NaN where nothing is written
  const kernel::AmxOperand panel = kernel::split_panel(packed, operand.data(), valid, words.data());
  npt::AlignedBuffer<float> tile(kernel::amx_block_rows * width);
  [[maybe_unused]] const kernel::ProductScope scope({.parts = parts});
  double worst = 0;
  for (int b = 0; b < packed.block_count(); ++b) {
    packed.multiply(b, panel, kernel::AmxWeights::bias_at(packed.bias(), packed.first_row(b)), tile.data());
    for (int r = 0; r < packed.rows(b); ++r)
      for (int v = 0; v < valid; ++v) {
        const std::size_t row = index(packed.first_row(b) + r);
        double expected = static_cast<double>(bias(static_cast<int>(row))), size = std::abs(expected);
        for (int k = 0; k < columns; ++k) {
          const double term = static_cast<double>(weights[row * index(columns) + index(k)]) *
                              static_cast<double>(operand[index(k * width + v)]);
          expected += term;
          size += std::abs(term);
        }
        const double error = std::abs(static_cast<double>(tile[index(r * width + v)]) - expected) / size;
        if (!(error <= worst)) worst = error;  // NaN counts
      }
  }
  return worst;
}

}  // namespace

TEST_CASE("products of bfloat16 are as exact as their values" * support::needs_bf16_words()) {
  for (const int rows : {1, 15, 16, 17, 32, 33, 131})
    for (const int columns : {1, 2, 31, 32, 33, 131}) {
      CAPTURE(rows);
      CAPTURE(columns);
      CHECK(product_error(rows, columns, 1) < 0x1p-7);
    }
  CHECK(product_error(49, 65, 1, false, 16) < 0x1p-7);
}

TEST_CASE("products on matrix registers are as exact as their parts" * support::needs_matrix_registers()) {
  for (const int rows : {1, 15, 16, 17, 32, 33, 131})
    for (const int columns : {1, 2, 31, 32, 33, 131}) {
      CAPTURE(rows);
      CAPTURE(columns);
      CHECK(product_error(rows, columns, 2) < 0x1p-14);
      CHECK(product_error(rows, columns, 3) < 3e-7);
    }
  CHECK(product_error(64, 1027, 3) < 3e-7);
  CHECK(product_error(49, 64, 3, false) < 3e-7);
  CHECK(product_error(49, 65, 3, true, 16) < 3e-7);
  CHECK(product_error(64, 64, 2, false, 1) < 0x1p-14);
}

TEST_CASE("products in parts keep NaN and infinity where they are" * support::needs_bf16_words()) {
  constexpr int channels = 5;
  for (int parts = 1; parts <= kernel::max_parts && kernel::has_word_products(parts); ++parts) {
    const kernel::AmxWeights packed(
        16, channels, parts, [](int, int) { return 0.5F; }, [](int) { return 1.0F; });
    npt::AlignedBuffer<float> operand(index(channels * width));
    for (float& x : operand.span()) x = 1;
    operand[index(2 * width + 7)] = std::nanf("");
    operand[index(4 * width + 9)] = -INFINITY;
    npt::AlignedBuffer<kernel::Word> words(packed.operand_words(1));
    const kernel::AmxOperand panel = kernel::split_panel(packed, operand.data(), width, words.data());
    npt::AlignedBuffer<float> tile(16 * width);
    {
      [[maybe_unused]] const kernel::ProductScope scope({.parts = parts});
      packed.multiply(0, panel, packed.bias(), tile.data());
    }
    for (int v = 0; v < width; ++v) {
      const float x = tile[index(3 * width + v)];
      if (v == 7)
        CHECK(std::isnan(x));
      else if (v == 9)
        CHECK(!std::isfinite(x));
      else
        CHECK(x == 3.5F);
    }
  }
}
