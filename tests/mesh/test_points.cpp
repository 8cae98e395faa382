// Points as flat coordinates: point_at, move_points, expect_points, bounding_box.
#include <doctest/doctest.h>
#include <npt/mesh/points.hpp>

#include <limits>
#include <string>
#include <vector>

TEST_CASE("point_at reads three successive coordinates, the bounding box has its centre between the extremes") {
  const std::vector<float> xyz{0, 1, 2, 4, -1, 2, 1, 0, 8};
  CHECK(npt::point_at(xyz, 1) == npt::Vec3d{4, -1, 2});
  CHECK(npt::bounding_box(xyz).centre() == npt::Vec3d{2, 0, 5});
}

TEST_CASE("move_points moves each by the step") {
  std::vector<float> xyz{0, 1, 2, 4, -1, 2};
  npt::move_points(xyz, {1, 0.5, -2});
  CHECK(xyz == std::vector<float>{1, 1.5F, 0, 5, -0.5F, 0});
}

TEST_CASE("a NaN moves no centre") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(npt::bounding_box(std::vector<float>{nan, 1, 2, 4, nan, 2, 2, 3, nan}).centre() == npt::Vec3d{3, 2, 2});
}

TEST_CASE("expect_points names what it was given") {
  const auto message = [](const std::vector<float>& xyz) {
    try {
      npt::expect_points(xyz, "the cloud");
    } catch (const npt::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(message({1, 2, 3}).empty());
  CHECK(message({}).find("the cloud") != std::string::npos);
  CHECK(message({}).find("no vertices") != std::string::npos);
  CHECK(message({1, 2, 3, 4}).find("4 coordinates") != std::string::npos);
}
