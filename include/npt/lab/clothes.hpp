/// Clothes: a body in a shirt, shorts, shoes and hair, each a piece of its own around the body, as characters are
/// built. A piece is a copy of a part of the body's surface, moved out along its normals; it has that part's shape
/// directions and skin weights, so that a dressed body has an exact truth in every pose.
/// Shapes    V vertices become V + C: the body's own first, unchanged, then those of the pieces
/// Units     metres
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace body::internal {

/// Where the pieces begin and end, by the joints of the resting body.
class Wardrobe {
 public:
  explicit Wardrobe(const BodyModel& body)
      : heaviest_(body.tables().weights.heaviest_columns()), joints_(body.joints({})) {
    for (std::size_t v = 0; v < body.vertex_count(); ++v) {
      const float* p = &body.tables().v_template[3 * v];
      points_.push_back(Vec3f{p[0], p[1], p[2]}.as<double>());
    }
    for (Vec3d& n : normals_ = area_vectors(points_, body.triangles())) n = normalised(n);
  }

  const std::vector<Vec3d>& points() const { return points_; }
  const std::vector<Vec3d>& normals() const { return normals_; }

  /// To the hips, with sleeves down to the upper arms' middle.
  bool shirt(const Triangle& t) const {
    using enum SmplJoint;
    const double sleeve = 0.4 * std::abs(joint(left_shoulder).x) + 0.6 * std::abs(joint(left_elbow).x);
    return belongs(t, {pelvis, spine1, spine2, spine3, left_collar, right_collar, left_shoulder, right_shoulder}) &&
           std::abs(middle(t).x) < sleeve && middle(t).y > joint(left_hip).y - 0.02;
  }
  /// From above the pelvis to the thighs' middle.
  bool shorts(const Triangle& t) const {
    using enum SmplJoint;
    return belongs(t, {pelvis, left_hip, right_hip, spine1}) && middle(t).y < joint(pelvis).y + 0.1 &&
           middle(t).y > 0.6 * joint(left_hip).y + 0.4 * joint(left_knee).y;
  }
  bool shoe(const Triangle& t) const {
    using enum SmplJoint;
    return belongs(t, {left_ankle, right_ankle, left_foot, right_foot}) && middle(t).y < joint(left_ankle).y + 0.02;
  }
  bool hair(const Triangle& t) const {
    return belongs(t, {SmplJoint::head}) && middle(t).y > joint(SmplJoint::head).y + 0.09;
  }

 private:
  Vec3d joint(SmplJoint j) const { return joints_[joint_index(j)]; }
  Vec3d middle(const Triangle& t) const { return (points_[t[0]] + points_[t[1]] + points_[t[2]]) / 3; }
  bool belongs(const Triangle& t, std::initializer_list<SmplJoint> joints) const {
    return std::ranges::all_of(t, [&](std::uint32_t v) {
      return std::ranges::any_of(joints, [&](SmplJoint j) { return heaviest_[v] == joint_index(j); });
    });
  }

  std::vector<std::uint32_t> heaviest_;  ///< [V] joint
  std::vector<Vec3d> joints_;
  std::vector<Vec3d> points_, normals_;  ///< [V] of the resting body
};

}  // namespace body::internal

/// The dressed body; with_proportions(body) can be dressed, too.
/// Errors  npt::Error for a body without SMPL's 24 joints
inline BodyModel with_clothes(const BodyModel& body) {
  if (body.joint_count() != smpl_joint_count)
    throw Error({.file = "body",
                 .found = std::to_string(body.joint_count()) + " joints",
                 .expected = "SMPL's " + std::to_string(smpl_joint_count) + ", for clothes"});
  const body::internal::Wardrobe wardrobe(body);
  BodyTables tables = body.tables();
  std::vector<std::uint32_t> copied(body.vertex_count());  // [V + C] the vertex of the body that each is a copy of
  std::iota(copied.begin(), copied.end(), 0U);

  const auto wear = [&](double out, const auto& covers) {
    std::vector<std::uint32_t> copy_of(body.vertex_count(), no_index);
    for (Triangle t : body.triangles()) {
      if (!covers(t)) continue;
      for (std::uint32_t& v : t) {
        if (copy_of[v] == no_index) {
          copy_of[v] = static_cast<std::uint32_t>(copied.size());
          copied.push_back(v);
          const Vec3f p = (wardrobe.points()[v] + wardrobe.normals()[v] * out).as<float>();
          tables.v_template.insert(tables.v_template.end(), {p.x, p.y, p.z});
        }
        v = copy_of[v];
      }
      tables.triangles.push_back(t);
    }
  };
  wear(0.014, [&](const Triangle& t) { return wardrobe.shirt(t); });
  wear(0.02, [&](const Triangle& t) { return wardrobe.shorts(t); });
  wear(0.01, [&](const Triangle& t) { return wardrobe.shoe(t); });
  wear(0.02, [&](const Triangle& t) { return wardrobe.hair(t); });

  for (std::vector<float>* rows : {&tables.shapedirs, &tables.posedirs}) {
    const std::size_t width = rows->size() / body.vertex_count();
    rows->reserve(width * copied.size());
    for (std::size_t v = body.vertex_count(); v < copied.size(); ++v)
      for (std::size_t k = 0; k < width; ++k) rows->push_back((*rows)[copied[v] * width + k]);
  }
  tables.weights = tables.weights.gathered(copied);
  tables.J_regressor.columns = copied.size();
  return BodyModel(std::move(tables), "body with clothes");
}

}  // namespace npt::inline NPT_ABI
