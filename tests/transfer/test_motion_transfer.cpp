#include <doctest/doctest.h>

#include <npt/base/vec3.hpp>
#include <npt/body/roles/bone_map.hpp>
#include <npt/scene/motion.hpp>
#include <npt/transfer/motion/motion_checks.hpp>
#include <npt/transfer/motion/motion_skeleton.hpp>
#include <npt/transfer/motion/motion_warning.hpp>
#include <npt/transfer/motion_transfer.hpp>
#include <npt/transfer/retarget.hpp>

#include <body/roles/skeletons.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <utility>

namespace {

using npt::JointRole;
using npt::LimbPart;

npt::Motion dancer() {
  skeletons::Person source = skeletons::person(skeletons::dialects()[0]);
  skeletons::add_clip(source);
  return source.motion;
}
npt::Motion standing(const skeletons::Options& options = {.rolls = true}) {
  return skeletons::person(skeletons::dialects()[2], options).motion;
}

/// A trunk along z with four legs, a neck and a tail, which trots.
npt::Motion horse() {
  npt::Motion motion;
  const auto add = [&motion](const char* name, std::size_t parent, npt::Vec3d place) {
    motion.joints.push_back({.name = name, .parent = parent, .rest = {.translation = place}});
    return motion.joints.size() - 1;
  };
  const std::size_t pelvis = add("a", npt::no_item, {0, 1.4, 0});
  for (const double x : {0.2, -0.2}) {
    const std::size_t hip = add("b", pelvis, {x, 0, 0});
    add("d", add("c", hip, {0, -0.6, 0.1}), {0, -0.7, -0.1});
  }
  std::size_t tail = pelvis;
  for (int i = 0; i < 5; ++i) tail = add("e", tail, {0, -0.15, -0.15});
  std::size_t chest = pelvis;
  for (int i = 0; i < 4; ++i) chest = add("f", chest, {0, 0, 0.4});
  for (const double x : {0.2, -0.2}) {
    const std::size_t hip = add("g", chest, {x, 0, 0});
    add("i", add("h", hip, {0, -0.6, 0.05}), {0, -0.7, 0});
  }
  add("l", add("k", chest, {0, 0.5, 0.3}), {0, 0.2, 0.3});
  motion.clip.name = "trot";
  motion.clip.channels.push_back(
      {0, npt::ChannelPath::translation, npt::Interpolation::linear, 3, {0, 1}, {0, 1.4F, 0, 0, 1.4F, 3}});
  return motion;
}

npt::ErrorParts refusal_of(const npt::Motion& source, const npt::BoneMapText& map = {}) {
  try {
    npt::transfer_motion(npt::motion_skeleton(source, "walk.bvh", map), npt::motion_skeleton(standing(), "hero.glb"));
  } catch (const npt::Error& error) {
    return error.parts();
  }
  return {.file = "no error"};
}

}  // namespace

TEST_CASE("a clip goes onto the target's own joints, as retarget() puts it there") {
  const npt::MotionSkeleton source = npt::motion_skeleton(dancer(), "dance.bvh");
  const npt::MotionSkeleton target = npt::motion_skeleton(standing(), "hero.glb");
  const npt::MotionResult made = npt::transfer_motion(source, target, {.clip_name = "mine"});
  CHECK(made.motion.clip.name == "mine");
  CHECK(made.confidence > 0.9);
  CHECK(made.warnings.empty());
  REQUIRE(made.motion.joints.size() == target.motion.joints.size());
  CHECK(made.motion.joints[3].name == target.motion.joints[3].name);
  const npt::Motion alone = npt::retarget(source.motion, source.roles, target.motion, target.roles);
  const auto a = npt::joint_positions(made.motion, 1.2), b = npt::joint_positions(alone, 1.2);
  for (std::size_t j = 0; j < a.size(); ++j) CHECK(npt::length(a[j] - b[j]) < 1e-9);
}

TEST_CASE("a clip's pose at a time, and its frames at a rate") {
  const npt::MotionSkeleton source = npt::motion_skeleton(dancer(), "dance.bvh");
  const npt::MotionSkeleton target = npt::motion_skeleton(standing(), "hero.glb");
  const npt::Motion whole = npt::transfer_motion(source, target).motion;
  const npt::Motion pose = npt::transfer_motion(source, target, {.time = 0.5}).motion;
  CHECK(pose.clip.length() == 0);
  const auto a = npt::joint_positions(pose, 0.0), b = npt::joint_positions(whole, 0.5);
  for (std::size_t j = 0; j < a.size(); ++j) CHECK(npt::length(a[j] - b[j]) < 1e-5);
  const npt::Motion coarse = npt::transfer_motion(source, target, {.rate = 10}).motion;
  CHECK(coarse.rate == 10);
  CHECK(coarse.clip.length() == doctest::Approx(2));
  CHECK_THROWS_WITH_AS(npt::transfer_motion(source, target, {.time = 3}),
                       "dance.bvh: found a time of 3.000000 s, expected at most 2.000000 s, the clip's length",
                       npt::Error);
}

TEST_CASE("bad clips are refused by file, joint, what was found and what was expected") {
  npt::Motion nan = dancer();
  nan.clip.channels[4].values[9] = std::numeric_limits<float>::quiet_NaN();
  npt::ErrorParts parts = refusal_of(nan);
  CHECK(parts.file == "walk.bvh");
  CHECK(parts.place == "joint '" + nan.joints[nan.clip.channels[4].node].name + "'");
  CHECK(parts.found == "NaN in key 2 (rotation, 0.06666667 s)");
  CHECK(parts.expected == "finite numbers");

  npt::Motion ring = dancer();
  ring.joints[1].parent = 2;
  CHECK(refusal_of(ring).found == "joints that form a ring");
  CHECK(refusal_of(ring).place == "joint 'mixamorig:Spine'");
  npt::Motion own_parent = dancer();
  own_parent.joints[0].parent = 0;
  CHECK(refusal_of(own_parent).found == "joints that form a ring");

  npt::Motion still = dancer();
  for (npt::ClipChannel& channel : still.clip.channels) {
    channel.times.resize(1);
    channel.values.resize(channel.width);
  }
  CHECK(refusal_of(still).found == "a length of 0 s");
  CHECK(refusal_of(standing()).found == "a skeleton without a clip");

  CHECK(refusal_of(dancer(), {"hips - 1\n", "map.txt"}).found == "no hips");
  CHECK(refusal_of(horse()).found.starts_with("a four-legged animal's motion on a person ("));
  npt::Motion snake;
  for (std::size_t j = 0; j < 20; ++j) {
    snake.joints.push_back({.name = "Bone", .parent = j == 0 ? npt::no_item : j - 1});
    snake.joints.back().rest.translation = {0, 0, 1};
  }
  parts = refusal_of(snake);
  CHECK(parts.code == npt::ErrorCode::not_recognised);
  CHECK(parts.found.starts_with("a skeleton that is not recognised as a person's (confidence "));
  npt::Motion late = dancer();
  late.rate = 0;
  late.clip.channels[0].times.back() = 1e7F;
  CHECK(refusal_of(late).expected == "at most 100000 frames");
  late.rate = 1000;  // of two keys a millisecond apart, and one much later
  late.clip.channels[0].times.back() = 14400;
  CHECK(refusal_of(late).expected == "at most 100000 frames");
  npt::Motion torn = dancer();
  torn.clip.channels[0].values.pop_back();
  CHECK(refusal_of(torn).found == "keys that aren't whole");
  torn = dancer();
  torn.clip.channels[0].times[3] = 0;
  CHECK(refusal_of(torn).expected == "times from 0 on that ascend");
}

TEST_CASE("a bone map goes before what is found, and says what names hide") {
  npt::Motion nameless = dancer();
  const npt::JointRoles known = npt::joint_roles(nameless);
  const std::string map = npt::format_bone_map(nameless, known);
  const npt::MotionSkeleton source = npt::motion_skeleton(nameless, "dance.bvh", {map, "map.txt"});
  CHECK(source.roles.joints == known.joints);
  CHECK(source.roles.confidence > 0.9);
  CHECK_THROWS_WITH_AS(npt::motion_skeleton(nameless, "dance.bvh", {"hips nobody\n", "map.txt"}),
                       "map.txt: line 1: found no joint 'nobody', expected one of the skeleton's joints", npt::Error);
}

TEST_CASE("main joints that only one of the skeletons has are named") {
  const npt::MotionSkeleton source = npt::motion_skeleton(dancer(), "dance.bvh");
  const npt::MotionSkeleton target =
      npt::motion_skeleton(standing(), "hero.glb", {"leftLowerArm - 1\nrightLowerArm - 1\n", "map.txt"});
  const npt::MotionResult made = npt::transfer_motion(source, target);
  REQUIRE(made.warnings.size() == 1);
  CHECK(made.warnings[0].skeleton == npt::MeshRole::identity);
  CHECK(npt::text_of(made.warnings[0], "hero.glb", "dance.bvh") ==
        "hero.glb has no joint for both LowerArm: what the clip does with it is left out");
  const npt::MotionResult back =
      npt::transfer_motion(npt::motion_skeleton(dancer(), "dance.bvh", {"leftLowerLeg - 1\n", "map.txt"}),
                           npt::motion_skeleton(standing(), "x"));
  REQUIRE(back.warnings.size() == 1);
  CHECK(npt::text_of(back.warnings[0], "x", "dance.bvh") ==
        "dance.bvh has no joint for leftLowerLeg: it stays in the character's rest");
}
