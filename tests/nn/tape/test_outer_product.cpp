#include <doctest/doctest.h>

#include <npt/base/aligned.hpp>
#include <npt/base/random.hpp>
#include <npt/nn/kernel/product.hpp>
#include <npt/nn/tape/amx_outer_product.hpp>
#include <npt/nn/tape/outer_product.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <vector>

#include "support/needs.hpp"
#include "support/needs_bf16.hpp"

namespace kernel = npt::kernel;
namespace tape = npt::tape;

namespace {

std::size_t as_size(int i) { return static_cast<std::size_t>(i); }

/// Groups of vertices as tiles, and what plain loops say of them.
template <class T>
struct Operands {
  Operands(int channels, std::vector<int> valid, std::uint64_t seed) : rows(channels), groups(std::move(valid)) {
    npt::Random random(seed);
    for (const int vertices : groups) {
      // Rows behind the last one may be read.
      tiles.emplace_back(kernel::tile_size(rows) + as_size(kernel::panel_width<T>) * kernel::panel_width<T>);
      values.emplace_back();
      for (int r = 0; r < rows; ++r)
        for (int v = 0; v < kernel::group_width; ++v) {
          // The first operand is a gradient, which is zero where there is no vertex; the other may hold anything
          // finite.
          const T x = v < vertices ? static_cast<T>(random.uniform(-1, 1)) : T(0);
          tiles.back()[kernel::panel_stride<T>(rows) * as_size(v / kernel::panel_width<T>) +
                       as_size(r * kernel::panel_width<T> + v % kernel::panel_width<T>)] = x;
          values.back().push_back(static_cast<double>(x));
        }
    }
  }
  double at(std::size_t group, int r, int v) const { return values[group][as_size(r * kernel::group_width + v)]; }
  int rows;
  std::vector<int> groups;
  std::vector<npt::AlignedBuffer<T>> tiles;
  std::vector<std::vector<double>> values;
};

/// Largest error of a product over groups of these many vertices, with a column of ones behind b's.
template <class T, class Shape, class Product>
double product_error(const Shape& shape, Product& product, const Operands<T>& a, const Operands<T>& b,
                     const T* result) {
  for (std::size_t g = 0; g < a.groups.size(); ++g) {
    product.collect_b(b.tiles[g].data(), b.rows, b.rows, a.groups[g]);
    product.collect_a(a.tiles[g].data(), a.rows, a.groups[g]);
    if (product.full() || g + 1 == a.groups.size()) product.multiply();
  }
  double worst = 0;
  for (int r = 0; r < a.rows; ++r)
    for (int k = 0; k <= b.rows; ++k) {
      double sum = 0;
      for (std::size_t g = 0; g < a.groups.size(); ++g)
        for (int v = 0; v < a.groups[g]; ++v) sum += a.at(g, r, v) * (k == b.rows ? 1.0 : b.at(g, k, v));
      worst = std::max(worst, std::abs(static_cast<double>(result[shape.at(r, k)]) - sum));
    }
  return worst;
}

template <class T>
void check(int rows, int columns, const std::vector<int>& groups, double bound) {
  CAPTURE(rows);
  CAPTURE(columns);
  const Operands<T> a(rows, groups, 1), b(columns, groups, 2);
  const auto shape = tape::OuterShape<T>::of(rows, columns + 1);
  npt::AlignedBuffer<T> memory(shape.a_size() + 64), more(shape.b_size() + 64), result(shape.result_size());
  tape::OuterProduct<T> product(shape, memory.data(), more.data(), result.data());
  CHECK(product_error(shape, product, a, b, result.data()) < bound);
}

}  // namespace

TEST_CASE("a product over the vertices is what plain loops give, with the sum of one operand beside it") {
  for (const int rows : std::initializer_list<int>{1, 3, 7, 13, 14, 66})
    for (const int columns : std::initializer_list<int>{1, 3, 31, 32, 65}) {
      check<double>(rows, columns, {96, 96, 96, 96, 96, 41}, 1e-12);
      check<float>(rows, columns, {96, 96, 96, 96, 96, 41}, 1e-3);
      check<double>(rows, columns, {1}, 1e-14);
    }
}

TEST_CASE("a product over the vertices of values in parts is what plain loops give" * support::needs_bf16_words()) {
  for (const int rows : std::initializer_list<int>{1, 16, 17, 66})
    for (const int columns : std::initializer_list<int>{3, 15, 16, 47})
      for (int parts = 1; parts <= kernel::max_parts && kernel::has_word_products(parts); ++parts) {
        const std::vector<int> groups{96, 96, 96, 96, 96, 41};
        const Operands<float> a(rows, groups, 1), b(columns, groups, 2);
        const auto shape = tape::AmxOuterShape::of(rows, columns + 1, parts);
        npt::AlignedBuffer<kernel::Word> memory(shape.a_size()), more(shape.b_size());
        npt::AlignedBuffer<float> result(shape.result_size());
        [[maybe_unused]] const kernel::ProductScope scope({.parts = parts});
        tape::AmxOuterProduct product(shape, memory.data(), more.data(), result.data());
        CHECK(product_error(shape, product, a, b, static_cast<const float*>(result.data())) <
              (parts == 1 ? 0.5 : 1e-2));
      }
}
