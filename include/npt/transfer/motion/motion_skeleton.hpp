/// A motion, or the skeleton of a character, whose joints' roles are known: checked and looked at once, for many.
///   MotionSkeleton walk = motion_skeleton(motion, "walk.bvh");
///   MotionSkeleton hero = motion_skeleton(scene, "hero.glb");                 of a character
///   MotionSkeleton mine = motion_skeleton(scene, "mine.glb", {text, "bones.txt"});
/// Errors    npt::Error that names the file: a scene without a skeleton, joints that form a ring, keys that are no
///           numbers, a skeleton that is recognised as nobody's, one without hips, a bone map that doesn't fit
#pragma once

#include <npt/base/error.hpp>
#include <npt/body/roles/bone_map.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_of_scene.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/body_shape.hpp>
#include <npt/transfer/motion/motion_checks.hpp>
#include <npt/transfer/motion/motion_warning.hpp>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A bone map as text (body/roles/bone_map.hpp), and its file for the messages of errors; empty: joints as found.
struct BoneMapText {
  std::string text{};
  std::string file = "bone map";
};

struct MotionSkeleton {
  Motion motion{};
  JointRoles roles{};
  BodyShape shape{};  ///< empty where no mesh is known
  std::string name{};
};

/// The confidence below which a skeleton isn't taken for a person's or an animal's, unless a bone map says it. Of 53
/// figures all are above, a head and two arms alone (0.34) as well.
inline constexpr double least_skeleton_confidence = 0.3;

namespace internal {

/// Of roles that people said: the mean of the main ones.
inline double mapped_confidence(const JointRoles& roles) {
  const std::vector<JointRole> all = main_roles();
  double sum = 0;
  for (const JointRole role : all) sum += roles.confidence_of(role);
  return sum / static_cast<double>(all.size());
}

inline ErrorParts unknown_skeleton(const MotionSkeleton& skeleton) {
  const auto percent = [&](SkeletonKind kind) {
    return std::to_string(std::lround(100 * joint_roles(skeleton.motion, kind).confidence)) + " %)";
  };
  return {.file = skeleton.name,
          .found = "a skeleton that is not recognised as a person's (confidence " + percent(SkeletonKind::person) +
                   ", nor as a four-legged animal's (" + percent(SkeletonKind::four_legged),
          .expected = "one of both, or a bone map (--bone-map) that says which joint is which",
          .code = ErrorCode::not_recognised};
}

}  // namespace internal

/// `name`: of its file, for messages. `scene`: that the motion was made of, for the shape of the body; nullptr: none
inline MotionSkeleton motion_skeleton(Motion motion, std::string name, const BoneMapText& map = {},
                                      const Scene* scene = nullptr) {
  expect_motion(motion, name);
  MotionSkeleton made{std::move(motion), {}, {}, std::move(name)};
  made.roles = joint_roles(made.motion);
  if (map.text.empty() && made.roles.confidence < least_skeleton_confidence)
    throw Error(internal::unknown_skeleton(made));
  if (!map.text.empty()) {
    made.roles = parse_bone_map(map.text, made.motion, made.roles, map.file);
    made.roles.confidence = internal::mapped_confidence(made.roles);
  }
  if (made.roles.joint(JointRole::hips) == no_item)
    throw Error({.file = made.name, .found = "no hips", .expected = "a joint that carries legs and spine"});
  if (scene != nullptr) made.shape = body_shape(*scene, made.motion, made.roles);
  return made;
}

/// Of a character: the skeleton of its skins.
inline MotionSkeleton motion_skeleton(const Scene& scene, const std::string& name, const BoneMapText& map = {}) {
  return motion_skeleton(motion_of(scene, nullptr, name), name, map, &scene);
}

}  // namespace npt::inline NPT_ABI
