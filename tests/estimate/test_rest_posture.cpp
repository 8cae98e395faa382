#include <doctest/doctest.h>

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/rest_posture.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace {

using enum npt::SmplJoint;

/// A T pose, a joint turned about x beyond people's.
npt::BodyEstimate at_rest(npt::SmplJoint joint, float radians, double distance) {
  npt::BodyEstimate reading;
  reading.fit.body.axis_angles.assign(72, 0.0F);
  reading.fit.body.axis_angles[3 * npt::joint_index(joint)] = radians;
  reading.fit.relative_distance = distance;
  return reading;
}

npt::Matrix3 rotation_of(const std::vector<float>& angles, npt::SmplJoint joint) {
  const std::size_t at = 3 * npt::joint_index(joint);
  return npt::rotation_matrix(npt::Vec3f{angles[at], angles[at + 1], angles[at + 2]}.as<double>());
}

/// Radians about x, of a joint that is turned about it.
double about_x(const std::vector<float>& angles, npt::SmplJoint joint) {
  const npt::Vec3d up = rotation_of(angles, joint) * npt::Vec3d{0, 1, 0};
  return std::atan2(up.z, up.y);
}

}  // namespace

TEST_CASE("a character of its own build in a T pose keeps its head where it is; people take the pose's angles") {
  std::vector<float> pose(72, 0.0F);
  pose[3 * npt::joint_index(head)] = 0.3F;
  const npt::BodyEstimate stylised = at_rest(head, 0.2F, 0.012), person = at_rest(head, 0.2F, 0.007);
  CHECK(npt::own_rest(stylised) == 1);
  CHECK(npt::own_rest(person) == 0);
  CHECK(npt::from_own_rest(person, pose) == pose);
  // People's heads are fitted 2.7 degrees back.
  CHECK(about_x(npt::from_own_rest(stylised, pose), head) == doctest::Approx(0.3 + 0.2 + 0.0471).epsilon(1e-3));
  CHECK(npt::own_rest(at_rest(head, 0.2F, 0.0095)) == doctest::Approx(0.5));
}

TEST_CASE("who moves isn't at rest, wherever it looks") {
  CHECK(npt::own_rest(at_rest(left_shoulder, 0.8F, 0.012)) == 0);
  CHECK(npt::own_rest(at_rest(left_hand, 0.8F, 0.012)) == 1);  // fingers
  CHECK(npt::own_rest(npt::BodyEstimate{}) == 0);
  npt::BodyEstimate aside = at_rest(pelvis, 0, 0.012);
  aside.fit.body.axis_angles[1] = 2;
  CHECK(npt::own_rest(aside) == 1);
  // The result looks where the pose does.
  const std::vector<float> pose(72, 0.0F);
  const npt::Vec3d front = rotation_of(npt::from_own_rest(aside, pose), pelvis) * npt::Vec3d{0, 0, 1};
  CHECK(front.z > 0.99);
}
