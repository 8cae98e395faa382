#include <doctest/doctest.h>

#include <npt/base/executor.hpp>
#include <npt/nn/train/adam.hpp>
#include <npt/nn/train/clip.hpp>
#include <npt/nn/train/moving_average.hpp>
#include <npt/nn/train/slices.hpp>

#include <cmath>
#include <vector>

#include "nn/train/linear_core.hpp"

TEST_CASE("slices cover every learned value once, and nothing else") {
  for (const std::size_t largest : {1U, 4U, 9U, 100U}) {
    std::vector<int> seen(support::LinearCore::size);
    for (const npt::Slice& s : npt::learned_slices(support::LinearCore::parameters(), largest)) {
      CHECK(s.size() >= 1);
      CHECK(s.size() <= largest);
      for (std::size_t i = s.first; i < s.last; ++i) ++seen[i];
    }
    for (std::size_t i = 0; i < seen.size(); ++i) {
      CAPTURE(i);
      CHECK(seen[i] == (i < 9 || (i >= 16 && i < 25) || (i >= 32 && i < 35) ? 1 : 0));
    }
  }
}

TEST_CASE("the gradient's norm is that of the learned values") {
  std::vector<float> gradient(support::LinearCore::size, 2.0F);
  std::vector<double> partial;
  const auto slices = npt::learned_slices(support::LinearCore::parameters(), 4);
  const double norm = npt::gradient_norm(std::span<const float>(gradient), slices, npt::SerialExecutor(), partial);
  CHECK(std::abs(norm - std::sqrt(21 * 4.0)) < 1e-12);
}

TEST_CASE("squares are summed in double for any length") {
  for (const std::size_t n : {0U, 1U, 15U, 16U, 17U, 100U}) {
    std::vector<float> x(n);
    double expected = 0;
    for (std::size_t i = 0; i < n; ++i) {
      x[i] = 1 + 1e-4F * static_cast<float>(i);
      expected += static_cast<double>(x[i]) * static_cast<double>(x[i]);
    }
    CHECK(std::abs(npt::sum_of_squares(std::span<const float>(x)) - expected) <= 1e-13 * expected);
  }
  const std::vector<float> large(2, 3e38F);  // its square doesn't fit into float
  CHECK(std::isfinite(npt::sum_of_squares(std::span<const float>(large))));
}

TEST_CASE("clipping shortens long gradients to the limit and leaves short ones alone") {
  CHECK(npt::clip_factor(10, 2) == 0.2);
  CHECK(npt::clip_factor(2, 2) == 1);
  CHECK(npt::clip_factor(1.5, 2) == 1);
  CHECK(npt::clip_factor(1e9, 0) == 1);
  npt::Adam<double> clipped(1), plain(1);
  std::vector<double> x{1}, y{1}, long_gradient{10}, short_gradient{2};
  for (int i = 0; i < 5; ++i) {
    clipped.begin_step(0.1);
    clipped.update(x, long_gradient, 0, 1, npt::clip_factor(10, 2));
    plain.step(y, short_gradient, 0.1);
  }
  CHECK(std::abs(x[0] - y[0]) < 1e-15);
}

TEST_CASE("Adam in pieces is Adam at once, whatever the pieces") {
  constexpr std::size_t n = 50;
  npt::Adam<float> whole(n), pieces(n);
  std::vector<float> x(n, 1.0F), y = x, gradient(n);
  for (int t = 0; t < 20; ++t) {
    for (std::size_t i = 0; i < n; ++i) gradient[i] = std::sin(static_cast<float>(i + 1) * static_cast<float>(t));
    whole.step(x, gradient, 1e-2);
    pieces.begin_step(1e-2);
    for (const auto& [first, last] : {std::pair<std::size_t, std::size_t>{32, n}, {0, 5}, {5, 32}})
      pieces.update(y, gradient, first, last);
  }
  for (std::size_t i = 0; i < n; ++i) CHECK(std::abs(x[i] - y[i]) < 1e-6F);  // fused multiply-adds may differ
}

TEST_CASE("the moving average follows its formula and reaches constant weights") {
  std::vector<float> x{1, 2, 3};
  npt::MovingAverage<float> average(x, 0.95);
  CHECK(average.values()[1] == 2);
  CHECK(average.decay_at(1) == 2.0 / 11);
  CHECK(average.decay_at(100000) == 0.95);
  double expected = 3;
  for (int t = 1; t <= 200; ++t) {
    x[2] = t <= 100 ? static_cast<float>(t) : 7.0F;
    average.step(x);
    const double d = std::min(0.95, (1.0 + t) / (10.0 + t));
    expected = d * expected + (1 - d) * static_cast<double>(x[2]);
    CHECK(std::abs(static_cast<double>(average.values()[2]) - expected) < 1e-4);
  }
  CHECK(average.values()[0] == 1);
  CHECK(std::abs(average.values()[2] - 7) < 0.6F);
}

TEST_CASE("a restored moving average continues bit for bit") {
  std::vector<float> x{1, 2};
  npt::MovingAverage<float> a(x, 0.999);
  for (int t = 0; t < 20; ++t) {
    x[0] += 0.1F;
    a.step(x);
  }
  npt::MovingAverage<float> b(x, 0.999);
  std::ranges::copy(a.values(), b.values().begin());
  b.set_steps(a.steps());
  x[1] = 9;
  a.step(x);
  b.step(x);
  CHECK(std::ranges::equal(a.values(), b.values()));
}
