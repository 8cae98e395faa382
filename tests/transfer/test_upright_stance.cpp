/// Motions from people to animals and back, by a posture that both can take.
#include <doctest/doctest.h>

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/motion_skeleton.hpp>
#include <npt/transfer/motion/upright_stance.hpp>
#include <npt/transfer/motion_transfer.hpp>

#include <body/roles/animal_skeleton.hpp>
#include <body/roles/skeletons.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace {

using npt::JointRole;
using npt::LimbPart;

npt::MotionSkeleton animal() {
  return npt::motion_skeleton(animal_skeleton::of_names(animal_skeleton::own_names()), "animal");
}
npt::MotionSkeleton person(bool moves) {
  skeletons::Person made = skeletons::person(skeletons::dialects().front());
  if (moves) skeletons::add_clip(made);
  return npt::motion_skeleton(made.motion, "person");
}

npt::MotionOptions across() {
  npt::MotionOptions options;
  options.across = true;
  options.retarget.key_tolerance = 0;
  return options;
}
npt::MotionOptions pose_across() {
  npt::MotionOptions options = across();
  options.time = 0;
  return options;
}

/// From one role's joint to another's, of length 1.
npt::Vec3d way(const npt::MotionSkeleton& skeleton, const std::vector<npt::Affine>& worlds, JointRole a, JointRole b) {
  return npt::normalised(worlds[skeleton.roles.joint(b)].shift - worlds[skeleton.roles.joint(a)].shift);
}
/// Which part of the bones of arms and legs points downwards, the least.
double hanging(const npt::MotionSkeleton& skeleton, const std::vector<npt::Affine>& worlds) {
  double least = 1;
  for (std::size_t side = 0; side < 2; ++side)
    for (const auto part : {LimbPart::upper_arm, LimbPart::upper_leg}) {
      const auto next = static_cast<LimbPart>(static_cast<int>(part) + 1);
      least = std::min(least, -way(skeleton, worlds, npt::limb_role(part, side), npt::limb_role(next, side)).y);
    }
  return least;
}

}  // namespace

TEST_CASE(
    "people and animals stand upright in the posture that both can take, "
    "their limbs along the trunk") {
  for (const npt::MotionSkeleton& skeleton : {animal(), person(false)}) {
    CAPTURE(skeleton.name);
    const auto worlds = npt::internal::UprightStance(skeleton.motion, skeleton.roles).worlds();
    CHECK(hanging(skeleton, worlds) > 0.999);
    CHECK(way(skeleton, worlds, JointRole::hips, JointRole::neck).y > 0.95);
    CHECK(way(skeleton, worlds, JointRole::neck, JointRole::head).y > 0.999);
    const std::vector<npt::Affine> rest = npt::bound_worlds(skeleton.motion);
    CHECK(npt::internal::lowest_of_legs(skeleton.roles, worlds) ==
          doctest::Approx(npt::internal::lowest_of_legs(skeleton.roles, rest)));
  }
}

TEST_CASE(
    "a person in an animal's stance is on hands and feet, an animal in a "
    "person's upright") {
  const npt::MotionSkeleton dog = animal(), hero = person(false);
  const npt::Motion crawls = npt::transfer_motion(dog, hero, pose_across()).motion;
  const std::vector<npt::Affine> on_four = npt::joint_worlds(crawls, 0.0);
  CHECK(hanging(hero, on_four) > 0.8);
  CHECK(way(hero, on_four, JointRole::hips, JointRole::neck).z > 0.9);
  const npt::Motion stands = npt::transfer_motion(hero, dog, pose_across()).motion;
  const std::vector<npt::Affine> upright = npt::joint_worlds(stands, 0.0);
  CHECK(way(dog, upright, JointRole::hips, JointRole::neck).y > 0.9);
  for (std::size_t side = 0; side < 2; ++side)  // the person stands in a T pose
    CHECK(
        std::abs(
            way(dog, upright, npt::limb_role(LimbPart::upper_arm, side), npt::limb_role(LimbPart::lower_arm, side)).x) >
        0.9);
}

TEST_CASE("a person's motion comes back from an animal as it was") {
  const npt::MotionSkeleton hero = person(true), dog = animal();
  npt::MotionSkeleton between = npt::motion_skeleton(npt::transfer_motion(hero, dog, across()).motion, "between");
  for (std::size_t j = 0; j < between.motion.joints.size(); ++j)
    between.motion.joints[j].bind = npt::bound_worlds(dog.motion)[j];
  const npt::Motion back = npt::transfer_motion(between, hero, across()).motion;
  for (const double time : {0.0, 0.3, 0.7}) {
    const std::vector<npt::Affine> a = npt::joint_worlds(back, time), b = npt::joint_worlds(hero.motion, time);
    for (std::size_t side = 0; side < 2; ++side)
      for (const auto part : {LimbPart::upper_arm, LimbPart::lower_arm, LimbPart::upper_leg, LimbPart::lower_leg}) {
        const std::size_t joint = hero.roles.joint(part, side);
        CHECK(std::abs(dot(npt::place_of(a[joint]).rotation, npt::place_of(b[joint]).rotation)) > 0.9999);
      }
  }
}
