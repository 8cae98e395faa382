/// Skeletons of people for tests, in the names of a dialect, in a T or an A pose, with bone frames of any roll.
#pragma once

#include <npt/base/quaternion.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace skeletons {

/// '@' stands for the side's word; '#' in digits for their joints' words. Empty: the rig has no such joint.
struct Names {
  std::string dialect;
  std::array<std::string, 2> sides;
  std::array<std::string, npt::middle_role_count> middle;
  std::array<std::string, 8> limb;
  std::array<std::string, npt::digit_count> digits;
  std::array<std::string, 3> joints;
};

inline const std::vector<Names>& dialects() {
  static const std::vector<Names> all{
      {"Mixamo, HumanIK",
       {"Left", "Right"},
       {"mixamorig:Hips", "mixamorig:Spine", "mixamorig:Spine1", "mixamorig:Spine2", "mixamorig:Neck",
        "mixamorig:Head"},
       {"mixamorig:@Shoulder", "mixamorig:@Arm", "mixamorig:@ForeArm", "mixamorig:@Hand", "mixamorig:@UpLeg",
        "mixamorig:@Leg", "mixamorig:@Foot", "mixamorig:@ToeBase"},
       {"mixamorig:@HandThumb#", "mixamorig:@HandIndex#", "mixamorig:@HandMiddle#", "mixamorig:@HandRing#",
        "mixamorig:@HandPinky#"},
       {"1", "2", "3"}},
      {"Mixamo, HumanIK",
       {"Left", "Right"},
       {"Character1_Hips", "Character1_Spine", "Character1_Spine1", "Character1_Spine2", "Character1_Neck",
        "Character1_Head"},
       {"Character1_@Shoulder", "Character1_@Arm", "Character1_@ForeArm", "Character1_@Hand", "Character1_@UpLeg",
        "Character1_@Leg", "Character1_@Foot", "Character1_@ToeBase"},
       {"Character1_@HandThumb#", "Character1_@HandIndex#", "Character1_@HandMiddle#", "Character1_@HandRing#",
        "Character1_@HandPinky#"},
       {"1", "2", "3"}},
      {"Unreal",
       {"l", "r"},
       {"pelvis", "spine_01", "spine_02", "spine_03", "neck_01", "head"},
       {"clavicle_@", "upperarm_@", "lowerarm_@", "hand_@", "thigh_@", "calf_@", "foot_@", "ball_@"},
       {"thumb_#_@", "index_#_@", "middle_#_@", "ring_#_@", "pinky_#_@"},
       {"01", "02", "03"}},
      {"VRM 1",
       {"left", "right"},
       {"hips", "spine", "chest", "upperChest", "neck", "head"},
       {"@Shoulder", "@UpperArm", "@LowerArm", "@Hand", "@UpperLeg", "@LowerLeg", "@Foot", "@Toes"},
       {"@Thumb#", "@Index#", "@Middle#", "@Ring#", "@Little#"},
       {"Proximal", "Intermediate", "Distal"}},
      {"VRoid",
       {"L", "R"},
       {"J_Bip_C_Hips", "J_Bip_C_Spine", "J_Bip_C_Chest", "J_Bip_C_UpperChest", "J_Bip_C_Neck", "J_Bip_C_Head"},
       {"J_Bip_@_Shoulder", "J_Bip_@_UpperArm", "J_Bip_@_LowerArm", "J_Bip_@_Hand", "J_Bip_@_UpperLeg",
        "J_Bip_@_LowerLeg", "J_Bip_@_Foot", "J_Bip_@_ToeBase"},
       {"J_Bip_@_Thumb#", "J_Bip_@_Index#", "J_Bip_@_Middle#", "J_Bip_@_Ring#", "J_Bip_@_Little#"},
       {"1", "2", "3"}},
      {"Biped",
       {"L", "R"},
       {"Bip001 Pelvis", "Bip001 Spine", "Bip001 Spine1", "Bip001 Spine2", "Bip001 Neck", "Bip001 Head"},
       {"Bip001 @ Clavicle", "Bip001 @ UpperArm", "Bip001 @ Forearm", "Bip001 @ Hand", "Bip001 @ Thigh",
        "Bip001 @ Calf", "Bip001 @ Foot", "Bip001 @ Toe0"},
       {"Bip001 @ Finger0#", "Bip001 @ Finger1#", "Bip001 @ Finger2#", "Bip001 @ Finger3#", "Bip001 @ Finger4#"},
       {"", "1", "2"}},
      {"CMU, ASF",
       {"l", "r"},
       {"root", "lowerback", "upperback", "thorax", "lowerneck", "head"},
       {"@clavicle", "@humerus", "@radius", "@wrist", "@femur", "@tibia", "@foot", "@toes"},
       {},
       {}},
      {"Daz Genesis 8",
       {"l", "r"},
       {"hip", "abdomenLower", "abdomenUpper", "chestLower", "neckLower", "head"},
       {"@Collar", "@ShldrBend", "@ForearmBend", "@Hand", "@ThighBend", "@Shin", "@Foot", "@Toe"},
       {"@Thumb#", "@Index#", "@Mid#", "@Ring#", "@Pinky#"},
       {"1", "2", "3"}},
      {"Poser",
       {"l", "r"},
       {"hip", "abdomen", "chest", "", "neck", "head"},
       {"@Collar", "@Shldr", "@Forearm", "@Hand", "@Thigh", "@Shin", "@Foot", "@Toe"},
       {"@Thumb#", "@Index#", "@Mid#", "@Ring#", "@Pinky#"},
       {"1", "2", "3"}},
      {"Rigify",
       {"L", "R"},
       {"DEF-spine", "DEF-spine.001", "DEF-spine.002", "DEF-spine.003", "DEF-spine.004", "DEF-spine.006"},
       {"DEF-shoulder.@", "DEF-upper_arm.@", "DEF-forearm.@", "DEF-hand.@", "DEF-thigh.@", "DEF-shin.@", "DEF-foot.@",
        "DEF-toe.@"},
       {"DEF-thumb.#.@", "DEF-f_index.#.@", "DEF-f_middle.#.@", "DEF-f_ring.#.@", "DEF-f_pinky.#.@"},
       {"01", "02", "03"}},
      {"SMPL",
       {"left", "right"},
       {"pelvis", "spine1", "spine2", "spine3", "neck", "head"},
       {"@_collar", "@_shoulder", "@_elbow", "@_wrist", "@_hip", "@_knee", "@_ankle", "@_foot"},
       {"@_thumb#", "@_index#", "@_middle#", "@_ring#", "@_pinky#"},
       {"1", "2", "3"}},
      {"Reallusion",
       {"L", "R"},
       {"CC_Base_Hip", "CC_Base_Waist", "CC_Base_Spine01", "CC_Base_Spine02", "CC_Base_NeckTwist01", "CC_Base_Head"},
       {"CC_Base_@_Clavicle", "CC_Base_@_Upperarm", "CC_Base_@_Forearm", "CC_Base_@_Hand", "CC_Base_@_Thigh",
        "CC_Base_@_Calf", "CC_Base_@_Foot", "CC_Base_@_ToeBase"},
       {"CC_Base_@_Thumb#", "CC_Base_@_Index#", "CC_Base_@_Mid#", "CC_Base_@_Ring#", "CC_Base_@_Pinky#"},
       {"1", "2", "3"}},
      {"MikuMikuDance",
       {"左", "右"},
       {"下半身", "上半身", "上半身2", "", "首", "頭"},
       {"@肩", "@腕", "@ひじ", "@手首", "@足", "@ひざ", "@足首", "@つま先"},
       {"", "@人指#", "@中指#", "@薬指#", "@小指#"},
       {"１", "２", "３"}}};
  return all;
}

inline std::string replaced(std::string text, char what, const std::string& by) {
  if (const std::size_t at = text.find(what); at != std::string::npos) text.replace(at, 1, by);
  return text;
}

struct Options {
  double arms_below = 0;   ///< degrees below level
  double size = 1;         ///< times a body of 1.75 m
  double leg = 1;          ///< times the usual length
  bool rolls = false;      ///< bones have frames of their own
  bool backwards = false;  ///< looks along -z
  std::size_t spine = 3;   ///< joints between hips and neck
};

/// A person and the role that each joint is made for.
struct Person {
  npt::Motion motion;
  std::vector<npt::JointRole> roles;

  std::size_t joint(npt::JointRole role) const {
    return static_cast<std::size_t>(std::ranges::find(roles, role) - roles.begin());
  }
};

class Maker {
 public:
  Maker(const Names& names, const Options& options) : names_(names), options_(options) {}

  Person make() {
    using enum npt::LimbPart;
    const double leg = options_.leg;
    const auto hips = add(npt::JointRole::hips, names_.middle[0], npt::no_item, {0, 0.95 * leg, 0});
    auto top = hips;
    for (std::size_t i = 1; i < 4 && i <= options_.spine; ++i)
      top = add(static_cast<npt::JointRole>(i), names_.middle[i], top,
                {0, 0.95 * leg + 0.13 * static_cast<double>(i), 0});
    const double chest = 0.95 * leg + 0.39;
    const auto neck = add(npt::JointRole::neck, names_.middle[4], top, {0, chest + 0.18, 0});
    add(npt::JointRole::head, names_.middle[5], neck, {0, chest + 0.28, 0.02});
    for (std::size_t side = 0; side < 2; ++side) {
      const double x = side == 0 ? 1 : -1;
      const double below = options_.arms_below * 0.017453292519943295;
      const npt::Vec3d out{x * std::cos(below), -std::sin(below), 0}, shoulder{x * 0.17, chest + 0.12, -0.02};
      auto at = limb(npt::LimbPart::shoulder, side, top, {x * 0.03, chest + 0.11, 0});
      at = limb(upper_arm, side, at, shoulder);
      at = limb(lower_arm, side, at, shoulder + out * 0.28 + npt::Vec3d{0, 0, -0.01});
      const npt::Vec3d wrist = shoulder + out * 0.53;
      const auto hand = limb(npt::LimbPart::hand, side, at, wrist);
      for (std::size_t d = 0; d < npt::digit_count && hand != npt::no_item; ++d) {
        auto joint = hand;
        const npt::Vec3d base = wrist + out * (d == 0 ? 0.03 : 0.09) +
                                npt::Vec3d{0, 0, d == 0 ? 0.04 : 0.03 - 0.02 * static_cast<double>(d - 1)};
        for (std::size_t i = 0; i < 3; ++i)
          joint = digit(d, i, side, joint, base + out * (0.03 * static_cast<double>(i)));
      }
      at = limb(upper_leg, side, hips, {x * 0.09, 0.9 * leg, 0});
      at = limb(lower_leg, side, at, {x * 0.09, 0.49 * leg, 0.01});
      at = limb(foot, side, at, {x * 0.09, 0.08 * leg, -0.02});
      limb(toes, side, at, {x * 0.1, 0.02, 0.1});
    }
    finish();
    return std::move(person_);
  }

 private:
  std::size_t add(npt::JointRole role, const std::string& name, std::size_t parent, npt::Vec3d place) {
    if (name.empty()) return parent;
    if (options_.backwards) place = {-place.x, place.y, -place.z};
    person_.motion.joints.push_back({.name = name, .parent = parent});
    person_.roles.push_back(role);
    places_.push_back(place * options_.size);
    return places_.size() - 1;
  }
  std::size_t limb(npt::LimbPart part, std::size_t side, std::size_t parent, npt::Vec3d place) {
    return add(npt::limb_role(part, side),
               replaced(names_.limb[static_cast<std::size_t>(part)], '@', names_.sides[side]), parent, place);
  }
  std::size_t digit(std::size_t d, std::size_t i, std::size_t side, std::size_t parent, npt::Vec3d place) {
    std::string name = replaced(replaced(names_.digits[d], '@', names_.sides[side]), '#', names_.joints[i]);
    if (names_.dialect == "VRM 1" && d == 0 && i < 2)
      name = names_.sides[side] + (i == 0 ? "ThumbMetacarpal" : "ThumbProximal");
    return add(npt::limb_role(npt::digit_part(d, i), side), name, parent, place);
  }

  /// Places in the parents, where each joint may have a frame of its own.
  void finish() {
    std::vector<npt::Quaternion> frames;
    for (std::size_t j = 0; j < places_.size(); ++j) {
      const auto angle = static_cast<double>(j);
      frames.push_back(options_.rolls
                           ? npt::Quaternion{}.turned({std::sin(angle), std::cos(2 * angle), 0.7 * std::sin(3 * angle)})
                           : npt::Quaternion{});
      npt::MotionJoint& joint = person_.motion.joints[j];
      const bool root = joint.parent == npt::no_item;
      const npt::Quaternion above = root ? npt::Quaternion{} : frames[joint.parent];
      joint.rest.rotation = npt::normalised(npt::inverse(above) * frames[j]);
      joint.rest.translation = root ? places_[j] : npt::inverse(above)(places_[j] - places_[joint.parent]);
    }
  }

  const Names& names_;
  const Options& options_;
  Person person_;
  std::vector<npt::Vec3d> places_;
};

inline Person person(const Names& names, const Options& options = {}) { return Maker(names, options).make(); }

/// A clip of two seconds in which all joints turn and the hips walk.
inline void add_clip(Person& person) {
  std::vector<float> times;
  for (int f = 0; f <= 60; ++f) times.push_back(static_cast<float>(f) / 30);
  person.motion.rate = 30;
  person.motion.clip.name = "dance";
  for (std::size_t j = 0; j < person.motion.joints.size(); ++j) {
    const npt::NodePlace& rest = person.motion.joints[j].rest;
    npt::ClipChannel turn{j, npt::ChannelPath::rotation, npt::Interpolation::linear, 4, times, {}};
    npt::ClipChannel shift{j, npt::ChannelPath::translation, npt::Interpolation::linear, 3, times, {}};
    for (const float time : times) {
      const auto t = static_cast<double>(time), phase = static_cast<double>(j);
      const npt::Quaternion q = rest.rotation.turned(
          npt::Vec3d{std::sin(3 * t + phase), std::sin(2 * t - phase), std::cos(t + 2 * phase)} * 0.3);
      for (const double c : {q.x, q.y, q.z, q.w}) turn.values.push_back(static_cast<float>(c));
      const npt::Vec3d p = rest.translation + npt::Vec3d{0.1 * t, 0.05 * std::sin(5 * t), 0.8 * t};
      for (const double c : {p.x, p.y, p.z}) shift.values.push_back(static_cast<float>(c));
    }
    person.motion.clip.channels.push_back(std::move(turn));
    if (j == 0) person.motion.clip.channels.push_back(std::move(shift));
  }
}

}  // namespace skeletons
