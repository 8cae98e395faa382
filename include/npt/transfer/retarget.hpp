/// A motion on another skeleton: rotations from joint to joint by their roles, in the target's own frames.
///   Motion on_mine = retarget(clip, joint_roles(clip), mine, joint_roles(mine));
///   rotations   of each role's joint, relative to the pose that its skeleton was bound or stands in; arms, legs and
///               fingers point where the source's point, whether their rests are T or A poses
///   spine       turns by its place between hips and shoulders, whatever the number of its joints
///   hips        move as the source's above the ground, by the ratio of leg lengths; the middle between the thighs
///               counts, so that a root on the floor does, too
///   others      keep their place in their parent; feet that a rig moves apart from their legs follow these
/// Bones keep their lengths. Keys stand at the source's times, and where these are no frames, at 30 a second as well.
/// Limits    both rests are taken to be poses of a body that stands straight: a source whose rest runs or sits bends
///           the target's spine by as much
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/facing.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/body_shape.hpp>
#include <npt/transfer/retarget_options.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

inline std::vector<Quaternion> world_rotations(const std::vector<Affine>& worlds) {
  std::vector<Quaternion> rotations;
  rotations.reserve(worlds.size());
  for (const Affine& world : worlds) rotations.push_back(place_of(world).rotation);
  return rotations;
}

/// The shortest turn from one direction to another; none for the same.
inline Quaternion turn_between(Vec3d from, Vec3d to) {
  const Vec3d a = normalised(from), b = normalised(to), axis = cross(a, b);
  const double cosine = dot(a, b);
  if (length(axis) < 1e-12) return {};
  return normalised(Quaternion{axis.x, axis.y, axis.z, 1 + cosine});
}

/// One of the two skeletons, in the pose that motions are relative to.
struct RetargetSide {
  RetargetSide(const Motion& from, const JointRoles& own)
      : motion(from), roles(own), worlds(bound_worlds(from)), rotations(world_rotations(worlds)) {
    std::vector<Vec3d> positions;
    for (const Affine& world : worlds) positions.push_back(world.shift);
    BodyAxes axes = body_axes(roles.joints, positions);
    if (axes.up.y > 0.7) {  // who stands, stands upright, or else the way of a walk would lean as the spine does
      axes.up = {0, 1, 0};
      axes.left = normalised(Vec3d{axes.left.x, 0, axes.left.z});
      axes.forward = cross(axes.left, axes.up);
    }
    frame = Matrix3::from_columns(axes.left, axes.up, axes.forward);
    const std::size_t left = roles.joint(LimbPart::upper_leg, 0), right = roles.joint(LimbPart::upper_leg, 1);
    const std::size_t hips = roles.joint(JointRole::hips);
    if (left != no_item && right != no_item)
      middle = (positions[left] + positions[right]) * 0.5;
    else if (hips != no_item)
      middle = positions[hips];
    pelvis = middle;
    if (leg() > 0 && axes.up == Vec3d{0, 1, 0}) pelvis.y = lowest(worlds) + standing_height();
  }

  /// The height of the lowest joint of the legs.
  double lowest(const std::vector<Affine>& at) const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t side = 0; side < 2; ++side)
      for (const LimbPart part : {LimbPart::lower_leg, LimbPart::foot, LimbPart::toes})
        if (const std::size_t joint = roles.joint(part, side); joint != no_item)
          least = std::min(least, at[joint].shift.y);
    return least;
  }

  /// A rest may hang below the ground, as BVH's do around the origin: then the clip's own lowest point is where its
  /// feet stand, if it is another by more than a quarter of a leg.
  void find_ground() {
    const double at_rest = lowest(worlds), off = 0.25 * leg();
    if (!(std::abs(at_rest) > off)) return;
    double least = std::numeric_limits<double>::infinity();
    const double end = motion.clip.channels.empty() ? 0 : motion.clip.length();
    constexpr int samples = 30;
    for (int i = 0; i <= samples && !motion.clip.channels.empty(); ++i)
      least = std::min(least, lowest(joint_worlds(motion, end * i / samples)));
    if (std::isfinite(least) && std::isfinite(at_rest) && std::abs(least - at_rest) > off) pelvis.y += least - at_rest;
  }

  /// Where the pelvis is at other places of the joints: it goes with the hips, also where thighs are moved apart.
  Vec3d pelvis_at(const std::vector<Affine>& at) const {
    const std::size_t hips = roles.joint(JointRole::hips);
    return hips == no_item ? middle : at[hips](inverse(worlds[hips])(middle));
  }
  /// Thigh and shin, the mean of both sides; 0 where there are none.
  double leg() const {
    double sum = 0;
    for (std::size_t side = 0; side < 2; ++side) {
      const std::size_t hip = roles.joint(LimbPart::upper_leg, side), knee = roles.joint(LimbPart::lower_leg, side);
      const std::size_t foot = roles.joint(LimbPart::foot, side);
      if (hip == no_item || knee == no_item) continue;
      sum += length(worlds[knee].shift - worlds[hip].shift) / 2;
      if (foot != no_item) sum += length(worlds[foot].shift - worlds[knee].shift) / 2;
    }
    return sum;
  }
  /// Of the pelvis above the ground, with straight legs and flat feet: legs may be apart or bent at rest.
  double standing_height() const {
    double ankle = 0;
    for (std::size_t side = 0; side < 2; ++side)
      if (const std::size_t foot = roles.joint(LimbPart::foot, side); foot != no_item)
        ankle += (worlds[foot].shift.y - lowest(worlds)) / 2;
    return leg() + ankle;
  }
  /// Where the bone of a role points: to the next joint of its limb.
  Vec3d direction(JointRole role) const {
    const std::size_t own = roles.joint(role), next = is_of_limb(role) ? roles.joint(next_of(role)) : no_item;
    return own == no_item || next == no_item ? Vec3d{} : worlds[next].shift - worlds[own].shift;
  }
  static JointRole next_of(JointRole role) {
    const auto part = static_cast<std::size_t>(part_of(role));
    const bool last = part == 3 || part == 7 || (part >= 8 && (part - 8) % 3 == 2);
    return last ? role : static_cast<JointRole>(index_of(role) + 1);
  }

  const Motion& motion;
  const JointRoles& roles;
  std::vector<Affine> worlds;
  std::vector<Quaternion> rotations;
  Matrix3 frame;   ///< left, up and forward as columns
  Vec3d middle{};  ///< between the thighs, or else the hips
  Vec3d pelvis{};  ///< the same, where it stands on the ground with straight legs
};

class Retargeter {
 public:
  Retargeter(const Motion& source, const JointRoles& from, const Motion& target, const JointRoles& to)
      : from_(source, from), to_(target, to), parts_(target.joints.size()), moving_(target.joints.size()) {
    across_ = from_.frame == to_.frame ? Quaternion{} : quaternion_of(to_.frame * from_.frame.transposed());
    from_.find_ground();
    const double own = to_.leg(), other = from_.leg();
    if (own > 0 && other > 0) scale_ = own / other;
    for (std::size_t j = 0; j < target.joints.size(); ++j) {
      const std::size_t parent = target.joints[j].parent;
      parts_[j] = place_of(inverse(parent == no_item ? target.base : to_.worlds[parent]) * to_.worlds[j]);
    }
    correct_limbs();
    order_joints();
  }

  Motion run() {
    const Motion& target = to_.motion;
    Motion made{target.joints, {from_.motion.clip.name, {}}, target.base, from_.motion.rate};
    const std::vector<float> times = key_times();
    std::vector<std::vector<NodePlace>> frames;
    frames.reserve(times.size());
    for (const float time : times) frames.push_back(frame(static_cast<double>(time)));
    for (std::size_t j = 0; j < target.joints.size(); ++j) add_channels(made.clip, j, times, frames);
    return made;
  }

 private:
  std::vector<float> key_times() const {
    std::vector<float> times;
    for (const ClipChannel& channel : from_.motion.clip.channels)
      times.insert(times.end(), channel.times.begin(), channel.times.end());
    if (from_.motion.rate == 0)
      for (const double time : frame_times(from_.motion.clip, 30)) times.push_back(static_cast<float>(time));
    if (times.empty()) times.push_back(0);
    std::ranges::sort(times);
    times.erase(std::unique(times.begin(), times.end()), times.end());
    return times;
  }

  /// Between two rests: from the direction of the target's bone to that of the source's.
  void correct_limbs() {
    for (std::size_t r = middle_role_count; r < joint_role_count; ++r) {
      const auto role = static_cast<JointRole>(r);
      const LimbPart part = part_of(role);
      if (part == LimbPart::shoulder || part == LimbPart::foot || part == LimbPart::toes) continue;
      const Vec3d own = to_.direction(role), other = from_.direction(role);
      if (length(own) > 0 && length(other) > 0)
        corrections_[r] = turn_between(own, across_(other));
      else if (part == LimbPart::hand || is_of_digit(role))  // without a bone of its own, as the one before it
        corrections_[r] = corrections_[part == LimbPart::hand || (r - middle_role_count - 8) % 3 != 0
                                           ? r - 1
                                           : index_of(limb_role(LimbPart::hand, side_of(role)))];
    }
  }

  /// Parents before children, and what is moved apart from its limb behind that.
  void order_joints() {
    std::vector<bool> late(parts_.size());
    for (std::size_t side = 0; side < 2; ++side) {
      const std::size_t foot = to_.roles.joint(LimbPart::foot, side), knee = to_.roles.joint(LimbPart::lower_leg, side);
      if (foot == no_item || knee == no_item || is_below(foot, knee)) continue;
      follows_.emplace_back(foot, knee);
      late[foot] = true;
    }
    for (std::size_t j = 0; j < parts_.size(); ++j) {
      const std::size_t parent = to_.motion.joints[j].parent;
      if (parent != no_item && late[parent]) late[j] = true;
    }
    for (const bool now : {false, true})
      for (std::size_t j = 0; j < parts_.size(); ++j)
        if (late[j] == now) order_.push_back(j);
  }
  bool is_below(std::size_t joint, std::size_t above) const {
    while (joint != no_item && joint != above) joint = to_.motion.joints[joint].parent;
    return joint == above;
  }

  /// How a joint of the source has turned since its rest; nothing where it has none of the role.
  std::optional<Quaternion> turn_of(JointRole role, const std::vector<Quaternion>& now) const {
    const std::size_t joint = from_.roles.joint(role);
    if (joint == no_item) return std::nullopt;
    return now[joint] * inverse(from_.rotations[joint]);
  }

  /// Of the spine's joints that a skeleton has, the roles in their order.
  static std::vector<JointRole> spine_of(const JointRoles& roles) {
    std::vector<JointRole> spine;
    for (const JointRole role : {JointRole::spine, JointRole::chest, JointRole::upper_chest})
      if (roles.joint(role) != no_item) spine.push_back(role);
    return spine;
  }

  std::optional<Quaternion> spine_turn(JointRole role, const std::vector<Quaternion>& now) const {
    const std::vector<JointRole> own = spine_of(to_.roles), other = spine_of(from_.roles);
    const std::optional<Quaternion> hips = turn_of(JointRole::hips, now);
    if (!hips || other.empty()) return hips;
    const auto place = static_cast<std::size_t>(std::ranges::find(own, role) - own.begin()) + 1;
    const double along = static_cast<double>(place * other.size()) / static_cast<double>(own.size());
    const auto above = static_cast<std::size_t>(std::ceil(along));  // from 1 on
    const Quaternion high = *turn_of(other[above - 1], now);
    const Quaternion low = above == 1 ? *hips : *turn_of(other[above - 2], now);
    const double share = along - static_cast<double>(above - 1);
    return share == 1 ? high : slerp(low, high, share);
  }

  std::optional<Quaternion> turn_for(JointRole role, const std::vector<Quaternion>& now) const {
    if (role >= JointRole::spine && role <= JointRole::upper_chest) return spine_turn(role, now);
    const std::optional<Quaternion> own = turn_of(role, now);
    if (own || role != JointRole::neck) return own;
    const std::optional<Quaternion> head = turn_of(JointRole::head, now);
    const std::vector<JointRole> spine = spine_of(from_.roles);
    const std::optional<Quaternion> chest = turn_of(spine.empty() ? JointRole::hips : spine.back(), now);
    return head && chest ? std::optional(slerp(*chest, *head, 0.5)) : std::nullopt;
  }

  /// The places of the target's joints in their parents at a time.
  std::vector<NodePlace> frame(double time) {
    const std::vector<Affine> source = joint_worlds(from_.motion, time);
    const std::vector<Quaternion> now = world_rotations(source);
    std::vector<NodePlace> places = parts_;
    std::vector<Affine> worlds(places.size());
    std::vector<Quaternion> rotations(places.size());
    const Quaternion base = place_of(to_.motion.base).rotation;
    for (const std::size_t j : order_) {
      const std::size_t parent = to_.motion.joints[j].parent;
      const Quaternion& above = parent == no_item ? base : rotations[parent];
      const Affine& outer = parent == no_item ? to_.motion.base : worlds[parent];
      rotations[j] = above * places[j].rotation;
      const JointRole role = to_.roles.role_of(j);
      if (role != JointRole::none)
        if (const std::optional<Quaternion> turn = turn_for(role, now)) {
          rotations[j] = across_ * *turn * inverse(across_) * corrections_[index_of(role)] * to_.rotations[j];
          places[j].rotation = normalised(inverse(above) * rotations[j]);
          moving_[j][0] = true;
        }
      if (role == JointRole::hips) place_hips(j, outer, source, places[j]);
      for (const auto& [foot, knee] : follows_)
        if (j == foot) {
          const Vec3d ankle = worlds[knee](inverse(to_.worlds[knee])(to_.worlds[foot].shift));
          places[j].translation = inverse(outer)(ankle);
          moving_[j][1] = true;
        }
      worlds[j] = outer * places[j].affine();
    }
    return places;
  }

  void place_hips(std::size_t hips, const Affine& outer, const std::vector<Affine>& source, NodePlace& place) {
    const Vec3d way = across_(from_.pelvis_at(source) - from_.pelvis) * scale_;
    const Vec3d inside = inverse(to_.worlds[hips])(to_.middle);  // in the joint's own coordinates
    NodePlace turned = place;
    turned.translation = {};
    place.translation = inverse(outer)(to_.pelvis + way) - turned.affine()(inside);
    moving_[hips][1] = true;
  }

  void add_channels(Clip& clip, std::size_t joint, const std::vector<float>& times,
                    const std::vector<std::vector<NodePlace>>& frames) const {
    const NodePlace& rest = to_.motion.joints[joint].rest;
    ClipChannel turn{joint, ChannelPath::rotation, Interpolation::linear, 4, times, {}};
    ClipChannel shift{joint, ChannelPath::translation, Interpolation::linear, 3, times, {}};
    if (!moving_[joint][0]) turn.times.resize(1);
    if (!moving_[joint][1]) shift.times.resize(1);
    Quaternion last = frames.front()[joint].rotation;
    for (std::size_t f = 0; f < turn.times.size(); ++f) {
      Quaternion q = frames[f][joint].rotation;
      if (dot(q, last) < 0) q = q * -1.0;
      last = q;
      for (const double c : {q.x, q.y, q.z, q.w}) turn.values.push_back(static_cast<float>(c));
    }
    for (std::size_t f = 0; f < shift.times.size(); ++f) {
      const Vec3d p = frames[f][joint].translation;
      for (const double c : {p.x, p.y, p.z}) shift.values.push_back(static_cast<float>(c));
    }
    // A joint that stays as it was bound needs a key only where the file stands in another pose.
    const NodePlace& first = frames.front()[joint];
    if (moving_[joint][0] || std::abs(dot(first.rotation, rest.rotation)) < 1 - 1e-9)
      clip.channels.push_back(std::move(turn));
    if (moving_[joint][1] || length(first.translation - rest.translation) > 1e-6 * (1e-6 + length(rest.translation)))
      clip.channels.push_back(std::move(shift));
  }

  RetargetSide from_, to_;
  Quaternion across_{};  ///< from the source's directions to the target's
  double scale_ = 1;
  std::vector<NodePlace> parts_;  ///< [joints] of the target, in their parents, as it was bound
  std::array<Quaternion, joint_role_count> corrections_{};
  std::vector<std::size_t> order_;
  std::vector<std::pair<std::size_t, std::size_t>> follows_;  ///< feet, and the lower legs that they follow
  std::vector<std::array<bool, 2>> moving_;                   ///< [joints] rotation, translation
};

}  // namespace internal

/// Requires  roles of the two motions; joints of roles that only one of them has stay as they are
inline Motion retarget(const Motion& source, const JointRoles& from, const Motion& target, const JointRoles& to,
                       const RetargetOptions& options = {}, const RetargetShapes& shapes = {}) {
  (void)options, (void)shapes;
  return internal::Retargeter(source, from, target, to).run();
}

}  // namespace npt::inline NPT_ABI
