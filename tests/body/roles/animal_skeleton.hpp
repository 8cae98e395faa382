/// A four-legged animal's skeleton for tests, of a metre's height, that stands along z.
#pragma once

#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace animal_skeleton {

struct Joint {
  std::string name, parent;
  npt::Vec3d place;
};

/// As in examples/sculpt/quadruped.plan.
inline std::vector<Joint> own_names() {
  std::vector<Joint> joints{{"pelvis", "", {0, 0.8, -0.5}},        {"spine1", "pelvis", {0, 0.82, -0.3}},
                            {"spine2", "spine1", {0, 0.82, -0.1}}, {"spine3", "spine2", {0, 0.82, 0.1}},
                            {"chest", "spine3", {0, 0.8, 0.3}},    {"neck1", "chest", {0, 0.85, 0.5}},
                            {"neck2", "neck1", {0, 0.95, 0.6}},    {"neck3", "neck2", {0, 1.05, 0.7}},
                            {"head", "neck3", {0, 1.12, 0.8}},     {"jaw", "head", {0, 1.08, 0.9}},
                            {"tail1", "pelvis", {0, 0.8, -0.6}},   {"tail2", "tail1", {0, 0.75, -0.7}},
                            {"tail3", "tail2", {0, 0.68, -0.78}},  {"tail4", "tail3", {0, 0.6, -0.84}},
                            {"tail5", "tail4", {0, 0.5, -0.88}}};
  for (const double side : {1.0, -1.0}) {
    const std::string s = side > 0 ? "l_" : "r_";
    joints.insert(joints.end(), {{s + "ear", "head", {0.05 * side, 1.2, 0.78}},
                                 {s + "scapula", "chest", {0.06 * side, 0.75, 0.36}},
                                 {s + "shoulder", s + "scapula", {0.14 * side, 0.72, 0.4}},
                                 {s + "elbow", s + "shoulder", {0.14 * side, 0.48, 0.3}},
                                 {s + "wrist", s + "elbow", {0.14 * side, 0.22, 0.34}},
                                 {s + "forefoot", s + "wrist", {0.14 * side, 0.04, 0.38}},
                                 {s + "hip", "pelvis", {0.12 * side, 0.75, -0.52}},
                                 {s + "knee", s + "hip", {0.12 * side, 0.5, -0.4}},
                                 {s + "hock", s + "knee", {0.12 * side, 0.25, -0.62}},
                                 {s + "hindfoot", s + "hock", {0.12 * side, 0.04, -0.55}}});
  }
  return joints;
}

/// Parents stand before children, and a joint's descendants right behind it.
inline npt::Motion of_names(const std::vector<Joint>& joints) {
  npt::Motion motion;
  std::vector<npt::Vec3d> places;
  const auto add = [&](const auto& self, const std::string& name, std::size_t parent, npt::Vec3d origin) -> void {
    for (const Joint& joint : joints) {
      if (joint.parent != name) continue;
      npt::MotionJoint made{.name = joint.name, .parent = parent};
      made.rest.translation = joint.place - origin;
      motion.joints.push_back(std::move(made));
      self(self, joint.name, motion.joints.size() - 1, joint.place);
    }
  };
  add(add, "", npt::no_item, {});
  return motion;
}

/// All of it, by an axis angle.
inline npt::Motion turned(npt::Motion motion, npt::Vec3d by) {
  const npt::Quaternion turn = npt::Quaternion{}.turned(by);
  motion.joints.front().rest.translation = turn(motion.joints.front().rest.translation);
  motion.joints.front().rest.rotation = turn;
  return motion;
}
/// What hangs from a joint.
inline npt::Motion turned_behind(npt::Motion motion, const std::string& name, npt::Vec3d by) {
  for (npt::MotionJoint& joint : motion.joints)
    if (joint.name == name) joint.rest.rotation = npt::Quaternion{}.turned(by);
  return motion;
}

}  // namespace animal_skeleton
