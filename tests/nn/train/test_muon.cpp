#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/base/thread_executor.hpp>
#include <npt/nn/train/muon.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace {

std::vector<double> random_matrix(int rows, int columns, std::uint64_t seed) {
  npt::Random random(seed);
  std::vector<double> m(static_cast<std::size_t>(rows * columns));
  for (double& x : m) x = random.normal();
  return m;
}

double entry(const std::vector<double>& m, int columns, int r, int c) {
  return m[static_cast<std::size_t>(r * columns + c)];
}

}  // namespace

TEST_CASE("matrix products and transposes are those of plain loops") {
  npt::kernel::MatrixProduct<double> multiply;
  for (const auto& [m, n, k] : {std::array{1, 1, 1}, {13, 16, 5}, {14, 33, 20}, {40, 7, 64}, {65, 131, 31}}) {
    const auto a = random_matrix(m, k, 1), b = random_matrix(k, n, 2);
    std::vector<double> transposed(a.size());
    npt::kernel::transpose_matrix(a.data(), m, k, transposed.data());
    std::size_t wrong = 0;
    for (int s = 0; s < k; ++s)
      for (int i = 0; i < m; ++i) wrong += entry(transposed, m, s, i) == entry(a, k, i, s) ? 0U : 1U;
    CHECK(wrong == 0);
    std::vector<double> c(static_cast<std::size_t>(m * n));
    multiply(m, n, k, a.data(), transposed.data(), b.data(), c.data());
    std::vector<float> c32(c.size());
    const std::vector<float> a32(a.begin(), a.end()), t32(transposed.begin(), transposed.end()),
        b32(b.begin(), b.end());
    npt::kernel::MatrixProduct<float>(1)(m, n, k, a32.data(), t32.data(), b32.data(),
                                         c32.data());  // on matrix registers, if any
    double worst = 0, worst32 = 0;
    for (int i = 0; i < m; ++i)
      for (int j = 0; j < n; ++j) {
        double sum = 0, size = 0;
        for (int s = 0; s < k; ++s) {
          sum += entry(a, k, i, s) * entry(b, n, s, j);
          size += std::abs(entry(a, k, i, s) * entry(b, n, s, j));
        }
        worst = std::max(worst, std::abs(sum - entry(c, n, i, j)));
        worst32 =
            std::max(worst32, std::abs(sum - static_cast<double>(c32[static_cast<std::size_t>(i * n + j)])) / size);
      }
    CHECK(worst < 1e-12);
    CHECK(worst32 < 0x1p-7);
  }
}

TEST_CASE("orthogonalised matrices keep their singular vectors and lose their singular values") {
  npt::Orthogonaliser<double> orthogonalise;
  for (const auto& shape : {std::pair{20, 20}, {12, 30}, {30, 12}}) {
    const int rows = shape.first, columns = shape.second;
    CAPTURE(rows);
    CAPTURE(columns);
    auto m = random_matrix(rows, columns, 3);
    const auto before = m;
    orthogonalise(m, rows, columns, 5);
    // Along the shorter side, X X^T is near the identity.
    const int n = std::min(rows, columns), longer = std::max(rows, columns);
    double trace = 0, off = 0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        double sum = 0;
        for (int k = 0; k < longer; ++k)
          sum += rows <= columns ? entry(m, columns, i, k) * entry(m, columns, j, k)
                                 : entry(m, columns, k, i) * entry(m, columns, k, j);
        (i == j ? trace : off) += i == j ? sum : sum * sum;
      }
    CHECK(trace / n > 0.5);
    CHECK(trace / n < 1.5);
    CHECK(std::sqrt(off / n) < 0.4);
    // u and its orthogonalised form share the polar factor: their inner product is nearly the sum of singular values.
    double inner = 0, norm = 0;
    for (std::size_t k = 0; k < m.size(); ++k) {
      inner += m[k] * before[k];
      norm += before[k] * before[k];
    }
    CHECK(inner > std::sqrt(norm));
  }
  std::vector<double> zero(12);
  orthogonalise(zero, 3, 4, 5);
  CHECK(std::ranges::all_of(zero, [](double x) { return x == 0; }));
}

TEST_CASE("a step moves hidden matrices only, by the rate, with the same bits for any threads") {
  std::vector<npt::NamedParameter> list;
  int offset = 0;
  for (const npt::Parameter& shape : {npt::Parameter(8, 3, 1), npt::Parameter(8), npt::Parameter(24, 8, 1),
                                      npt::Parameter(24), npt::Parameter(3, 24, 1), npt::Parameter::number(2)}) {
    npt::Parameter p = shape;
    p.offset = offset;
    offset += (p.size() + 15) / 16 * 16;
    list.push_back({std::string(1, static_cast<char>('a' + list.size())), p});
  }
  npt::Random random(5);
  const auto size = static_cast<std::size_t>(offset);
  std::vector<float> start(size), gradient(size);
  for (float& x : start) x = static_cast<float>(random.normal());
  for (float& x : gradient) x = static_cast<float>(random.normal());
  std::vector<std::vector<float>> ends;
  for (const int threads : {1, 3}) {
    npt::Muon<float> muon(list, {});
    REQUIRE(muon.matrices().size() == 1);
    std::vector<float> x = start, momentum(size);
    const npt::ThreadExecutor executor(threads);
    for (int i = 0; i < 3; ++i) muon.step(x, gradient, momentum, 0.1, 1, executor);
    ends.push_back(x);
  }
  CHECK(ends[0] == ends[1]);
  double moved = 0;
  const npt::Parameter& matrix = list[2].parameter;
  for (std::size_t i = 0; i < size; ++i) {
    const bool inside =
        i >= static_cast<std::size_t>(matrix.offset) && i < static_cast<std::size_t>(matrix.offset + matrix.size());
    const double d = static_cast<double>(ends[0][i]) - static_cast<double>(start[i]);
    if (inside)
      moved += d * d;
    else
      CHECK(d == 0);
  }
  // Three steps in one direction, each with 8 singular values of about sqrt(24 / 8).
  CHECK(std::sqrt(moved) > 0.7 * 3 * 0.1 * std::sqrt(8.0 * 3));
  CHECK(std::sqrt(moved) < 1.3 * 3 * 0.1 * std::sqrt(8.0 * 3));
}
