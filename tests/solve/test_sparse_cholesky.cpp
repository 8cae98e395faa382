#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/solve/sparse_cholesky.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace {

/// The Laplacian of a grid of side x side unknowns, plus `shift` on its diagonal.
std::vector<npt::SymmetricEntry> grid(std::uint32_t side, double shift) {
  std::vector<npt::SymmetricEntry> entries;
  const auto edge = [&](std::uint32_t a, std::uint32_t b) {
    entries.insert(entries.end(), {{a, a, 1}, {b, b, 1}, {a, b, -1}});
  };
  for (std::uint32_t i = 0; i < side; ++i)
    for (std::uint32_t k = 0; k < side; ++k) {
      const std::uint32_t v = i * side + k;
      entries.push_back({v, v, shift});
      if (k + 1 < side) edge(v, v + 1);
      if (i + 1 < side) edge(v + side, v);  // the other triangle: either is as good
    }
  return entries;
}

std::vector<double> product(const std::vector<npt::SymmetricEntry>& entries, const std::vector<double>& x) {
  std::vector<double> b(x.size());
  for (const auto& [row, column, value] : entries) {
    b[row] += value * x[column];
    if (row != column) b[column] += value * x[row];
  }
  return b;
}

std::vector<double> some_numbers(std::size_t count, std::uint64_t seed) {
  npt::Random random(seed);
  std::vector<double> numbers(count);
  for (double& x : numbers) x = random.uniform() - 0.5;
  return numbers;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

}  // namespace

TEST_CASE("a factored system is solved, for one right-hand side and for points") {
  constexpr std::uint32_t side = 40, count = side * side;
  const auto entries = grid(side, 0.01);
  const npt::SparseCholesky cholesky(count, entries);
  CHECK(cholesky.size() == count);
  // A dense factor would have half a million entries: the ordering works.
  CHECK(cholesky.factor_entries() < 40 * count);

  std::vector<npt::Vec3d> points(count);
  for (std::uint64_t axis = 0; axis < 3; ++axis) {
    const std::vector<double> x = some_numbers(count, axis), b = product(entries, x);
    std::vector<double> solved = b;
    cholesky.solve(solved);
    CHECK(largest_difference(solved, x) < 1e-12);
    for (std::size_t i = 0; i < count; ++i) (axis == 0 ? points[i].x : axis == 1 ? points[i].y : points[i].z) = b[i];
  }
  cholesky.solve(points);
  for (std::uint64_t axis = 0; axis < 3; ++axis) {
    const std::vector<double> x = some_numbers(count, axis);
    for (std::size_t i = 0; i < count; ++i)
      REQUIRE(std::abs((axis == 0 ? points[i].x : axis == 1 ? points[i].y : points[i].z) - x[i]) < 1e-12);
  }
}

TEST_CASE("factoring again gives what factoring anew gives, in the same places and in others") {
  constexpr std::uint32_t side = 12, count = side * side;
  npt::SparseCholesky cholesky(count, grid(side, 1));
  auto entries = grid(side, 0.5);
  const std::vector<double> b = some_numbers(count, 5);
  for (const bool other_places : {false, true}) {
    if (other_places) entries.insert(entries.end(), {{0, 0, 2}, {count - 1, count - 1, 2}, {0, count - 1, -2}});
    cholesky.factor(entries);
    std::vector<double> again = b, anew = b;
    cholesky.solve(again);
    npt::SparseCholesky(count, entries).solve(anew);
    CHECK(again == anew);
    CHECK(largest_difference(product(entries, again), b) < 1e-12);
  }
}

TEST_CASE("what has no solution is an error that says where") {
  using Entries = std::vector<npt::SymmetricEntry>;
  const auto complaint = [](std::size_t size, const Entries& entries) -> std::string {
    try {
      npt::SparseCholesky(size, entries);
    } catch (const npt::Error& error) {
      return error.what();
    }
    return {};
  };
  CHECK(complaint(2, {{0, 0, 1}, {1, 1, 1}, {0, 1, 0.5}}).empty());
  CHECK(complaint(0, {}).empty());
  CHECK(complaint(144, grid(12, 0)).find("positive definite") != std::string::npos);  // constants are its kernel
  CHECK(complaint(2, {{0, 0, 1}, {1, 1, 1}, {0, 1, 2}}).find("pivot -3") != std::string::npos);
  CHECK(complaint(3, {{0, 0, 1}, {2, 2, 1}}).find("unknown 1") != std::string::npos);  // nothing said about it
  CHECK(complaint(2, {{0, 2, 1}}).find("entry (0, 2)") != std::string::npos);
  CHECK(complaint(1, {{0, 0, std::numeric_limits<double>::quiet_NaN()}}).find("finite") != std::string::npos);
}
