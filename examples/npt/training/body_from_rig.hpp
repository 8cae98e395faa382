/// What all rigs that become bodies of a plan have in common, whichever way their joints are found: large faces are
/// halved, limbs are turned to where the template's point, the trunk's weights are shared among its joints, and the
/// whole is a body with canonical coordinates and with its clips as the plan's joint angles.
/// Shapes    canonical: [V, 3], metres, the template's mean shape in its rest pose; clips: of each frame [J, 3] radians
/// Numerics  in double, rounded once
/// Errors    npt::Error that names file and joint: bones without a length, limbs that no vertex moves with
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/config.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/scene/clip.hpp>
#include <npt/scene/pose.hpp>
#include <npt/scene/scene.hpp>
#include <training/canonical_places.hpp>
#include <training/joint_regression.hpp>
#include <training/plan_parts.hpp>
#include <training/rest_surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct RiggedBodyOptions {
  /// Metres; longer edges are halved, so that places can be told for points within large faces. 0: the rig's vertices.
  double longest_edge = 0;
  double frame_rate = 0;  ///< of the poses that are taken from the rig's clips, in a second; 0: none are
};

/// A rig as a body with the joints of any plan.
struct PlannedBody {
  std::shared_ptr<const BodyModel> body;
  std::vector<float> canonical;
  std::vector<std::string> clip_names;
  std::vector<std::vector<std::vector<float>>> clips;  ///< axis angles [J, 3] of each clip's frames
  std::vector<bool> turned;                            ///< [J] whether a joint of the rig turns it
  Matrix3 facing = Matrix3::identity();                ///< from the scene's axes to the body's
  double metres = 1;                                   ///< in a unit of the scene
};

namespace rig::internal {

class BodyFromRig {
 protected:
  BodyFromRig(const Rig& rig, const RiggedBodyOptions& options, const BodyModel& model, const BodyPlan& plan)
      : rig_(rig),
        options_(options),
        model_(rest_surface(of_plan(model, plan))),
        parts_(plan, model_.joints, lowest(model_)),
        found_(plan.joint_count(), no_item),
        turning_(plan.joint_count()),
        bind_(plan.joint_count()) {
    model_triangles_ = model.tables().triangles;
    for (const JointWeights& row : model_.weights) {
      double sum = 0;
      for (std::size_t j = 0; j < row.size(); ++j)
        if (parts_.kind(j) == JointKind::appendage) sum += row[j];
      model_.appendage.push_back(sum > 0.5);
    }
    triangles_ = rig.triangles;
    positions_.reserve(rig.positions.size());
    for (const Vec3f p : rig.positions) positions_.push_back(p.as<double>());
  }

  static const BodyModel& of_plan(const BodyModel& model, const BodyPlan& plan) {
    if (model.joint_count() != plan.joint_count())
      throw Error({.file = "plan",
                   .found = std::to_string(plan.joint_count()) + " joints",
                   .expected = std::to_string(model.joint_count()) + ", as the body has"});
    return model;
  }

  [[noreturn]] void fail(std::size_t joint, std::string found, std::string expected) const {
    std::string place = "joint " + parts_.plan().joints[joint].name;
    if (found_[joint] != no_item) place += " ('" + rig_.joint_name(found_[joint]) + "')";
    throw Error({rig_.name, std::move(place), std::move(found), std::move(expected)});
  }

  /// Which of the plan's joints moves a vertex, by the joint of the plan that owns each of the rig's.
  void sum_weights(const std::vector<std::size_t>& owner, const std::vector<bool>& prop) {
    for (std::size_t v = 0; v < rig_.positions.size(); ++v) {
      JointWeights& row = rest_.weights.emplace_back(parts_.count());
      double props = 0;
      for (std::size_t i = rig_.weights.start[v]; i < rig_.weights.start[v + 1]; ++i) {
        const double w = static_cast<double>(rig_.weights.value[i]);
        row[owner[rig_.weights.column[i]]] += w;
        if (prop[rig_.weights.column[i]]) props += w;
      }
      props_.push_back(props > 0.5 || rig_.hangs[v]);
    }
  }

  void check_bones(const std::vector<std::size_t>& joints) const {
    for (const std::size_t j : joints)
      if (const double far = length(bind_[parts_.toward(j)] - bind_[j]); !(far > 1e-3))
        fail(j, "a bone of length " + std::to_string(far) + " to " + parts_.plan().joints[parts_.toward(j)].name,
             "a length above 0");
  }
  /// Each of the groups needs a surface.
  void check_surfaces(const std::vector<std::vector<std::size_t>>& groups) const {
    for (const std::vector<std::size_t>& group : groups) {
      double area = 0;
      for (const std::size_t j : group) area += rest_.spread[j].area;
      if (!(area > 0)) fail(group.front(), "no vertex with a weight of it", "a part of the surface that it moves");
    }
  }

  void halve_long_edges() {
    if (options_.longest_edge > 0)
      for (int round = 0; round < 8 && halve_edges(options_.longest_edge); ++round) {
      }
  }

  /// Limbs point where the template's do; trunk, head and feet stay as they are.
  void take_rest_pose() {
    turns_.assign(parts_.count(), Matrix3::identity());
    rest_.joints.assign(parts_.count(), {});
    for (std::size_t j = 0; j < parts_.count(); ++j) {
      const Matrix3 above = j == 0 ? Matrix3::identity() : turns_[parts_.parent(j)];
      turns_[j] = above;
      rest_.joints[j] =
          j == 0 ? bind_[0] : rest_.joints[parts_.parent(j)] + above * (bind_[j] - bind_[parts_.parent(j)]);
      if (parts_.stays(j)) {
        turns_[j] = Matrix3::identity();
      } else if (const std::size_t end = parts_.toward(j); end != j && !parts_.is_girdle(j)) {
        const Vec3d own = above * (bind_[end] - bind_[j]), goal = model_.joints[end] - model_.joints[j];
        if (length(own) > 0) turns_[j] = shortest_turn(normalised(own), normalised(goal)) * above;
      }
    }
    rest_.points.resize(positions_.size());
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      rest_.points[v] = skinned(
          rest_.weights[v], [&](std::size_t j) { return rest_.joints[j] + turns_[j] * (positions_[v] - bind_[j]); });
      share_trunk(rest_.weights[v], coordinate(rest_.points[v], parts_.axis()));
    }
  }

  void measure() {
    model_.measure(parts_, model_triangles_, {});
    rest_.measure(parts_, triangles_, props_);
  }

  PlannedBody make_body(std::map<std::string, std::string> metadata) const {
    PlannedBody result;
    result.canonical = CanonicalPlaces(parts_, rest_, model_, props_).places();
    BodyTables tables;
    for (const Vec3d p : rest_.points) {
      const Vec3f q = p.as<float>();
      tables.v_template.insert(tables.v_template.end(), {q.x, q.y, q.z});
    }
    tables.triangles = triangles_;
    for (const JointPlan& joint : parts_.plan().joints) {
      tables.parents.push_back(joint.parent);
      tables.joint_names.push_back(joint.name);
    }
    tables.metadata = std::move(metadata);
    tables.metadata["source"] = rig_.name;
    tables.weights.columns = parts_.count();
    for (const JointWeights& row : rest_.weights) {
      for (std::size_t j = 0; j < row.size(); ++j)
        if (row[j] > 0) tables.weights.append(static_cast<std::uint32_t>(j), static_cast<float>(row[j]));
      tables.weights.end_row();
    }
    tables.J_regressor = regressed_joints(rest_.points, rest_.joints);
    if (options_.frame_rate > 0)
      for (const Clip& clip : rig_.scene.clips) {
        result.clip_names.push_back(clip.name);
        result.clips.push_back(angles_of(clip));
      }
    for (const auto& turning : turning_) result.turned.push_back(!turning.empty());
    result.facing = facing_;
    result.body = std::make_shared<const BodyModel>(std::move(tables), rig_.name);
    return result;
  }

  const Rig& rig_;
  RiggedBodyOptions options_;
  RestSurface model_, rest_;  ///< the template; the rig in its rest pose
  std::vector<Triangle> model_triangles_;
  PlanParts parts_;
  std::vector<std::size_t> found_;  ///< [J] of the rig
  /// [J] Which joints of the rig turn each of the plan's, and by what share; none: it goes with the one before it.
  std::vector<std::vector<std::pair<std::size_t, double>>> turning_;
  std::vector<bool> props_;       ///< vertices
  std::vector<Vec3d> positions_;  ///< in the bind pose, upright
  std::vector<Triangle> triangles_;
  std::vector<Vec3d> bind_;  ///< [J]
  std::vector<Matrix3> turns_;
  Matrix3 upright_ = Matrix3::identity();  ///< of the bind pose's axes
  bool faces_aside_ = false;
  Matrix3 facing_ = Matrix3::identity();  ///< of the scene's axes, where faces_aside_

 private:
  /// Halves every edge that is longer than asked for, once; false where there is none.
  bool halve_edges(double longest) {
    std::vector<Edge> edges;
    for (const auto& [a, b] : edges_of_triangles(as_span(triangles_)))
      if (length(positions_[a] - positions_[b]) > longest) edges.push_back({a, b});
    if (edges.empty()) return false;
    const auto before = static_cast<std::uint32_t>(positions_.size());
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const Edge edge{std::min(a, b), std::max(a, b)};
      const auto at = std::lower_bound(edges.begin(), edges.end(), edge);
      return at != edges.end() && *at == edge ? before + static_cast<std::uint32_t>(at - edges.begin()) : no_index;
    };
    for (const auto& [a, b] : edges) {
      positions_.push_back((positions_[a] + positions_[b]) * 0.5);
      JointWeights row(parts_.count());
      for (std::size_t j = 0; j < row.size(); ++j) row[j] = (rest_.weights[a][j] + rest_.weights[b][j]) * 0.5;
      rest_.weights.push_back(row);
      props_.push_back(props_[a] && props_[b]);
    }
    std::vector<Triangle> smaller;
    for (Triangle t : triangles_) {
      std::array<std::uint32_t, 3> m{middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0])};
      const auto halved = std::ranges::count_if(m, [](std::uint32_t v) { return v != no_index; });
      // One edge: the first. Two: all but the last.
      while ((halved == 1 && m[0] == no_index) || (halved == 2 && m[2] != no_index))
        std::rotate(t.begin(), t.begin() + 1, t.end()), std::rotate(m.begin(), m.begin() + 1, m.end());
      if (halved == 0) smaller.push_back(t);
      if (halved == 1) smaller.insert(smaller.end(), {{t[0], m[0], t[2]}, {m[0], t[1], t[2]}});
      if (halved == 2) smaller.insert(smaller.end(), {{m[0], t[1], m[1]}, {t[0], m[0], m[1]}, {t[0], m[1], t[2]}});
      if (halved == 3)
        smaller.insert(smaller.end(), {{t[0], m[0], m[2]}, {m[0], t[1], m[1]}, {m[2], m[1], t[2]}, {m[0], m[1], m[2]}});
    }
    triangles_ = std::move(smaller);
    return true;
  }

  std::vector<std::vector<float>> angles_of(const Clip& clip) const {
    std::vector<std::vector<float>> frames;
    for (const double time : frame_times(clip, options_.frame_rate)) {
      const std::vector<Affine> motions = rig_.motions(&clip, time);
      std::vector<Matrix3> whole(parts_.count());
      std::vector<float>& frame = frames.emplace_back(3 * parts_.count());
      for (std::size_t j = 0; j < parts_.count(); ++j) {
        const Matrix3 above = j == 0 ? Matrix3::identity() : whole[parts_.parent(j)];
        whole[j] = turning_[j].empty() ? above
                                       : matrix_of(quaternion_of(turned(turning_[j], motions) * upright_.transposed() *
                                                                 turns_[j].transposed()));
        const Vec3f angle = axis_angle(quaternion_of(above.transposed() * whole[j])).as<float>();
        frame[3 * j] = angle.x, frame[3 * j + 1] = angle.y, frame[3 * j + 2] = angle.z;
      }
    }
    return frames;
  }
  Matrix3 turned(const std::vector<std::pair<std::size_t, double>>& shares, const std::vector<Affine>& motions) const {
    Matrix3 sum = orthonormal(motions[shares.front().first].linear);
    if (shares.size() > 1) {
      sum = {};
      for (const auto& [joint, share] : shares) sum += orthonormal(motions[joint].linear) * share;
      sum = orthonormal(sum);
    }
    return faces_aside_ ? facing_ * sum : sum;
  }

  /// The trunk's joints share its weight by the place along it, each strongest half way to the next.
  void share_trunk(JointWeights& row, double place) const {
    const std::span<const std::size_t> chain = parts_.trunk();
    const std::size_t last = chain.size() - 2;
    double trunk = 0;
    for (std::size_t i = 0; i <= last; ++i) trunk += std::exchange(row[chain[i]], 0.0);
    if (!(trunk > 0)) return;
    const auto at = [&](std::size_t i) { return coordinate(rest_.joints[chain[i]], parts_.axis()); };
    const auto centre = [&](std::size_t i) { return (at(i) + at(i + 1)) / 2; };
    std::size_t i = 0;
    while (i < last && place > centre(i + 1)) ++i;
    if (i == last || place <= centre(0)) {
      row[chain[i]] += trunk;
      return;
    }
    const double t = (place - centre(i)) / (centre(i + 1) - centre(i));
    row[chain[i]] += trunk * (1 - t), row[chain[i + 1]] += trunk * t;
  }
};

}  // namespace rig::internal

}  // namespace npt::inline NPT_ABI
