#include <doctest/doctest.h>

#include <npt/estimate/canonical_frame.hpp>

#include <array>
#include <cmath>

TEST_CASE("a reading frame takes out place, size and nothing else") {
  const std::array<npt::Vec3d, 4> points{{{1, 2, 3}, {4, 2, 1}, {0, -1, 2}, {5, 5, 5}}};
  const npt::NormalisingTransform frame = npt::canonical_frame(points.size(), [&](std::size_t i) { return points[i]; });
  const npt::NormalisingTransform other = npt::canonical_frame(points.size(), [&](std::size_t i) {
    return points[i] * 7.0 + npt::Vec3d{3, -8, 1};
  });
  double square = 0;
  npt::Vec3d mean;
  for (const npt::Vec3d p : points) {
    const npt::Vec3d q = frame.apply(p);
    CHECK(length(q - other.apply(p * 7.0 + npt::Vec3d{3, -8, 1})) < 1e-12);
    square += dot(q, q) / 4, mean += q / 4.0;
  }
  CHECK(std::sqrt(square) == doctest::Approx(npt::reading_radius));
  CHECK(length(mean) < 1e-12);
}

TEST_CASE("points in one place have no frame") {
  CHECK_FALSE(std::isfinite(npt::canonical_frame(3, [](std::size_t) { return npt::Vec3d{1, 1, 1}; }).scale));
}

TEST_CASE("the nearest axis is turned upwards; one that points up stays") {
  CHECK(npt::turn_upright({0.3, 0.8, -0.5}) == npt::Matrix3::identity());
  for (const npt::Vec3d axis : {npt::Vec3d{1, 0, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
    const npt::Vec3d direction = axis + npt::Vec3d{0.2, -0.3, 0.1};
    CHECK(length(npt::turn_upright(direction) * axis - npt::Vec3d{0, 1, 0}) < 1e-12);
  }
}
