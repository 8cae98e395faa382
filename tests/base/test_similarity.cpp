#include <doctest/doctest.h>

#include <npt/base/rotation.hpp>
#include <npt/base/similarity.hpp>

using npt::Similarity;
using npt::Vec3d;

TEST_CASE("similarities rotate, scale and shift, compose and invert") {
  const Similarity quarter{npt::Matrix3::from_columns({0, 1, 0}, {-1, 0, 0}, {0, 0, 1}), 2, {10, 0, 0}};
  CHECK(quarter({1, 0, 0}) == Vec3d{10, 2, 0});
  const Similarity other{npt::rotation_matrix({0.3, -1.1, 0.7}), 0.25, {4, -5, 6}};
  const Vec3d p{1, 2, 3};
  CHECK(length(inverse(other)(other(p)) - p) < 1e-12);
  CHECK(length((quarter * other)(p)-quarter(other(p))) < 1e-12);
  CHECK(Similarity{}(p) == p);
}
