/// What a plan of bodies says about the parts of a surface: chains of joints, the axis of the trunk, what stays as it
/// is bound, and which parts are known by the spread of their points rather than by a bone.
///   const PlanParts parts(people_plan(), mannequin().joints({}), floor);
/// Shapes    joints: [J], metres, of the template at rest, which stands up along y
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

namespace rig::internal {

class PlanParts {
 public:
  /// floor: the lowest point of the template
  PlanParts(const BodyPlan& plan, std::span<const Vec3d> joints, double floor) : plan_(plan) {
    double top = floor;
    for (const Vec3d p : joints) top = std::max(top, p.y);
    trunk_.push_back(0);
    while (is_trunk(trunk_.back()) && toward(trunk_.back()) != trunk_.back()) trunk_.push_back(toward(trunk_.back()));
    const Vec3d along = joints[trunk_.back()] - joints[0];
    axis_ = std::abs(along.z) > std::abs(along.y) ? 2 : 1;
    for (std::size_t j = 0; j < plan.joint_count(); ++j) {
      const JointKind kind = plan.joints[j].kind;
      const std::size_t tip = kind == JointKind::end ? toward(j) : j;
      // What a limb stands on is within a tenth of the height; a hand or a tail's end is higher.
      const bool stands =
          (kind == JointKind::end || kind == JointKind::tip) && joints[tip].y < floor + (top - floor) / 10;
      const Vec3d before = j == 0 ? Vec3d{} : joints[j] - joints[parent(j)], after = joints[tip] - joints[j];
      // A person's foot turns off by 70 degrees from the shin, a dog's hind foot by 53 from its shank.
      const bool bone = stands && kind == JointKind::end && dot(normalised(before), normalised(after)) > 0.5;
      foot_bone_.push_back(bone);
      stays_.push_back(is_trunk(j) || kind == JointKind::neck || kind == JointKind::head || (stands && !bone));
    }
  }

  const BodyPlan& plan() const noexcept { return plan_; }
  std::size_t count() const noexcept { return plan_.joint_count(); }
  /// Requires  j > 0
  std::size_t parent(std::size_t j) const { return static_cast<std::size_t>(plan_.joints[j].parent); }
  /// Where the bone leads; the joint itself where it has none.
  std::size_t toward(std::size_t j) const { return plan_.joints[j].toward; }
  JointKind kind(std::size_t j) const { return plan_.joints[j].kind; }
  bool is_trunk(std::size_t j) const { return kind(j) == JointKind::root || kind(j) == JointKind::spine; }
  bool is_girdle(std::size_t j) const { return kind(j) == JointKind::girdle; }
  /// In the rest pose as it is bound, not as the template's points.
  bool stays(std::size_t j) const { return stays_[j]; }
  /// Stretched by the spread of its points: heads, hands, feet, paws, ears.
  bool is_round(std::size_t j) const {
    const JointKind k = kind(j);
    return k == JointKind::head || k == JointKind::appendage || is_foot_or_hand(j);
  }
  /// Hand and wrist, ankle and toes count as one; the joint itself where it has no such other.
  std::size_t other(std::size_t j) const {
    if (!is_foot_or_hand(j)) return j;
    if (kind(j) == JointKind::end) return toward(j);
    return kind(parent(j)) == JointKind::end && !foot_bone_[parent(j)] ? parent(j) : j;
  }
  /// From the root to the joint that the last of the spine leads to.
  std::span<const std::size_t> trunk() const { return trunk_; }
  /// Coordinate along the trunk: 1 for those who stand upright, 2 for those on four legs; and the third beside x.
  std::size_t axis() const noexcept { return axis_; }
  std::size_t across() const noexcept { return 3 - axis_; }
  /// A row's weight of a part, with the other one's.
  template <class Row>
  double weight(const Row& row, std::size_t part) const {
    const std::size_t o = other(part);
    return o == part ? row[part] : row[std::min(part, o)] + row[std::max(part, o)];
  }

 private:
  bool is_foot_or_hand(std::size_t j) const {
    // A tail's tip is a bone's.
    const bool end = kind(j) == JointKind::end && !foot_bone_[j];
    return end || (kind(j) == JointKind::tip && kind(parent(j)) == JointKind::end);
  }

  BodyPlan plan_;
  std::vector<std::size_t> trunk_;
  std::size_t axis_ = 1;
  std::vector<bool> stays_, foot_bone_;
};

/// A coordinate by its number.
inline double& coordinate(Vec3d& p, std::size_t axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }
inline double coordinate(const Vec3d& p, std::size_t axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

}  // namespace rig::internal

}  // namespace npt::inline NPT_ABI
