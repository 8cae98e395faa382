/// Joints for twist, which roll bones along a limb, take their share of its twist: those of a forearm follow the hand,
/// those of an upper arm and a thigh hold back what their limb turns about its own axis.
///   TwistJoints twists(target side);   finds them by their names or their place along a bone
///   twists.apply(pose);
/// A joint takes the share that its place along the bone says: none at the shoulder, all at the wrist.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/config.hpp>
#include <npt/io/text.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/posed_joints.hpp>
#include <npt/transfer/motion/retarget_frames.hpp>
#include <npt/transfer/motion/retarget_side.hpp>

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// The part of a rotation that turns about an axis of length 1.
inline Quaternion twist_about(Quaternion q, Vec3d axis) {
  const double along = dot(Vec3d{q.x, q.y, q.z}, axis);
  const Quaternion twist{axis.x * along, axis.y * along, axis.z * along, q.w};
  return dot(twist, twist) < negligible * negligible ? Quaternion{} : normalised(twist.w < 0 ? twist * -1.0 : twist);
}

class TwistJoints {
 public:
  /// Keeps a reference.
  explicit TwistJoints(const RetargetSide& target) : target_(target) {
    for (std::size_t side = 0; side < 2; ++side)
      for (const auto& [part, next] :
           {std::pair(LimbPart::upper_arm, LimbPart::lower_arm), std::pair(LimbPart::lower_arm, LimbPart::hand),
            std::pair(LimbPart::upper_leg, LimbPart::lower_leg)})
        find(target.roles.joint(part, side), target.roles.joint(next, side), part == LimbPart::lower_arm);
  }

  bool empty() const { return found_.empty(); }

  void apply(PosedJoints& pose) const {
    for (const Twist& twist : found_) {
      const std::size_t bone = twist.bone, parent = target_.motion.joints[bone].parent;
      // Of the end against the bone, or of the bone against its parent, since both were bound.
      const std::size_t outer = twist.follows_end ? bone : parent, inner = twist.follows_end ? twist.end : bone;
      const Quaternion now = inverse(pose.rotation(outer)) * pose.rotation(inner);
      const Quaternion then = inverse(target_.rotations[outer]) * target_.rotations[inner];
      const Quaternion turn = pose.rotation(outer) * now * inverse(then) * inverse(pose.rotation(outer));
      const Vec3d axis = normalised(pose.position(twist.end) - pose.position(bone));
      const Quaternion whole = twist_about(turn, axis);
      const double share = twist.follows_end ? twist.along : twist.along - 1;
      const Quaternion part = slerp({}, share < 0 ? inverse(whole) : whole, share < 0 ? -share : share);
      if (twist.holds_limb) {
        // The limb goes on behind it, and must stay as it is.
        const Quaternion kept = pose.rotation(twist.next);
        pose.turn(twist.joint, part);
        pose.rotate(twist.next, kept);
      } else {
        pose.turn(twist.joint, part);
      }
    }
  }

 private:
  struct Twist {
    std::size_t joint, bone, end;
    double along;      ///< of the bone, 0 to 1
    bool follows_end;  ///< of a forearm
    bool holds_limb;   ///< the limb goes on behind it
    std::size_t next;  ///< of the limb behind it, if so
  };

  static bool is_named(const std::string& joint) {
    const std::string name = lower_case(joint);
    for (const char* word : {"twist", "roll", "捩"})
      if (name.find(word) != std::string::npos) return true;
    return false;
  }

  void find(std::size_t bone, std::size_t end, bool follows_end) {
    if (bone == no_item || end == no_item || target_.motion.joints[bone].parent == no_item) return;
    const Vec3d start = target_.worlds[bone].shift, way = target_.worlds[end].shift - start;
    if (!(length(way) > 0)) return;
    constexpr double beside = 0.1;  // of the bone's length
    for (std::size_t j = 0; j < target_.motion.joints.size(); ++j) {
      if (j == bone || target_.roles.role_of(j) != JointRole::none || !is_under(j, bone)) continue;
      const Vec3d off = target_.worlds[j].shift - start;
      const double along = dot(off, way) / dot(way, way), aside = length(off - way * along) / length(way);
      const bool between = is_under(end, j);
      if (aside > beside || along < -beside || along > 1 + beside ||
          !(between || is_named(target_.motion.joints[j].name)))
        continue;
      std::size_t next = end;
      while (between && target_.motion.joints[next].parent != j) next = target_.motion.joints[next].parent;
      found_.push_back({j, bone, end, std::clamp(along, 0.0, 1.0), follows_end, between, next});
    }
  }
  /// Below a joint, with no other joint of the body in between.
  bool is_under(std::size_t joint, std::size_t above) const {
    for (joint = target_.motion.joints[joint].parent; joint != no_item; joint = target_.motion.joints[joint].parent) {
      if (joint == above) return true;
      if (target_.roles.role_of(joint) != JointRole::none) return false;
    }
    return false;
  }

  const RetargetSide& target_;
  std::vector<Twist> found_;
};

inline void share_twist(const TwistJoints& twists, PosedJoints& pose, RetargetFrames& frames) {
  if (twists.empty()) return;
  for (std::vector<NodePlace>& places : frames.places) {
    pose.set(places);
    twists.apply(pose);
    places = pose.places();
  }
}

}  // namespace internal

}  // namespace npt::inline NPT_ABI
