// The mannequin's surface from its left half, which is data.
#include <doctest/doctest.h>
#include <npt/body/mannequin/anatomy.hpp>
#include <npt/body/mannequin/surface.hpp>
#include <npt/body/mannequin/surface_data.hpp>

#include <cmath>
#include <cstdint>
#include <string_view>
#include <vector>

using npt::Vec3d;
namespace anatomy = npt::anatomy;

TEST_CASE("the data holds whole vertices and triangles, and no other characters than digits") {
  const std::string_view positions = anatomy::half_positions, triangles = anatomy::half_triangles;
  CHECK(positions.size() % 12 == 0);
  CHECK(triangles.size() % 6 == 0);
  constexpr std::string_view digits = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz+-";
  CHECK(positions.find_first_not_of(digits) == std::string_view::npos);
  CHECK(triangles.find_first_not_of(digits) == std::string_view::npos);
}

TEST_CASE("the half is the anatomy's: on its masses up to what strokes add, with joints inside") {
  const anatomy::BlendedLofts masses = anatomy::masses();
  for (const Vec3d p : anatomy::left_half().positions) {
    REQUIRE(p.x >= 0);
    REQUIRE(std::abs(masses(p)) < 0.04);
    REQUIRE(anatomy::rounded(p) == p);
  }
  for (const anatomy::JointPlace& joint : anatomy::joint_places) CHECK(masses(joint.position) < 0);
}

TEST_CASE("a whole surface: middle, left, right; every vertex knows its mirror image") {
  const anatomy::TriangleSheet half{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{{0, 1, 2}}}};
  const anatomy::Surface whole = anatomy::mirrored(half);
  CHECK(whole.positions == std::vector<Vec3d>{{0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 0, 0}});
  CHECK(whole.mirror == std::vector<std::uint32_t>{0, 1, 3, 2});
  CHECK(whole.triangles == std::vector<std::array<std::uint32_t, 3>>{{2, 0, 1}, {3, 1, 0}});
}
