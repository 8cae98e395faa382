// The plan says the same of people as the tables that code reads.
#include <doctest/doctest.h>

#include <npt/base/matrix3.hpp>
#include <npt/base/random.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/proportions.hpp>
#include <npt/body/skeleton.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace {

const npt::BodyPlan& plan() { return npt::people_plan(); }

npt::Matrix3 growth(npt::PartGrowth way, npt::Vec3d along) {
  const auto axis = [](npt::Vec3d u) { return npt::outer(u, u); };
  switch (way) {
    case npt::PartGrowth::length:
      return axis(along);
    case npt::PartGrowth::girth:
      return npt::Matrix3::identity() - axis(along);
    case npt::PartGrowth::x:
      return axis({1, 0, 0});
    case npt::PartGrowth::y:
      return axis({0, 1, 0});
    case npt::PartGrowth::z:
      return axis({0, 0, 1});
    case npt::PartGrowth::across_y:
      return axis({1, 0, 0}) + axis({0, 0, 1});
    default:
      return npt::Matrix3::identity();
  }
}

}  // namespace

TEST_CASE("people's joints are SMPL's, in its order") {
  REQUIRE(plan().joint_count() == npt::smpl_joint_count);
  for (std::size_t j = 0; j < npt::smpl_joint_count; ++j) {
    CHECK(plan().joints[j].name == npt::smpl_joint_names[j]);
    CHECK(plan().joints[j].parent == npt::smpl_parents[j]);
    CHECK(plan().joints[j].mirrored == npt::smpl_mirrored_joints[j]);
  }
}

TEST_CASE("people's legs and arms are pairs of limbs, arms with their collars") {
  using enum npt::SmplJoint;
  const auto joints = [](auto... all) { return std::vector<std::size_t>{joint_index(all)...}; };
  const std::vector<npt::LimbPair> pairs = plan().limb_pairs();
  REQUIRE(pairs.size() == 2);
  CHECK(pairs[0].joints[0] == joints(left_hip, left_knee, left_ankle, left_foot));
  CHECK(pairs[0].joints[1] == joints(right_hip, right_knee, right_ankle, right_foot));
  CHECK(pairs[0].middle() == 1);
  CHECK(pairs[1].joints[0] == joints(left_collar, left_shoulder, left_elbow, left_wrist, left_hand));
  CHECK(pairs[1].joints[1] == joints(right_collar, right_shoulder, right_elbow, right_wrist, right_hand));
  CHECK(pairs[1].middle() == 2);
}

TEST_CASE("people's proportions deviate, and are drawn, as the tables say") {
  REQUIRE(plan().proportions.size() == npt::body_proportion_count);
  std::array<std::array<double, 2>, npt::body_proportion_count> drawn{};
  npt::Random random(1);
  for (int i = 0; i < 4000; ++i) {
    const npt::Proportions p = npt::sample_proportions(random);
    for (std::size_t k = 0; k < p.size(); ++k)
      drawn[k] = {std::min(drawn[k][0], std::log1p(p[k])), std::max(drawn[k][1], std::log1p(p[k]))};
  }
  for (std::size_t k = 0; k < npt::body_proportion_count; ++k) {
    const npt::ProportionPlan& own = plan().proportions[k];
    CAPTURE(own.name);
    CHECK(own.deviation == npt::human_proportion_deviations[k]);
    CHECK(drawn[k][0] >= std::log(own.low));
    CHECK(drawn[k][1] <= std::log(own.high));
    CHECK(drawn[k][0] == doctest::Approx(std::log(own.low)).epsilon(0.02));
    CHECK(drawn[k][1] == doctest::Approx(std::log(own.high)).epsilon(0.02));
  }
}

TEST_CASE("people's parts grow as the tables say") {
  const std::vector<npt::Vec3d> joints = npt::mannequin().joints({});
  const auto expected = npt::body::internal::part_growth(joints);
  auto found = expected;
  for (auto& of_joint : found) of_joint = {};
  for (std::size_t k = 0; k < plan().proportions.size(); ++k)
    for (const auto& [joint, way] : plan().proportions[k].grows)
      found[joint][k] = growth(way, npt::normalised(joints[plan().joints[joint].toward] - joints[joint]));
  for (std::size_t j = 0; j < joints.size(); ++j)
    for (std::size_t k = 0; k < found[j].size(); ++k) {
      INFO(plan().joints[j].name, " ", plan().proportions[k].name);
      CHECK((found[j][k] - expected[j][k]).squared_norm() < 1e-24);
    }
}
