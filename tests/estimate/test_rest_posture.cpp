#include <doctest/doctest.h>

#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/people_kind.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/rest_posture.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace {

using enum npt::SmplJoint;

/// How people at rest are fitted: the head a little back.
constexpr double back = 0.047;
std::vector<npt::Vec3d> at_ease() {
  std::vector<npt::Vec3d> rest(npt::smpl_joint_count);
  rest[npt::joint_index(head)] = {-back, 0, 0};
  return rest;
}
double own_rest(const npt::BodyEstimate& estimate) { return npt::own_rest(*npt::people_kind(), at_ease(), estimate); }
std::vector<float> from_own_rest(const npt::BodyEstimate& identity, const std::vector<float>& angles) {
  return npt::from_own_rest(*npt::people_kind(), at_ease(), identity, angles);
}

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
  CHECK(own_rest(stylised) == 1);
  CHECK(own_rest(person) == 0);
  CHECK(from_own_rest(person, pose) == pose);
  CHECK(about_x(from_own_rest(stylised, pose), head) == doctest::Approx(0.3 + 0.2 + back).epsilon(1e-3));
  CHECK(own_rest(at_rest(head, 0.2F, 0.0095)) == doctest::Approx(0.5));
}

TEST_CASE("who moves isn't at rest, wherever it looks") {
  CHECK(own_rest(at_rest(left_shoulder, 0.8F, 0.012)) == 0);
  CHECK(own_rest(at_rest(left_hand, 0.8F, 0.012)) == 1);  // fingers
  CHECK(own_rest(npt::BodyEstimate{}) == 0);
  npt::BodyEstimate aside = at_rest(pelvis, 0, 0.012);
  aside.fit.body.axis_angles[1] = 2;
  CHECK(own_rest(aside) == 1);
  // The result looks where the pose does.
  const std::vector<float> pose(72, 0.0F);
  const npt::Vec3d front = rotation_of(from_own_rest(aside, pose), pelvis) * npt::Vec3d{0, 0, 1};
  CHECK(front.z > 0.99);
}
