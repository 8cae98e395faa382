/// Random poses of a kind of body by a table: ranges of its joints, and poses by name that draws mix.
/// Format    lines of words; # begins a comment
///   range JOINT X_LOW X_HIGH Y_LOW Y_HIGH Z_LOW Z_HIGH
///   pose NAME WEIGHT
///   bend NAME JOINT X Y Z
/// A joint that no line names does what its mirrored one does, mirrored; a pose that bends neither leaves both at rest.
/// Units     degrees in the text, radians in poses; axis angles relative to the parent. The root turns by its y after
///           it tilted by its x and z
/// Shapes    poses: [J, 3]
/// Numerics  a draw takes as many numbers of the generator whatever it becomes: it depends on seed and stream only
/// Errors    npt::Error that names the text, the line and what was expected
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/random.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/base/weighted_choice.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/config.hpp>
#include <npt/io/text.hpp>
#include <npt/io/words.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Where a joint's three angles lie, in radians.
struct JointLimits {
  Vec3d low, high;
};

struct NamedPose {
  std::string name;
  double weight = 0;          ///< how often it is drawn, relative to the others
  std::vector<Vec3d> angles;  ///< [J]
};

NPT_INLINE_CLASS(class, PlanPoses);
template <class>
class BasicPlanPoses {
 public:
  /// source: names the text in errors.
  BasicPlanPoses(const BodyPlan& plan, std::string_view text, const std::string& source)
      : source_(source), ranges_(plan.joint_count()) {
    for (const JointPlan& joint : plan.joints) {
      mirrored_.push_back(joint.mirrored);
      appendage_.push_back(joint.kind == JointKind::appendage);
    }
    std::vector<bool> given(plan.joint_count());
    std::vector<std::vector<bool>> bent;
    TextLines lines(text);
    for (std::string_view line; lines.next(line);) {
      place_ = "line " + std::to_string(lines.number());
      const auto words = list_words(line);
      if (!words) fail(found_words(words), "words of a table of poses");
      if (words->empty()) continue;
      take(plan, *words, given, bent);
    }
    place_.clear();
    if (poses_.empty()) fail("no poses", "lines of: pose NAME WEIGHT");
    for (std::size_t j = 0; j < given.size(); ++j)
      if (!given[j] && given[mirrored_[j]]) ranges_[j] = mirror(ranges_[mirrored_[j]]);
    for (std::size_t p = 0; p < poses_.size(); ++p) {
      for (std::size_t j = 0; j < given.size(); ++j)
        if (!bent[p][j] && bent[p][mirrored_[j]]) poses_[p].angles[j] = mirrored(poses_[p].angles[mirrored_[j]]);
      choice_.add(poses_[p].weight);
    }
    set_limits();
  }

  std::size_t joint_count() const noexcept { return ranges_.size(); }
  std::span<const NamedPose> poses() const noexcept { return as_span(poses_); }
  /// [J] What random angles are drawn from.
  std::span<const JointLimits> ranges() const noexcept { return as_span(ranges_); }
  /// [J] What no draw leaves: the ranges, widened to hold every named pose and its mirror image.
  std::span<const JointLimits> limits() const noexcept { return as_span(limits_); }

  /// Axis angles of a pose's or a draw's angles: they differ for the root alone.
  std::vector<float> axis_angles(std::span<const Vec3d> angles) const {
    std::vector<float> result(3 * angles.size());
    for (std::size_t j = 1; j < angles.size(); ++j) {
      const Vec3f a = angles[j].template as<float>();
      result[3 * j] = a.x, result[3 * j + 1] = a.y, result[3 * j + 2] = a.z;
    }
    const Vec3d root = angles[0];
    set_joint_rotation(as_span(result), 0,
                       rotation_matrix(Vec3d{0, root.y, 0}) * rotation_matrix(Vec3d{root.x, 0, root.z}));
    return result;
  }

  /// [J] One draw in three is random in the ranges, each joint by an amount of its own; the others are one named pose
  /// or a mixture of two, with a tenth to three tenths of such a draw on top. The root turns by any angle of its range
  /// about y. Ears and jaws are always random, the right ear mostly as the left one. Half of all are mirrored.
  std::vector<Vec3d> sample_angles(Random& random) const {
    const double kind = random.uniform(), spread = random.uniform(), mixed = random.uniform();
    const std::size_t first = choice_(random), second = choice_(random);
    const bool mirror_it = random.uniform() < 0.5;
    const bool free = kind < 1.0 / 3;
    // One pose in two is mixed with another one, by at most a half.
    const double share = mixed < 0.5 ? 1.0 : 1.0 - (mixed - 0.5);
    std::vector<Vec3d> angles(joint_count());
    for (std::size_t j = 0; j < angles.size(); ++j) {
      const JointLimits& range = ranges_[j];
      const Vec3d at{random.uniform(), random.uniform(), random.uniform()};
      const double own = random.uniform();
      const Vec3d drawn{range.low.x + (range.high.x - range.low.x) * at.x,
                        range.low.y + (range.high.y - range.low.y) * at.y,
                        range.low.z + (range.high.z - range.low.z) * at.z};
      // Amounts of a joint's own keep limbs from bending all at once.
      const double amount = free || appendage_[j] ? (0.3 + 0.7 * spread) * std::sqrt(own) : 0.1 + 0.2 * spread;
      angles[j] = drawn * amount;
      if (!free) angles[j] += poses_[first].angles[j] * share + poses_[second].angles[j] * (1 - share);
      if (j == 0) angles[j].y = drawn.y;
      // Hanging or pricked: an animal's ears seldom differ.
      if (appendage_[j] && mirrored_[j] < j) angles[j] = angles[j] * 0.25 + mirrored(angles[mirrored_[j]]) * 0.75;
    }
    if (mirror_it) angles = mirror(as_span(angles));
    for (std::size_t j = 0; j < angles.size(); ++j) {
      const JointLimits& l = limits_[j];
      angles[j] = {std::clamp(angles[j].x, l.low.x, l.high.x), std::clamp(angles[j].y, l.low.y, l.high.y),
                   std::clamp(angles[j].z, l.low.z, l.high.z)};
    }
    return angles;
  }

  /// [J, 3] axis angles of a draw.
  std::vector<float> sample(Random& random) const {
    const std::vector<Vec3d> angles = sample_angles(random);
    return axis_angles(as_span(angles));
  }

  /// The same pose with left and right exchanged.
  std::vector<Vec3d> mirror(std::span<const Vec3d> angles) const {
    std::vector<Vec3d> result(angles.size());
    for (std::size_t j = 0; j < angles.size(); ++j) result[j] = mirrored(angles[mirrored_[j]]);
    return result;
  }

 private:
  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({source_, place_, std::move(found), std::move(expected)});
  }
  double number(const std::string& word) const {
    const std::optional<double> value = parse_number<double>(word);
    if (!value || !std::isfinite(*value)) fail("'" + word + "'", "a number");
    return *value;
  }
  double angle(const std::string& word) const { return number(word) * (std::numbers::pi / 180); }
  std::size_t known_joint(const BodyPlan& plan, const std::string& name) const {
    const std::size_t j = plan.joint(name);
    if (j == BodyPlan::no_joint) fail("joint '" + name + "'", "a joint of plan '" + plan.name + "'");
    return j;
  }

  static JointLimits mirror(const JointLimits& r) {
    return {{r.low.x, -r.high.y, -r.high.z}, {r.high.x, -r.low.y, -r.low.z}};
  }

  void take(const BodyPlan& plan, const std::vector<std::string>& words, std::vector<bool>& given,
            std::vector<std::vector<bool>>& bent) {
    if (words[0] == "range" && words.size() == 8) {
      const std::size_t j = known_joint(plan, words[1]);
      ranges_[j] = {{angle(words[2]), angle(words[4]), angle(words[6])},
                    {angle(words[3]), angle(words[5]), angle(words[7])}};
      const JointLimits& r = ranges_[j];
      if (!(r.low.x <= 0 && r.low.y <= 0 && r.low.z <= 0 && r.high.x >= 0 && r.high.y >= 0 && r.high.z >= 0))
        fail("a range without 0", "ranges around the rest pose");
      given[j] = true;
    } else if (words[0] == "pose" && words.size() == 3) {
      poses_.push_back({words[1], number(words[2]), std::vector<Vec3d>(plan.joint_count())});
      bent.emplace_back(plan.joint_count());
    } else if (words[0] == "bend" && words.size() == 6) {
      const auto pose = std::ranges::find(poses_, words[1], &NamedPose::name);
      if (pose == poses_.end()) fail("pose '" + words[1] + "'", "a pose that a line above names");
      const std::size_t j = known_joint(plan, words[2]);
      pose->angles[j] = {angle(words[3]), angle(words[4]), angle(words[5])};
      bent[static_cast<std::size_t>(pose - poses_.begin())][j] = true;
    } else {
      fail("'" + words[0] + "' and " + std::to_string(words.size() - 1) + " words",
           "range, pose or bend with what belongs to it");
    }
  }

  void set_limits() {
    limits_ = ranges_;
    const auto widen = [this](std::span<const Vec3d> angles) {
      for (std::size_t j = 0; j < angles.size(); ++j) {
        Vec3d &low = limits_[j].low, &high = limits_[j].high;
        const Vec3d a = angles[j];
        low = {std::min(low.x, a.x), std::min(low.y, a.y), std::min(low.z, a.z)};
        high = {std::max(high.x, a.x), std::max(high.y, a.y), std::max(high.z, a.z)};
      }
    };
    for (const NamedPose& pose : poses_) {
      widen(as_span(pose.angles));
      const std::vector<Vec3d> twin = mirror(as_span(pose.angles));
      widen(as_span(twin));
    }
  }

  std::string source_, place_;
  std::vector<std::size_t> mirrored_;  ///< [J]
  std::vector<bool> appendage_;        ///< [J]
  std::vector<JointLimits> ranges_, limits_;
  std::vector<NamedPose> poses_;
  WeightedChoice choice_;
};

}  // namespace npt::inline NPT_ABI
