#include <doctest/doctest.h>

#include <npt/body/plan_poses.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <vector>

namespace {

using npt::Vec3d;

constexpr const char* plan_text = R"(plan pair
joint trunk   -     trunk   trunk root trunk 1 1
joint l_leg   trunk r_leg   left  bone l_leg 1 1
joint r_leg   trunk l_leg   right bone r_leg 1 1
joint l_ear   trunk r_ear   trunk appendage l_ear 1 1
joint r_ear   trunk l_ear   trunk appendage r_ear 1 1
)";
constexpr const char* table = R"(# two poses
range trunk -10 10 -180 180 -5 5
range l_leg -40 30 -5 10 -2 20
range l_ear -90 0 -30 30 0 0
pose stand 1
pose step 2
bend step l_leg -50 0 6
pose kick 1
bend kick trunk 20 0 0
bend kick l_leg 10 1 2
bend kick r_leg 60 0 0
)";
constexpr double degree = std::numbers::pi / 180;

npt::BodyPlan plan() { return npt::read_body_plan(plan_text, "test"); }
npt::PlanPoses poses() { return {plan(), table, "table"}; }

bool near(Vec3d a, Vec3d degrees) { return length(a - degrees * degree) < 1e-9; }

}  // namespace

TEST_CASE("a side that the table doesn't name mirrors the other one") {
  const npt::PlanPoses p = poses();
  REQUIRE(p.poses().size() == 3);
  CHECK(near(p.ranges()[2].low, {-40, -10, -20}));
  CHECK(near(p.ranges()[2].high, {30, 5, 2}));
  CHECK(near(p.poses()[1].angles[1], {-50, 0, 6}));
  CHECK(near(p.poses()[1].angles[2], {-50, 0, -6}));
  CHECK(near(p.poses()[2].angles[2], {60, 0, 0}));
  CHECK(p.poses()[0].angles == std::vector<Vec3d>(5));
}

TEST_CASE("limits hold the ranges, every named pose and its mirror image") {
  const npt::PlanPoses p = poses();
  CHECK(near(p.limits()[0].high, {20, 180, 5}));
  CHECK(near(p.limits()[1].low, {-50, -5, -2}));
  CHECK(near(p.limits()[1].high, {60, 10, 20}));
  const std::vector<Vec3d> mirrored = p.mirror(p.poses()[2].angles);
  CHECK(near(mirrored[1], {60, 0, 0}));
  CHECK(near(mirrored[2], {10, -1, -2}));
}

TEST_CASE("draws stay within the limits, differ, and depend on seed and stream only") {
  const npt::PlanPoses p = poses();
  int left_back = 0, right_back = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    npt::Random random(7, i), again(7, i);
    const std::vector<Vec3d> angles = p.sample_angles(random);
    for (std::size_t j = 0; j < angles.size(); ++j) {
      const auto [low, high] = p.limits()[j];
      const Vec3d a = angles[j];
      REQUIRE((a.x >= low.x && a.y >= low.y && a.z >= low.z && a.x <= high.x && a.y <= high.y && a.z <= high.z));
    }
    left_back += angles[1].x > 35 * degree, right_back += angles[2].x > 35 * degree;
    CHECK(p.axis_angles(angles) == p.sample(again));
    CHECK(random() == again());
  }
  // Kicks of both sides.
  CHECK(left_back > 15);
  CHECK(right_back > 15);
}

TEST_CASE("ears move in every draw, the right one mostly as the left one") {
  const npt::PlanPoses p = poses();
  int moved = 0;
  for (std::uint64_t i = 0; i < 200; ++i) {
    npt::Random random(8, i);
    const std::vector<Vec3d> angles = p.sample_angles(random);
    moved += std::min(angles[3].x, angles[4].x) < -10 * degree;
    CHECK(std::abs(angles[3].x - angles[4].x) < 0.25 * 90 * degree + 1e-9);
  }
  CHECK(moved > 100);
}

TEST_CASE("the root turns after it tilted") {
  const npt::PlanPoses p = poses();
  const std::vector<Vec3d> angles{{0, 90 * degree, 90 * degree}, {0.1, 0.2, 0.3}, {}, {}, {}};
  const std::vector<float> pose = p.axis_angles(angles);
  // Tilted to its right side, what was up points to -x; turned to the left, to +z.
  const Vec3d up = npt::joint_rotation(pose, 0) * Vec3d{0, 1, 0};
  CHECK(length(up - Vec3d{0, 0, 1}) < 1e-6);
  CHECK(pose[3] == 0.1F);
  CHECK(pose[5] == 0.3F);
}

TEST_CASE("errors name the line") {
  const auto fails = [](const char* text, const char* part) {
    CHECK_THROWS_WITH_AS(npt::PlanPoses(plan(), text, "table"), doctest::Contains(part), npt::Error);
  };
  fails("", "no poses");
  fails("pose a 1\nbend a arm 1 2 3", "line 2");
  fails("bend b trunk 1 2 3", "pose 'b'");
  fails("range trunk 5 10 0 0 0 0", "a range without 0");
  fails("pose a x", "'x'");
  fails("jump 1", "range, pose or bend");
}
