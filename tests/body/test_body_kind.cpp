#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/hands.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/people_kind.hpp>
#include <npt/body/skeleton.hpp>

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

TEST_CASE("poses have the moments of their angles without the root's") {
  const std::vector<std::vector<float>> poses{{9, 9, 9, 1, 0, 0}, {8, 8, 8, 3, 2, 0}};
  const npt::PoseMoments moments = npt::moments_of(poses);
  REQUIRE(moments.mean.size() == 2);
  CHECK(moments.mean[1] == npt::Vec3d{2, 1, 0});
  CHECK(moments.covariance[0] == doctest::Approx(1));
  CHECK(moments.covariance[3] == doctest::Approx(1));
  CHECK(moments.covariance[4] == doctest::Approx(1));
  CHECK(moments.covariance[8] == 0);
  CHECK(npt::moments_of({}).mean.empty());
  const std::vector<std::vector<float>> uneven{poses[0], {1, 2, 3}};
  CHECK_THROWS_AS(npt::moments_of(uneven), npt::Error);
}

TEST_CASE("people's kind is what their estimates are made of") {
  const npt::BodyKind& people = *npt::people_kind();
  CHECK(npt::checked_kind(npt::people_kind()) == npt::people_kind());
  CHECK(people.joint_count() == npt::smpl_joint_count);
  CHECK(people.body->shape_count() == 26);
  CHECK(people.bound_body().joint_count() == npt::fingered_joint_count);
  CHECK(people.skeleton_names.size() == npt::fingered_joint_count);
  CHECK(people.moments.mean.size() == people.joint_count());
  for (const std::vector<float>& pose : people.poses) REQUIRE(pose.size() == 72);
  // Elbows and knees bend to one side.
  for (std::size_t j = 0; j < people.joint_count(); ++j)
    if (const npt::Vec3d hinge = people.plan.joints[j].hinge; hinge != npt::Vec3d{})
      CHECK(dot(people.moments.mean[j], hinge) < -0.2);
}

TEST_CASE("hands bend about their hinges, and a kind without hands keeps its angles") {
  npt::BodyKind people = *npt::people_kind();
  const std::vector<float> straight(72, 0.0F);
  std::array<npt::HandBend, 2> bends;
  bends[1] = {.knuckles = 0.3, .middle = {0.6, 0, 0, 0}};
  const std::vector<float> angles = people.bound_angles(straight, bends);
  REQUIRE(angles.size() == 3 * npt::fingered_joint_count);
  const npt::HandJoints& right = people.hands->joints[1];
  const auto turned = [&](std::size_t joint) { return length(npt::axis_angle(npt::joint_rotation(angles, joint))); };
  CHECK(turned(right.hand) == doctest::Approx(0.3));
  CHECK(turned(right.middles[0]) == doctest::Approx(0.6));
  CHECK(turned(right.middles[0] + 1) == doctest::Approx(0.4));
  CHECK(turned(right.middles[1]) == 0);
  CHECK(turned(people.hands->joints[0].hand) == 0);
  CHECK(right.has_finger(right.middles[3] + 1));
  CHECK_FALSE(right.has_finger(right.hand));
  people.hands.reset();
  CHECK(people.bound_angles(straight, bends) == straight);
  CHECK(&people.bound_body() == people.body.get());
}

TEST_CASE("a kind without a body, or with one of other joints, is refused") {
  const auto error_of = [](npt::BodyKind kind) {
    try {
      npt::checked_kind(std::make_shared<const npt::BodyKind>(std::move(kind)));
      return std::string();
    } catch (const npt::Error& error) {
      return std::string(error.what());
    }
  };
  CHECK_THROWS_AS(npt::checked_kind(nullptr), npt::Error);
  CHECK(error_of({}).find("found none") != std::string::npos);
  npt::BodyKind other = *npt::people_kind();
  other.plan.joints.pop_back();
  CHECK(error_of(other).find("found 24 joints, expected the 23 of the plan 'person'") != std::string::npos);
}
