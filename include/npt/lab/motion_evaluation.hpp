/// How good a motion on another skeleton is: against the ground truth, where its makers have the clip on that skeleton,
/// and by what eyes see: feet that slide or sink, arms inside the trunk, bones that change their length.
///   MotionErrors errors = evaluate_motion({source, from}, {result, to}, &truth, &mesh);
/// The ground truth is taken with its bones as long as they were bound, as the result's are; how far its makers draw
/// them out is told beside. Lengths are those of a body of 1.75 m; a figure's height is that of its joints, as bound.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/feet_apart.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/lab/limb_penetration.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/motion_mesh.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

struct MotionErrors {
  double joint_median = 0, joint_p95 = 0;         ///< shares of the height, over joints with roles and frames
  double truth_drawn_p95 = 0;                     ///< how far the ground truth draws joints out of their bones' length
  double slide = 0, source_slide = 0;             ///< centimetres a second of contact
  double contact_seconds = 0;                     ///< of both feet
  double sink = 0;                                ///< centimetres that a foot is lower than the source's, at most
  double penetration = 0, worst_penetration = 0;  ///< centimetres, of arm vertices inside the trunk
  double stretch = 0;                             ///< the largest change of a bone_length, a share of it
  std::vector<double> joint_errors{};             ///< all, ascending
};

/// A motion and which joint is which.
struct JudgedMotion {
  const Motion& motion;
  const JointRoles& roles;
};

namespace internal {

/// Sorts them; 0 of none.
inline double percentile(std::vector<double>& values, double share) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace internal

/// Of several motions: joints of all, slides by the time of contact, else means or the worst.
inline MotionErrors pooled_errors(std::span<const MotionErrors> motions) {
  MotionErrors all;
  for (const MotionErrors& one : motions) {
    all.joint_errors.insert(all.joint_errors.end(), one.joint_errors.begin(), one.joint_errors.end());
    all.truth_drawn_p95 = std::max(all.truth_drawn_p95, one.truth_drawn_p95);
    all.slide += one.slide * one.contact_seconds;
    all.source_slide += one.source_slide * one.contact_seconds;
    all.contact_seconds += one.contact_seconds;
    all.sink = std::max(all.sink, one.sink);
    all.penetration += one.penetration / static_cast<double>(motions.size());
    all.worst_penetration = std::max(all.worst_penetration, one.worst_penetration);
    all.stretch = std::max(all.stretch, one.stretch);
  }
  all.joint_median = internal::percentile(all.joint_errors, 0.5);
  all.joint_p95 = internal::percentile(all.joint_errors, 0.95);
  if (all.contact_seconds > 0) all.slide /= all.contact_seconds, all.source_slide /= all.contact_seconds;
  return all;
}

namespace internal {

/// From the lowest to the highest joint, as bound.
inline double joint_height(const Motion& motion) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Affine& world : bound_worlds(motion)) {
    low = std::min(low, world.shift.y);
    high = std::max(high, world.shift.y);
  }
  return high - low;
}

class MotionJudge {
 public:
  MotionJudge(const JudgedMotion& source, const JudgedMotion& result)
      : from_(source), to_(result), times_(frame_times(source.motion.clip, rate)) {
    to_height_ = joint_height(result.motion), from_leg_ = leg(source), to_leg_ = leg(result);
    for (const double time : times_) {
      before_.push_back(joint_worlds(from_.motion, time));
      after_.push_back(joint_worlds(to_.motion, time));
    }
  }

  void compare(const Motion& truth, MotionErrors& errors) const {
    std::vector<double> drawn;
    for (std::size_t f = 0; f < times_.size(); ++f) {
      const std::vector<Affine> own = joint_worlds(truth, times_[f]), expected = held(truth, times_[f]);
      for (const std::size_t joint : to_.roles.joints)
        if (joint != no_item) {
          errors.joint_errors.push_back(length(after_[f][joint].shift - expected[joint].shift) / to_height_);
          drawn.push_back(length(own[joint].shift - expected[joint].shift) / to_height_);
        }
    }
    errors.joint_median = percentile(errors.joint_errors, 0.5);
    errors.joint_p95 = percentile(errors.joint_errors, 0.95);
    errors.truth_drawn_p95 = percentile(drawn, 0.95);
  }

  /// A foot's point stands where it is low and hardly moves in the source. Not by the thresholds with which contacts
  /// are found to be held, so that these are judged, too. Of a foot's points that stand the one that moves least counts:
  /// a foot that turns about its ball or its heel doesn't slide, however long it is.
  void judge_feet(MotionErrors& errors) const {
    if (from_leg_ == 0 || to_leg_ == 0) return;
    const double from_unit = usual_leg / from_leg_, to_unit = usual_leg / to_leg_;
    double slide = 0, source_slide = 0;
    for (std::size_t side = 0; side < 2; ++side) {
      const std::vector<FootPoint> points = foot_points(side);
      for (std::size_t f = 1; f < times_.size(); ++f) {
        double least = std::numeric_limits<double>::infinity(), source_least = least;
        for (const auto& [own, other, low, floor] : points) {
          const Vec3d way = before_[f][own].shift - before_[f - 1][own].shift;
          if (length(way) * from_unit * rate > 0.15 || (before_[f][own].shift.y - low) * from_unit > 0.03) continue;
          source_least = std::min(source_least, level(way) * from_unit);
          least = std::min(least, level(after_[f][other].shift - after_[f - 1][other].shift) * to_unit);
        }
        if (!std::isfinite(least) || stretched(f, side)) continue;
        errors.contact_seconds += 1 / rate;
        source_slide += source_least;
        slide += least;
      }
    }
    if (errors.contact_seconds == 0) return;
    errors.slide = 100 * slide / errors.contact_seconds;
    errors.source_slide = 100 * source_slide / errors.contact_seconds;
  }

  /// Each foot's joints above where they stand, against the source's.
  void judge_depth(MotionErrors& errors) const {
    const std::vector<Affine> to_rest = bound_worlds(to_.motion);
    if (from_leg_ == 0 || to_leg_ == 0) return;
    for (std::size_t side = 0; side < 2; ++side)
      for (const auto& [own, other, low, floor] : foot_points(side)) {
        double result_low = 0;  // below its rest, in legs
        for (const auto& worlds : after_)
          result_low = std::min(result_low, (worlds[other].shift.y - to_rest[other].shift.y) / to_leg_);
        const double source_low = std::min(0.0, (low - floor) / from_leg_);
        errors.sink = std::max(errors.sink, 100 * usual_leg * (source_low - result_low));
      }
  }

  void judge_bones(MotionErrors& errors) const {
    for (std::size_t j = 0; j < to_.motion.joints.size(); ++j) {
      const std::size_t parent = to_.motion.joints[j].parent;
      if (parent == no_item || !is_of_limb(to_.roles.role_of(j)) || to_.roles.role_of(parent) == JointRole::none)
        continue;
      const double first = bone_length(to_.motion, after_[0], j);
      if (!(first > 1e-4 * to_height_)) continue;
      for (const auto& worlds : after_)
        errors.stretch = std::max(errors.stretch, std::abs(bone_length(to_.motion, worlds, j) / first - 1));
    }
  }

  void judge_arms(const MotionMesh& mesh, MotionErrors& errors) const {
    LimbPenetration depths(mesh, to_.motion, to_.roles);
    const std::size_t step = std::max<std::size_t>(1, times_.size() / 60);
    for (std::size_t f = 0; f < times_.size(); f += step) depths.add(after_[f]);
    errors.penetration = 100 * usual_height / to_height_ * depths.mean();
    errors.worst_penetration = 100 * usual_height / to_height_ * depths.worst();
  }

 private:
  static constexpr double rate = 30, usual_height = 1.6, usual_leg = 0.82;  // of the joints of a body of 1.75 m

  struct FootPoint {
    std::size_t own, other;  ///< joints of the source and of the result
    double low;              ///< the source's lowest height
    double floor;            ///< where it stands: at rest, or the lowest but a twentieth where the rest hangs elsewhere
  };
  std::vector<FootPoint> foot_points(std::size_t side) const {
    const std::vector<Affine> rest = bound_worlds(from_.motion);
    std::vector<FootPoint> points;
    for (const LimbPart part : {LimbPart::foot, LimbPart::toes}) {
      const std::size_t own = from_.roles.joint(part, side), other = to_.roles.joint(part, side);
      if (own == no_item || other == no_item) continue;
      std::vector<double> heights;
      for (const auto& worlds : before_) heights.push_back(worlds[own].shift.y);
      std::sort(heights.begin(), heights.end());
      const double low = heights.front(), at_rest = rest[own].shift.y;
      const bool hangs = std::abs(low - at_rest) > 0.25 * from_leg_;
      points.push_back({own, other, low, hangs ? heights[heights.size() / 20] : at_rest});
    }
    return points;
  }

  /// The joints of the ground truth with its bones as long as they were bound: makers of cartoons draw limbs out of
  /// their joints, by 22 % of the height at the 95th percentile of a roll, and a skeleton that keeps its lengths can't.
  /// Feet that the rig moves apart from their legs stand at the ends of these.
  std::vector<Affine> held(const Motion& truth, double time) const {
    const std::vector<Affine> bound = bound_worlds(truth);
    std::vector<NodePlace> places = local_places(truth, time);
    std::vector<bool> roots(places.size());  // the hips and what carries them
    for (std::size_t j = to_.roles.joint(JointRole::hips); j != no_item; j = truth.joints[j].parent) roots[j] = true;
    for (std::size_t j = 0; j < places.size(); ++j)
      if (!roots[j]) places[j].translation = inverse(outer(truth, bound, j))(bound[j].shift);
    std::vector<Affine> worlds(places.size());
    const auto pose = [&] {
      for (std::size_t j = 0; j < worlds.size(); ++j) worlds[j] = outer(truth, worlds, j) * places[j].affine();
    };
    pose();
    for (const auto [foot, knee] : feet_apart(truth, to_.roles))
      places[foot].translation =
          inverse(outer(truth, worlds, foot))(worlds[knee](inverse(bound[knee])(bound[foot].shift)));
    pose();
    return worlds;
  }

  static const Affine& outer(const Motion& motion, const std::vector<Affine>& worlds, std::size_t joint) {
    const std::size_t parent = motion.joints[joint].parent;
    return parent == no_item ? motion.base : worlds[parent];
  }

  /// A source's leg that its makers draw out can't be followed by one that keeps its lengths.
  bool stretched(std::size_t frame, std::size_t side) const {
    const std::size_t hip = from_.roles.joint(LimbPart::upper_leg, side),
                      foot = from_.roles.joint(LimbPart::foot, side);
    return hip != no_item && foot != no_item &&
           length(before_[frame][foot].shift - before_[frame][hip].shift) > 1.01 * from_leg_;
  }
  static double level(Vec3d way) { return std::hypot(way.x, way.z); }
  static double leg(const JudgedMotion& judged) {
    const std::vector<Affine> bound = bound_worlds(judged.motion);
    const std::size_t hip = judged.roles.joint(LimbPart::upper_leg, 0),
                      knee = judged.roles.joint(LimbPart::lower_leg, 0);
    const std::size_t foot = judged.roles.joint(LimbPart::foot, 0);
    if (hip == no_item || knee == no_item || foot == no_item) return 0;
    return length(bound[knee].shift - bound[hip].shift) + length(bound[foot].shift - bound[knee].shift);
  }

  JudgedMotion from_, to_;
  std::vector<double> times_;
  std::vector<std::vector<Affine>> before_, after_;  ///< [frames][joints]
  double to_height_ = 0, from_leg_ = 0, to_leg_ = 0;
};

}  // namespace internal

/// `truth`: the makers' own motion on the result's skeleton; `mesh`: what its joints move; either may be nullptr.
/// Requires  a source with a clip
inline MotionErrors evaluate_motion(const JudgedMotion& source, const JudgedMotion& result, const Motion* truth,
                                    const MotionMesh* mesh) {
  MotionErrors errors;
  const internal::MotionJudge judge(source, result);
  if (truth != nullptr) judge.compare(*truth, errors);
  judge.judge_feet(errors);
  judge.judge_depth(errors);
  judge.judge_bones(errors);
  if (mesh != nullptr) judge.judge_arms(*mesh, errors);
  return errors;
}

}  // namespace npt::inline NPT_ABI
