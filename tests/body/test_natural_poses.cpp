#include <doctest/doctest.h>

#include <npt/body/kinematics.hpp>
#include <npt/body/natural_pose_data.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/pose_sampler.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string_view>

namespace {

using npt::SmplJoint;

constexpr double degree = std::numbers::pi / 180.0;

npt::NaturalPoses::Pose draw(std::uint64_t stream, std::uint64_t seed = 3) {
  npt::Random random(seed, stream);
  return npt::natural_poses().sample(random);
}

/// Where the body's own vertical points.
npt::Vec3d up_of(const npt::NaturalPoses::Pose& pose) {
  return npt::rotation_matrix(npt::Vec3f{pose[0], pose[1], pose[2]}.as<double>()) * npt::Vec3d{0, 1, 0};
}

double angle(const npt::NaturalPoses::Pose& pose, SmplJoint joint, std::size_t axis) {
  return static_cast<double>(pose[3 * npt::joint_index(joint) + axis]);
}

}  // namespace

TEST_CASE("a natural pose depends on seed and stream, and sample_pose draws the same") {
  CHECK(draw(1) == draw(1));
  CHECK(draw(1) != draw(2));
  CHECK(draw(1) != draw(1, 4));
  npt::Random random(3, 1);
  CHECK(npt::sample_pose(random, npt::PoseDistribution::natural) == draw(1));
}

TEST_CASE("every draw takes as many numbers, and other distributions draw what they drew") {
  const auto next_after_draws = [](std::uint64_t stream) {
    npt::Random random(3, stream), skipped(3, stream);
    npt::natural_poses().sample(random);
    for (int i = 0; i < 3; ++i) skipped.uniform();
    for (std::size_t i = 0; i < npt::body::internal::natural_pose_rank + 71; ++i) skipped.normal();
    return random() == skipped();
  };
  for (std::uint64_t i = 0; i < 20; ++i) CHECK(next_after_draws(i));
}

TEST_CASE("angles keep their limits; knees and elbows bend to one side") {
  const npt::NaturalPoses& prior = npt::natural_poses();
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const auto pose = draw(i);
    for (std::size_t j = 1; j < npt::smpl_joint_count; ++j)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto joint = static_cast<SmplJoint>(j);
        const auto [low, high] = prior.limits(joint, k);
        REQUIRE(angle(pose, joint, k) >= low - 2e-3);
        REQUIRE(angle(pose, joint, k) <= high + 2e-3);
      }
    for (const SmplJoint knee : {SmplJoint::left_knee, SmplJoint::right_knee}) {
      REQUIRE(angle(pose, knee, 0) > -5 * degree);
      REQUIRE(angle(pose, knee, 0) < 150 * degree);
    }
    REQUIRE(angle(pose, SmplJoint::left_elbow, 1) < 3 * degree);
    REQUIRE(angle(pose, SmplJoint::right_elbow, 1) > -3 * degree);
  }
}

TEST_CASE("directions about the vertical are uniform; most people stand, some lie; arms hang, some are overhead") {
  constexpr int count = 4000;
  int standing = 0, lying = 0, overhead = 0, sitting = 0;
  double x = 0, z = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto pose = draw(i);
    const npt::Matrix3 root = npt::rotation_matrix(npt::Vec3f{pose[0], pose[1], pose[2]}.as<double>());
    const npt::Vec3d side = root * npt::Vec3d{1, 0, 0}, up = up_of(pose);
    x += side.x / count, z += side.z / count;
    standing += up.y > std::cos(30 * degree);
    lying += std::abs(up.y) < std::sin(30 * degree);
    sitting +=
        angle(pose, SmplJoint::left_hip, 0) < -60 * degree && angle(pose, SmplJoint::right_hip, 0) < -60 * degree;
    overhead += angle(pose, SmplJoint::left_shoulder, 2) > 20 * degree;
  }
  CHECK(std::abs(x) < 0.05);
  CHECK(std::abs(z) < 0.05);
  CHECK(standing > 0.6 * count);
  CHECK(lying > 0.03 * count);
  CHECK(lying < 0.2 * count);
  CHECK(sitting > 0.08 * count);
  CHECK(overhead > 0.03 * count);
}

TEST_CASE("a pose and its mirror image are equally likely among draws") {
  double left = 0, right = 0;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    const auto pose = draw(i);
    left += angle(pose, SmplJoint::left_hip, 0) / 4000, right += angle(pose, SmplJoint::right_hip, 0) / 4000;
  }
  CHECK(std::abs(left - right) < 0.05);
}

TEST_CASE("the data holds whole tables and no other characters than digits") {
  using namespace npt::body::internal;
  constexpr std::string_view digits = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz+-";
  const auto expect = [&](std::string_view text, std::size_t count) {
    CHECK(text.size() == 2 * count);
    CHECK(text.find_first_not_of(digits) == std::string_view::npos);
  };
  expect(natural_pose_weights, natural_pose_components);
  expect(natural_pose_means, natural_pose_components * 71);
  expect(natural_pose_deviations, natural_pose_spreads * 71);
  expect(natural_pose_factors, natural_pose_spreads * natural_pose_rank * 71);
  expect(natural_pose_limits, 2 * 71);
}
