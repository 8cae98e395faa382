/// Clips whose skeleton has no skin, and whose rest is a pose of the clip.
#include <doctest/doctest.h>

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/scene/motion.hpp>
#include <npt/transfer/motion/straight_stance.hpp>
#include <npt/transfer/retarget.hpp>

#include <body/roles/skeletons.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace straight_stance {

using npt::JointRole;
using npt::LimbPart;

npt::Quaternion turn(npt::Vec3d axis_times_angle) { return npt::Quaternion{}.turned(axis_times_angle); }

/// The joints' rotations in a run: a thigh raised, knees and elbows bent, the chest twisted, all turned by 17 degrees.
npt::Quaternion run_turn(JointRole role) {
  using enum LimbPart;
  npt::Quaternion turned{};
  if (role >= JointRole::upper_chest && role <= JointRole::head) turned = turn({0, 0.25, 0});
  if (npt::is_of_limb(role)) {
    const std::size_t side = npt::side_of(role);
    const LimbPart part = npt::part_of(role);
    const double x = side == 0 ? 1 : -1;
    if (part == upper_leg) turned = turn({side == 0 ? -0.9 : 0.2, 0, 0});
    if (part == lower_leg || part == foot || part == toes) turned = turn({side == 0 ? 0.7 : 1.0, 0, 0});
    if (part == shoulder) turned = turn({0, 0.25, 0});
    if (part == upper_arm) turned = turn({0, 0.25, 0}) * turn({0, 0, -1.2 * x});
    if (part == lower_arm || part == hand || npt::is_of_digit(role))
      turned = turn({0, 0.25, 0}) * turn({0, 0, -1.2 * x}) * turn({0, -1.3 * x, 0});
  }
  return turn({0, 0.3, 0}) * turned;
}

/// The same skeleton and clip, whose rest is a pose of a run.
skeletons::Person with_rest_of_a_run(skeletons::Person person) {
  const std::vector<npt::Affine> before = npt::joint_worlds(person.motion, std::nullopt);
  std::vector<npt::Quaternion> now;
  for (std::size_t j = 0; j < before.size(); ++j) {
    npt::MotionJoint& joint = person.motion.joints[j];
    now.push_back(run_turn(person.roles[j]) * npt::place_of(before[j]).rotation);
    if (joint.parent == npt::no_item)
      joint.rest.rotation = now[j];
    else
      joint.rest.rotation = npt::normalised(npt::inverse(now[joint.parent]) * now[j]);
  }
  return person;
}

double degrees(const npt::Quaternion& a, const npt::Quaternion& b) {
  return 2 * std::acos(std::min(1.0, std::abs(npt::dot(a, b)))) * 57.29577951308232;
}

/// The joints' rotations in the world that two motions on one skeleton differ by, in degrees, ascending.
std::vector<double> differences(const npt::Motion& a, const npt::Motion& b) {
  std::vector<double> all;
  for (const double time : {0.0, 0.5, 1.3, 2.0}) {
    const auto one = npt::joint_worlds(a, time), other = npt::joint_worlds(b, time);
    for (std::size_t j = 0; j < one.size(); ++j)
      all.push_back(degrees(npt::place_of(one[j]).rotation, npt::place_of(other[j]).rotation));
  }
  std::sort(all.begin(), all.end());
  return all;
}

npt::Motion on(const skeletons::Person& source, const skeletons::Person& target) {
  return npt::retarget(source.motion, npt::joint_roles(source.motion), target.motion, npt::joint_roles(target.motion),
                       npt::RetargetOptions::plain());
}

TEST_CASE("a clip whose rest is a pose of a run gives the motion of one that stands at rest") {
  skeletons::Person source = skeletons::person(skeletons::dialects()[0]);
  skeletons::add_clip(source);
  const skeletons::Person runs = with_rest_of_a_run(source);
  CHECK(npt::internal::StraightStance(runs.motion, npt::joint_roles(runs.motion)).is_needed());
  for (const bool rolls : {false, true}) {
    const skeletons::Person target = skeletons::person(skeletons::dialects()[2], {.rolls = rolls});
    const std::vector<double> off = differences(on(source, target), on(runs, target));
    MESSAGE("median " << off[off.size() / 2] << ", largest " << off.back());
    CHECK(off[off.size() / 2] < 2);
    CHECK(off.back() < 8);
  }
}

TEST_CASE("a rest that stands, and one that has a bind pose, are taken as they are") {
  for (const double below : {0.0, 45.0, 80.0}) {
    const skeletons::Person person = skeletons::person(skeletons::dialects()[0], {.arms_below = below, .rolls = true});
    CHECK(!npt::internal::StraightStance(person.motion, npt::joint_roles(person.motion)).is_needed());
  }
  const skeletons::Person stands = skeletons::person(skeletons::dialects()[0]);
  skeletons::Person runs = with_rest_of_a_run(stands);
  const std::vector<npt::Affine> bound = npt::joint_worlds(stands.motion, std::nullopt);
  for (std::size_t j = 0; j < bound.size(); ++j) runs.motion.joints[j].bind = bound[j];
  CHECK(!npt::internal::StraightStance(runs.motion, npt::joint_roles(runs.motion)).is_needed());
}

TEST_CASE("who is stood up keeps the lowest joint where it was, and the bones' lengths") {
  const skeletons::Person runs = with_rest_of_a_run(skeletons::person(skeletons::dialects()[0], {.rolls = true}));
  const npt::JointRoles roles = npt::joint_roles(runs.motion);
  const std::vector<npt::Affine> rest = npt::bound_worlds(runs.motion);
  const std::vector<npt::Affine> stood = npt::internal::reference_pose(runs.motion, roles);
  double before = 1, after = 1;
  for (std::size_t j = 1; j < rest.size(); ++j) {
    const std::size_t parent = runs.motion.joints[j].parent;
    CHECK(npt::length(stood[j].shift - stood[parent].shift) ==
          doctest::Approx(npt::length(rest[j].shift - rest[parent].shift)));
    before = std::min(before, rest[j].shift.y), after = std::min(after, stood[j].shift.y);
  }
  CHECK(after == doctest::Approx(before));
  const auto at = [&](LimbPart part, std::size_t side) { return stood[roles.joint(part, side)].shift; };
  for (std::size_t side = 0; side < 2; ++side) {
    CHECK(npt::normalised(at(LimbPart::lower_leg, side) - at(LimbPart::upper_leg, side)).y < -0.999);
    CHECK(std::abs(npt::normalised(at(LimbPart::hand, side) - at(LimbPart::upper_arm, side)).x) > 0.95);
  }
}

}  // namespace straight_stance
