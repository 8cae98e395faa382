#include <doctest/doctest.h>

#include <npt/nn/train/adam.hpp>
#include <npt/nn/train/schedule.hpp>

#include <cmath>
#include <vector>

TEST_CASE("Adam follows algorithm 1, written out, for a hundred steps") {
  const npt::AdamOptions options{.beta1 = 0.8, .beta2 = 0.99, .epsilon = 1e-6};
  npt::Adam<double> adam(3, options);
  std::vector<double> x{1, -2, 0.5}, y = x, m(3), v(3);
  for (int t = 1; t <= 100; ++t) {
    std::vector<double> gradient(3);
    for (std::size_t i = 0; i < 3; ++i) gradient[i] = 2 * x[i] + static_cast<double>(i) * std::sin(t);
    adam.step(x, gradient, 0.01);
    for (std::size_t i = 0; i < 3; ++i) {
      m[i] = 0.8 * m[i] + 0.2 * gradient[i];
      v[i] = 0.99 * v[i] + 0.01 * gradient[i] * gradient[i];
      const double first = m[i] / (1 - std::pow(0.8, t)), second = v[i] / (1 - std::pow(0.99, t));
      y[i] -= 0.01 * first / (std::sqrt(second) + 1e-6);
      REQUIRE(std::abs(x[i] - y[i]) < 1e-12);
    }
  }
  CHECK(adam.steps() == 100);
}

TEST_CASE("a parameter without gradient doesn't move, and the first step has the length of the rate") {
  npt::Adam<float> adam(2);
  std::vector<float> x{3, 3}, gradient{0, 1e-3F};
  adam.step(x, gradient, 0.5);
  CHECK(x[0] == 3);
  CHECK(std::abs(x[1] - 2.5F) < 1e-4F);
}

TEST_CASE("an Adam restored from its state continues bit for bit") {
  npt::Adam<float> a(4);
  std::vector<float> x{1, 2, 3, 4}, gradient{0.1F, -0.2F, 0.3F, -0.4F};
  for (int t = 0; t < 5; ++t) a.step(x, gradient, 1e-2);
  npt::Adam<float> b(4);
  std::vector<float> y = x;
  std::copy(a.mean().begin(), a.mean().end(), b.mean().begin());
  std::copy(a.square().begin(), a.square().end(), b.square().begin());
  b.set_steps(a.steps());
  for (int t = 0; t < 5; ++t) {
    a.step(x, gradient, 1e-2);
    b.step(y, gradient, 1e-2);
  }
  CHECK(x == y);
}

TEST_CASE("the cosine schedule rises, falls and stays positive") {
  const npt::CosineRate rate{.rate = 2, .warm_up = 0.1, .last = 0.05};
  CHECK(rate(0) == 0);
  CHECK(rate(0.05) < rate(0.1));
  CHECK(std::abs(rate(0.1) - 2 * (0.05 + 0.95 * 0.5 * (1 + std::cos(0.1 * 3.14159265358979)))) < 1e-12);
  for (double p = 0.1; p < 0.99; p += 0.01) CHECK(rate(p) > rate(p + 0.01));
  CHECK(std::abs(rate(1) - 0.1) < 1e-12);
  CHECK(rate(2) == rate(1));
  CHECK(npt::ConstantRate{npt::paper_learning_rate}(0.7) == 5e-5);
}
