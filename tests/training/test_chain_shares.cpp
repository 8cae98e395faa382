#include <doctest/doctest.h>

#include <npt/base/vec3.hpp>
#include <training/chain_shares.hpp>

#include <vector>

TEST_CASE("points along a line by their shares of it") {
  const std::vector<npt::Vec3d> line{{0, 0, 0}, {1, 0, 0}, {1, 3, 0}};
  CHECK(npt::rig::internal::shares_along(line) == std::vector<double>{0, 0.25, 1});
  CHECK(length(npt::rig::internal::point_along(line, 0.5) - npt::Vec3d{1, 1, 0}) < 1e-12);
  CHECK(length(npt::rig::internal::point_along(line, 1) - line.back()) < 1e-12);
}

TEST_CASE("a weight goes to the bone beside which a point lies, and to both where they meet") {
  const npt::rig::internal::ChainShares chain({2, 0, 3}, {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
  const auto divided = [&](npt::Vec3d p) {
    std::vector<double> row{0.1, 0.2, 0.5, 0.2};
    chain.divide(row, p);
    return row;
  };
  CHECK(divided({0.4, 0.3, 0}) == std::vector<double>{0, 0.2, 0.8, 0});
  CHECK(divided({1.5, -0.3, 0})[0] == doctest::Approx(0.8));
  CHECK(divided({9, 0, 0})[3] == doctest::Approx(0.8));
  const std::vector<double> both = divided({1, 0.5, 0});
  CHECK(both[2] == doctest::Approx(0.4));
  CHECK(both[0] == doctest::Approx(0.4));
  CHECK(both[1] == 0.2);
  std::vector<double> none{0, 1, 0, 0};
  chain.divide(none, {1, 0, 0});
  CHECK(none == std::vector<double>{0, 1, 0, 0});
}
