#include <doctest/doctest.h>

#include <npt/body/mannequin/mannequin.hpp>
#include <npt/mesh/points.hpp>
#include <npt/scene/pose.hpp>
#include <npt/transfer/motion/character_motion.hpp>

#include <body/roles/skeletons.hpp>

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "shipped.hpp"

namespace {

npt::Motion walking() {
  skeletons::Person source = skeletons::person(skeletons::dialects()[0]);
  skeletons::add_clip(source);
  return source.motion;
}

}  // namespace

TEST_CASE("the skeleton of a character is bound in the body's rest, on the mesh's ground") {
  const npt::Motion motion = npt::motion_of(shipped::character());
  CHECK(motion.joints.size() == 40);
  const auto bound = npt::bound_worlds(motion);
  const npt::JointRoles roles = npt::motion_skeleton(shipped::character(), "hero").roles;
  CHECK(roles.joints == npt::joint_roles(motion).joints);
  for (std::size_t side = 0; side < 2; ++side) {  // a T pose, though the mesh's knee and arms are bent
    const auto at = [&](npt::LimbPart part) { return bound[roles.joint(part, side)].shift; };
    const npt::Vec3d arm = npt::normalised(at(npt::LimbPart::lower_arm) - at(npt::LimbPart::upper_arm));
    CHECK(std::abs(arm.y) < 0.15);
    CHECK(std::abs(npt::length(at(npt::LimbPart::foot) - at(npt::LimbPart::lower_leg)) - 0.4) < 0.1);
  }
  const npt::Motion scaled = npt::motion_of(shipped::character(), npt::JointNames::mixamo, 0.01);
  CHECK(scaled.joints[0].name == "mixamorig:Hips");
  CHECK(npt::length(npt::bound_worlds(scaled)[5].shift - bound[5].shift * 0.01) < 1e-12);
}

TEST_CASE("a clip without a mesh moves a character that has no joints of its own") {
  const npt::Character& hero = shipped::character();
  const npt::MotionResult made = shipped::human().retarget(hero, walking());
  CHECK(made.warnings.empty());
  const npt::Mesh mesh = shipped::person(0.1F);
  const npt::Scene scene = npt::scene_with_motions(mesh, "hero", *hero.skeleton(), {&made.motion, 1});
  REQUIRE(scene.clips.size() == 1);
  const npt::ScenePoser poser(scene);
  // As retarget() has them: the joints of the scene.
  const npt::ScenePose pose = poser.pose(&scene.clips[0], 1.3);
  const std::vector<npt::Affine> worlds = npt::joint_worlds(made.motion, 1.3);
  for (std::size_t j = 0; j < worlds.size(); ++j) {
    const std::size_t node = scene.skins[0].joints[made.motion.joints[j].node];
    CHECK(npt::length(pose.worlds[node].shift - worlds[j].shift) < 1e-6);
  }
  // The hips went as the source's, which went 1.6 m.
  const auto first = npt::joint_positions(made.motion, 0.0), last = npt::joint_positions(made.motion, 2.0);
  CHECK((last[0] - first[0]).z > 1.2);
}

TEST_CASE("what is no person, and what another transfer prepared, takes no clip") {
  const npt::Character none = shipped::human().character(shipped::ball(), "ball");
  CHECK(shipped::error_of([&] { shipped::human().retarget(none, walking()); }).code == npt::ErrorCode::not_recognised);
  const npt::PoseTransfer other = npt::PoseTransfer::open(shipped::weights(), {}, 1);
  CHECK(shipped::error_of([&] { other.retarget(shipped::character(), walking()); }).code == npt::ErrorCode::foreign);
}
