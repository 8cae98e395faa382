/// A rigged person as a body in SMPL's layout: brought to the mannequin's rest pose and about its size, looking at +z,
/// with SMPL's 24 joints, so that it takes whatever poses bodies take; and where each of its vertices belongs on the
/// resting mannequin (canonical coordinates), for networks that read meshes.
///   RiggedBody knight = rigged_body(make_rig(read_scene("knight.glb"), "knight.glb"), {.longest_edge = 0.04});
/// Joints    by their roles (humanoid_joints.hpp). Weights of other joints go to the nearest of the 24 above them;
///           those of the trunk are shared among hips and spine by height. What a weapon's joint moves goes with
///           the hand
/// Places    each part is stretched onto the mannequin's (canonical_places.hpp)
/// Shapes    canonical: [V, 3], metres, the mannequin's mean shape in its rest pose
/// Numerics  in double, rounded once
/// Errors    npt::Error that names file and joint: joints that are missing or named twice, bones without a length,
///           limbs that no vertex moves with, left and right exchanged
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/body/roles/joint_name.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/lab/rig/humanoid_joints.hpp>
#include <npt/lab/rig/rig.hpp>
#include <training/body_from_rig.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct RiggedBody {
  std::shared_ptr<const BodyModel> body;
  std::vector<float> canonical;
  std::vector<std::string> clip_names;
  std::vector<std::vector<std::array<float, 3 * smpl_joint_count>>> clips;  ///< axis angles of each clip's frames
};

namespace rig::internal {

class RiggedBodyMaker : private BodyFromRig {
 public:
  RiggedBodyMaker(const Rig& rig, const RiggedBodyOptions& options)
      : BodyFromRig(rig, options, mannequin(), people_plan()) {
    const HumanoidJoints joints = humanoid_joints(rig);
    found_.assign(joints.begin(), joints.end());
    own_joints();
    sum_weights(owner_, prop_);
    find_places();
    stand_upright();
    check_bones({bones_with_length.begin(), bones_with_length.end()});
    halve_long_edges();
    take_rest_pose();
    find_turning_joints();
  }

  RiggedBody make() {
    measure();
    std::vector<std::vector<std::size_t>> needed;
    for (const std::size_t j : limb_bones) needed.push_back({j});
    needed.push_back({joint_index(SmplJoint::head), joint_index(SmplJoint::neck)});
    check_surfaces(needed);
    PlannedBody made = make_body({{"unit", "metre"}, {"up", "y"}, {"front", "z"}, {"rest_pose", "T"}});
    RiggedBody result{std::move(made.body), std::move(made.canonical), std::move(made.clip_names), {}};
    for (const auto& clip : made.clips) {
      auto& frames = result.clips.emplace_back();
      for (const std::vector<float>& frame : clip) std::ranges::copy(frame, frames.emplace_back().begin());
    }
    return result;
  }

 private:
  using Places = std::vector<Vec3d>;
  /// Those whose bones make the arms and legs.
  static constexpr std::array<std::size_t, 8> limb_bones =
      joint_indices(SmplJoint::left_hip, SmplJoint::right_hip, SmplJoint::left_knee, SmplJoint::right_knee,
                    SmplJoint::left_shoulder, SmplJoint::right_shoulder, SmplJoint::left_elbow, SmplJoint::right_elbow);
  static constexpr std::array<std::size_t, 9> bones_with_length = joint_indices(
      SmplJoint::left_hip, SmplJoint::right_hip, SmplJoint::left_knee, SmplJoint::right_knee, SmplJoint::neck,
      SmplJoint::left_shoulder, SmplJoint::right_shoulder, SmplJoint::left_elbow, SmplJoint::right_elbow);

  static Vec3d& at(Places& places, SmplJoint joint) { return places[joint_index(joint)]; }
  static const Vec3d& at(const Places& places, SmplJoint joint) { return places[joint_index(joint)]; }
  static Vec3d middle_of(const Places& places, SmplJoint a, SmplJoint b) {
    return (at(places, a) + at(places, b)) * 0.5;
  }
  bool has(SmplJoint joint) const { return found_[joint_index(joint)] != no_item; }

  static bool names_prop(std::string_view name) {
    const std::string base = parse_joint_name(name).words.front();
    for (const std::string_view word : {"weapon", "sword", "gun", "pistol", "rifle", "shield", "prop", "tool"})
      if (base.find(word) != std::string::npos) return true;
    return false;
  }

  /// owner_: which of the 24 each joint of the rig goes with; a trunk's are all the pelvis for now.
  void own_joints() {
    std::vector<int> mapped(rig_.joint_count(), -1);
    for (std::size_t j = 0; j < smpl_joint_count; ++j)
      if (found_[j] != no_item) mapped[found_[j]] = static_cast<int>(j);
    prop_.assign(rig_.joint_count(), false);
    for (std::size_t r = 0; r < rig_.joint_count(); ++r) {
      const std::size_t above = rig_.parents[r];
      std::size_t owner = joint_index(SmplJoint::pelvis);
      if (mapped[r] >= 0)
        owner = static_cast<std::size_t>(mapped[r]);
      else if (above != no_item)
        owner = end_of(owner_[above], mapped[above] >= 0);
      owner_.push_back(owner);
      prop_[r] = names_prop(rig_.joint_name(r)) || (above != no_item && prop_[above]);
    }
  }
  /// What hangs below a forearm without a wrist is its hand, below a shin without an ankle its foot.
  std::size_t end_of(std::size_t owner, bool directly) {
    using enum SmplJoint;
    if (!directly || !is_joint(owner, left_elbow, right_elbow, left_knee, right_knee)) return owner;
    const std::size_t end = parts_.toward(owner);
    return found_[end] == no_item ? end : owner;
  }

  /// Where the 24 joints are in the bind pose; what the rig lacks at the mannequin's share of the way.
  void find_places() {
    using enum SmplJoint;
    for (std::size_t j = 0; j < smpl_joint_count; ++j)
      if (found_[j] != no_item) bind_[j] = rig_.joint_place(found_[j]);
    for (const std::size_t bend : joint_indices(left_elbow, right_elbow, left_knee, right_knee)) {
      const std::size_t end = parts_.toward(bend);
      if (found_[end] == no_item) bind_[end] = end_of_limb(bend);
    }
    const Places& m = model_.joints;
    const Vec3d hips = middle_of(bind_, left_hip, right_hip),
                shoulders = middle_of(bind_, left_shoulder, right_shoulder);
    const Vec3d model_hips = middle_of(m, left_hip, right_hip), &model_pelvis = at(m, pelvis),
                &model_neck = at(m, neck);
    if (!has(neck)) at(bind_, neck) = !has(head) ? shoulders : shoulders + (at(bind_, head) - shoulders) * 0.4;
    if (!has(head)) {
      const double share = length(at(m, head) - model_neck) / length(model_neck - model_hips);
      at(bind_, head) = at(bind_, neck) + (at(bind_, neck) - hips) * share;
    }
    const double share = (model_pelvis.y - model_hips.y) / (model_neck.y - model_hips.y);
    at(bind_, pelvis) = hips + (at(bind_, neck) - hips) * share;
    for (const std::size_t j : joint_indices(spine1, spine2, spine3))
      bind_[j] = at(bind_, pelvis) +
                 (at(bind_, neck) - at(bind_, pelvis)) * ((m[j].y - model_pelvis.y) / (model_neck.y - model_pelvis.y));
    for (const std::size_t collar : joint_indices(left_collar, right_collar)) {
      if (found_[collar] != no_item) continue;
      const Vec3d middle = at(bind_, spine3) + (at(bind_, neck) - at(bind_, spine3)) * 0.6;
      const std::size_t shoulder = parts_.toward(collar);
      bind_[collar] = middle + (bind_[shoulder] - middle) * (m[collar].x / m[shoulder].x);
    }
  }
  /// Where the joints begin that are attached to it; without any the end of what it moves.
  Vec3d end_of_limb(std::size_t joint) const {
    Vec3d sum;
    double count = 0;
    for (std::size_t r = 0; r < rig_.joint_count(); ++r)
      if (rig_.parents[r] == found_[joint] && !prop_[r]) sum += rig_.joint_place(r), ++count;
    if (count > 0) return sum / count;
    const auto above = static_cast<std::size_t>(smpl_parents[joint]);
    const Vec3d along = normalised(bind_[joint] - bind_[above]);
    double farthest = 0;
    for (std::size_t v = 0; v < positions_.size(); ++v)
      if (rest_.weights[v][joint] > 0.5) farthest = std::max(farthest, dot(positions_[v] - bind_[joint], along));
    return bind_[joint] + along * (0.8 * farthest);
  }

  /// Turns the bind pose so that the trunk stands as the mannequin's does.
  void stand_upright() {
    using enum SmplJoint;
    const Matrix3 frame = trunk_frame(bind_);
    if (!(frame.determinant() > 0.5)) fail(joint_index(neck), "no way from the hips to it", "a bind pose with a trunk");
    upright_ = trunk_frame(model_.joints).transposed() * frame;
    centre_ = at(bind_, pelvis);
    const auto turned = [&](Vec3d p) { return upright_ * (p - centre_); };
    for (Vec3d& p : positions_) p = turned(p);
    for (Vec3d& p : bind_) p = turned(p);
    add_toes_and_hands();
    // Feet point forwards, whatever the names say.
    double forwards = 0;
    for (std::size_t v = 0; v < positions_.size(); ++v)
      for (const std::size_t ankle : joint_indices(left_ankle, right_ankle)) {
        const double w = rest_.weights[v][ankle] + rest_.weights[v][parts_.toward(ankle)];
        forwards += w * (positions_[v].z - bind_[ankle].z);
      }
    if (forwards < 0)
      fail(joint_index(left_ankle), "feet that point backwards, as seen from where left and right are",
           "left joints on the body's own left");
    metres_ = size_of(model_.joints) / size_of(bind_);
    for (Vec3d& p : positions_) p = p * metres_;
    for (Vec3d& p : bind_) p = p * metres_;
  }
  /// Toes without a joint: as far before the ankle as the mannequin's are, in feet as long as they are. Hands likewise,
  /// as the forearm points.
  void add_toes_and_hands() {
    using enum SmplJoint;
    const Places& m = model_.joints;
    double own = 0, mannequins = 0;
    for (const auto& [hip, knee, ankle] :
         {joint_indices(left_hip, left_knee, left_ankle), joint_indices(right_hip, right_knee, right_ankle)}) {
      own += length(bind_[knee] - bind_[hip]) + length(bind_[ankle] - bind_[knee]);
      mannequins += length(m[knee] - m[hip]) + length(m[ankle] - m[knee]);
    }
    for (const auto& [ankle, foot] : {joint_indices(left_ankle, left_foot), joint_indices(right_ankle, right_foot)})
      if (found_[foot] == no_item) bind_[foot] = bind_[ankle] + (m[foot] - m[ankle]) * (own / mannequins);
    for (const auto& [elbow, wrist, hand] :
         {joint_indices(left_elbow, left_wrist, left_hand), joint_indices(right_elbow, right_wrist, right_hand)})
      if (found_[hand] == no_item)
        bind_[hand] =
            bind_[wrist] + normalised(bind_[wrist] - bind_[elbow]) * (length(m[hand] - m[wrist]) * own / mannequins);
  }
  /// Rows: to the left, from the hips to the neck, forwards.
  static Matrix3 trunk_frame(const Places& j) {
    using enum SmplJoint;
    const Vec3d y = normalised(at(j, neck) - middle_of(j, left_hip, right_hip));
    const Vec3d side =
        normalised(at(j, left_hip) - at(j, right_hip)) + normalised(at(j, left_shoulder) - at(j, right_shoulder));
    const Vec3d x = normalised(side - y * dot(side, y));
    return {{{x, y, cross(x, y)}}};
  }
  /// Of a skeleton: legs, trunk and arms.
  double size_of(const Places& j) const {
    using enum SmplJoint;
    double sum = length(at(j, neck) - middle_of(j, left_hip, right_hip)) +
                 0.5 * length(at(j, left_shoulder) - at(j, right_shoulder));
    for (const std::size_t k : limb_bones) sum += 0.5 * length(j[parts_.toward(k)] - j[k]);
    return sum;
  }

  /// Which joint of the rig turns each of the 24.
  void find_turning_joints() {
    using enum SmplJoint;
    std::vector<std::size_t> turning = found_;
    std::size_t& root = turning[joint_index(pelvis)];
    if (const std::size_t above = rig_.parents[found_[joint_index(left_hip)]]; above != no_item)
      root = above;  // what the legs are attached to
    // Of the chain down from the neck the joint that stands nearest below each of the spine's.
    std::size_t from = rig_.parents[found_[joint_index(has(neck) ? neck : head)]];
    std::vector<std::size_t> chain;
    for (; from != no_item && from != root && owner_[from] == joint_index(pelvis); from = rig_.parents[from])
      chain.push_back(from);
    for (const std::size_t j : joint_indices(spine1, spine2, spine3)) {
      turning[j] = no_item;
      double least = 0.06;
      for (const std::size_t r : chain) {
        const double height = (upright_ * (rig_.joint_place(r) - centre_)).y * metres_ - bind_[j].y;
        if (height < least && (turning[j] == no_item || joint_height(r) > joint_height(turning[j]))) turning[j] = r;
      }
    }
    for (std::size_t j = 0; j < smpl_joint_count; ++j)
      if (turning[j] != no_item) turning_[j] = {{turning[j], 1.0}};
  }
  double joint_height(std::size_t r) const { return (upright_ * (rig_.joint_place(r) - centre_)).y; }

  std::vector<std::size_t> owner_;
  std::vector<bool> prop_;  ///< joints of the rig
  Vec3d centre_;            ///< of the hips, in the bind pose
  double metres_ = 1;       ///< in a unit of the bind pose
};

}  // namespace rig::internal

inline RiggedBody rigged_body(const Rig& rig, const RiggedBodyOptions& options = {}) {
  return rig::internal::RiggedBodyMaker(rig, options).make();
}

}  // namespace npt::inline NPT_ABI
