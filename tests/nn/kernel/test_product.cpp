#include <doctest/doctest.h>

#include <npt/base/aligned.hpp>
#include <npt/base/random.hpp>
#include <npt/nn/kernel/matrix_product.hpp>
#include <npt/nn/kernel/product.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <vector>

#include "support/needs.hpp"

namespace kernel = npt::kernel;

namespace {

std::size_t to_size(int i) { return static_cast<std::size_t>(i); }

template <class T>
npt::AlignedBuffer<T> random_values(std::size_t count, std::uint64_t seed) {
  npt::Random random(seed);
  npt::AlignedBuffer<T> values(count);
  for (T& x : values.span()) x = static_cast<T>(random.uniform(-1, 1));
  return values;
}

/// Largest error of a group's product in a format, its operand given as a tile in T; NaN where something wasn't
/// written.
template <class T>
double product_error(int rows, int columns, int valid, kernel::ProductFormat format, bool as_matrix) {
  const auto weights = random_values<T>(to_size(rows) * to_size(columns), 1),
             biases = random_values<T>(to_size(rows), 2), operand = random_values<T>(kernel::tile_size(columns), 3);
  const auto bias = [&](int row) { return biases[to_size(row)]; };
  kernel::ProductWeights<T> packed;
  if (as_matrix)
    packed.pack_matrix(rows, columns, format, weights.data(), to_size(columns), bias);
  else
    packed.pack(
        rows, columns, format, [&](int r, int c) { return weights[to_size(r) * to_size(columns) + to_size(c)]; }, bias);
  npt::AlignedBuffer<kernel::Word> words(packed.operand_words(kernel::group_panels<T>));
  npt::AlignedBuffer<T> out(kernel::tile_size(rows));
  for (T& x : out.span()) x = std::numeric_limits<T>::quiet_NaN();
  [[maybe_unused]] const kernel::ProductScope scope(packed.format());
  const kernel::GroupProduct<T> product(packed, operand.data(), valid, words.data());
  for (int b = 0; b < packed.block_count(); ++b)
    for (int p = 0; p < kernel::used_panels<T>(valid); ++p)
      product.multiply_exactly(b, p, packed.bias_at(packed.bias(), packed.first_row(b)),
                               out.data() + kernel::panel_stride<T>(rows) * to_size(p) +
                                   to_size(packed.first_row(b)) * kernel::panel_width<T>);
  double worst = 0;
  for (int r = 0; r < rows; ++r) {
    CHECK(packed.bias(r) == biases[to_size(r)]);
    for (int v = 0; v < valid; ++v) {
      const std::size_t panel = to_size(v / kernel::panel_width<T>), lane = to_size(v % kernel::panel_width<T>);
      const auto at = [&](const auto& tile, int channels, int c) {
        return static_cast<double>(
            tile[kernel::panel_stride<T>(channels) * panel + to_size(c) * kernel::panel_width<T> + lane]);
      };
      double sum = static_cast<double>(biases[to_size(r)]);
      for (int c = 0; c < columns; ++c)
        sum += static_cast<double>(weights[to_size(r) * to_size(columns) + to_size(c)]) * at(operand, columns, c);
      const double error = std::abs(at(out, rows, r) - sum);
      if (!(error <= worst) && !std::isnan(worst)) worst = error;
    }
  }
  return worst;
}

template <class F>
void for_each_shape(F&& f) {
  for (const int rows : std::initializer_list<int>{1, 13, 27, 66})
    for (const int columns : std::initializer_list<int>{1, 3, 40, 131})
      for (const int valid : std::initializer_list<int>{1, 33, 96})
        for (const bool as_matrix : {false, true}) {
          CAPTURE(rows);
          CAPTURE(columns);
          CAPTURE(valid);
          f(rows, columns, valid, as_matrix);
        }
}

}  // namespace

TEST_CASE("a group's product is what plain loops give") {
  for_each_shape([](int rows, int columns, int valid, bool as_matrix) {
    CHECK(product_error<double>(rows, columns, valid, {}, as_matrix) < 1e-13);
    CHECK(product_error<float>(rows, columns, valid, {}, as_matrix) < 1e-4);
  });
}

TEST_CASE("a group's product on matrix registers is what plain loops give" * support::needs_matrix_registers()) {
  for_each_shape([](int rows, int columns, int valid, bool as_matrix) {
    for (int parts = 1; parts <= kernel::max_parts; ++parts)
      CHECK(product_error<float>(rows, columns, valid, {.parts = parts}, as_matrix) < (parts == 1 ? 0.3 : 1e-3));
  });
}

TEST_CASE("a plain matrix product is what plain loops give, and its transpose is") {
  for (const int parts : {0, 3}) {  // the latter only where there are matrix registers
    const int m = 37, n = 45, k = 29;
    const auto a = random_values<float>(to_size(m * k), 1), b = random_values<float>(to_size(k * n), 2);
    std::vector<float> transposed(to_size(m * k)), c(to_size(m * n));
    kernel::transpose_matrix(a.data(), m, k, transposed.data());
    kernel::MatrixProduct<float> product(parts);
    product(m, n, k, a.data(), transposed.data(), b.data(), c.data());
    double worst = 0;
    for (int i = 0; i < m; ++i)
      for (int j = 0; j < n; ++j) {
        double sum = 0;
        for (int l = 0; l < k; ++l)
          sum += static_cast<double>(a[to_size(i * k + l)]) * static_cast<double>(b[to_size(l * n + j)]);
        worst = std::max(worst, std::abs(sum - static_cast<double>(c[to_size(i * n + j)])));
      }
    CHECK(worst < 1e-4);
  }
}
