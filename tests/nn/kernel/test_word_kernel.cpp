#include <doctest/doctest.h>

#include <npt/base/aligned.hpp>
#include <npt/base/random.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/kernel/word_kernel.hpp>

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "support/needs.hpp"

namespace {

namespace kernel = npt::kernel;
constexpr int words = npt::simd::matrix_words, rows = npt::simd::matrix_rows, width = 2 * words;

constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }
/// A word's values; bfloat16 is the upper half of a float.
double first_of(kernel::Word w) { return static_cast<double>(std::bit_cast<float>(w << 16)); }
double second_of(kernel::Word w) { return static_cast<double>(std::bit_cast<float>(w & 0xFFFF0000U)); }

kernel::Word random_word(npt::Random& random) {
  const auto half = [&] { return std::bit_cast<std::uint32_t>(static_cast<float>(random.uniform(-1, 1))) >> 16; };
  const kernel::Word first = half();
  return first | half() << 16;
}

/// Largest error of word_kernel<RowRegisters, Halves> over all rows, and over a second half that isn't used the largest
/// value.
template <int RowRegisters, int Halves>
double kernel_error(int depth, bool biased) {
  npt::Random random(5);
  npt::AlignedBuffer<kernel::Word> weights(index(depth * RowRegisters) * kernel::matrix_size + 1),
      operand(index(depth) * 2 * kernel::matrix_size + 1);
  for (kernel::Word& w : weights.span()) w = random_word(random);
  for (kernel::Word& w : operand.span()) w = random_word(random);
  npt::AlignedBuffer<float> bias(index(RowRegisters) * kernel::matrix_size),
      tile(index(RowRegisters * rows) * kernel::panel_width<float>);
  for (int r = 0; r < RowRegisters * rows; ++r)
    for (int v = 0; v < words; ++v) bias[index(r * words + v)] = static_cast<float>(r) / 8;
  for (float& x : tile.span()) x = std::nanf("");
  kernel::word_kernel<RowRegisters, Halves>(depth, weights.data(), operand.data(), biased ? bias.data() : nullptr,
                                            tile.data());
  double worst = 0;
  for (int r = 0; r < RowRegisters * rows; ++r)
    for (int v = 0; v < width; ++v) {
      double expected = biased && v < Halves * words ? static_cast<double>(bias[index(r * words)]) : 0;
      for (int k = 0; k < depth && v < Halves * words; ++k)
        for (int w = 0; w < words; ++w) {
          const kernel::Word
              a = weights[index(k * RowRegisters + r / rows) * kernel::matrix_size + index(r % rows * words + w)],
              x = operand[index(2 * k + v / words) * kernel::matrix_size + index(w * words + v % words)];
          expected += first_of(a) * first_of(x) + second_of(a) * second_of(x);
        }
      const double error = std::abs(static_cast<double>(tile[index(r * width + v)]) - expected);
      if (!(error <= worst)) worst = error;  // NaN counts
    }
  return worst;
}

}  // namespace

TEST_CASE("products of words in vector registers are those of their values" *
          support::Needs(kernel::has_word_kernel, "AVX512_BF16")) {
  for (const int depth : {0, 1, 8})
    for (const bool biased : {false, true}) {
      CAPTURE(depth);
      CAPTURE(biased);
      CHECK(kernel_error<1, 1>(depth, biased) < 2e-5);
      CHECK(kernel_error<1, 2>(depth, biased) < 2e-5);
      CHECK(kernel_error<2, 1>(depth, biased) < 2e-5);
      CHECK(kernel_error<2, 2>(depth, biased) < 2e-5);
    }
}
