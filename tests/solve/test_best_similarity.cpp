#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/solve/best_similarity.hpp>

#include <cmath>
#include <span>
#include <vector>

TEST_CASE("the best similarity is found again; what points leave open stays open") {
  npt::Random random(9);
  std::vector<npt::Vec3d> from, to;
  for (int i = 0; i < 6; ++i) from.push_back({random.normal(), random.normal(), random.normal()});
  const double c = std::cos(2.9), s = std::sin(2.9);
  const npt::Matrix3 turn{{{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}}};
  for (const npt::Vec3d p : from) to.push_back(turn * p * 0.25 + npt::Vec3d{1, -2, 3});
  const npt::Similarity found = npt::best_similarity(from, to);
  CHECK((found.rotation - turn).squared_norm() < 1e-24);
  CHECK(std::abs(found.rotation.determinant() - 1) < 1e-12);
  for (std::size_t i = 0; i < from.size(); ++i) CHECK(length(found(from[i]) - to[i]) < 1e-12);

  for (const std::size_t count : {1U, 2U}) {
    const npt::Similarity open = npt::best_similarity(std::span(from).first(count), std::span(to).first(count));
    CHECK(open.rotation == npt::Matrix3::identity());
    CHECK(std::abs(open.scale - (count == 1 ? 1 : 0.25)) < 1e-12);
  }
  // A mirrored cloud is turned as well as can be, never mirrored.
  for (npt::Vec3d& p : to) p.x = -p.x;
  CHECK(std::abs(npt::best_similarity(from, to).rotation.determinant() - 1) < 1e-12);
}

TEST_CASE("any rotation is found, also half turns, and of points in a plane") {
  npt::Random random(10);
  for (int trial = 0; trial < 200; ++trial) {
    const npt::Vec3d axis = normalised(npt::Vec3d{random.normal(), random.normal(), random.normal()});
    const npt::Quaternion turn =
        npt::Quaternion{}.turned(axis * (trial % 4 == 0 ? 3.14159265358979 : random.uniform(0, 3.14)));
    std::vector<npt::Vec3d> from, to;
    for (int i = 0; i < 5; ++i)
      from.push_back({random.normal(), random.normal(), trial % 2 == 0 ? 0 : random.normal()});
    for (const npt::Vec3d p : from) to.push_back(turn(p) * 3.0);
    const npt::Similarity found = npt::best_similarity(from, to);
    for (std::size_t i = 0; i < from.size(); ++i) CHECK(length(found(from[i]) - to[i]) < 1e-9);
  }
}
