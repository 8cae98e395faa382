/// An identity bound to the body that was fitted to it: its joints, skin weights and hands, and how angles move it.
/// Shapes    J joints of a kind's plan, J' with those of fingers; people's are 24 and 40
/// Units     metres and radians, in the body's coordinates
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/hands.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/mesh/figure_pieces.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/skin/body_weights.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(struct, BoundCharacter);
/// An identity bound to the body that was fitted to it.
template <class>
struct BasicBoundCharacter {
  BodyEstimate estimate;
  BodyFit body;                   ///< the estimate's, with finger joints: J'
  std::vector<Vec3d> joints;      ///< [J'] where they are, in the body's coordinates
  std::array<bool, 2> fingers{};  ///< whether the hands have any
  std::vector<Vec3d> points;      ///< [V] in the body's coordinates
  SparseMatrix weights;           ///< [V, J']; an empty row: a vertex that no joint moves

  /// [J', 3] the pose's joint angles [J, 3] with its hands, where this character has fingers to close.
  std::vector<float> angles(const BodyKind& kind, std::span<const float> axis_angles, const BodyEstimate& pose) const {
    return kind.bound_angles(axis_angles,
                             {(fingers[0] ? pose : estimate).hands[0], (fingers[1] ? pose : estimate).hands[1]});
  }

  /// [J'] How the joints move to joint angles [J', 3], in the body's coordinates.
  std::vector<Rigid> motions(const BodyKind& kind, std::span<const float> axis_angles) const {
    return skeleton_motions(kind.bound_body(), body, axis_angles);
  }

  /// [J'] How the joints move to joint angles [J', 3], in the mesh's own unit and place.
  std::vector<Affine> motions_in_place(const BodyKind& kind, std::span<const float> axis_angles) const {
    std::vector<Affine> result;
    for (const Rigid& m : motions(kind, axis_angles)) {
      const Vec3d centre = estimate.centre;
      result.push_back({m.rotation, m.shift / estimate.metres + centre - m.rotation * centre});
    }
    if (has_still_vertices()) result.emplace_back();
    return result;
  }

  /// Writes the vertices with joint angles [J', 3], in the mesh's own unit and place. result: [V, 3]
  void pose(const BodyKind& kind, std::span<const float> axis_angles, std::span<float> result) const {
    if (result.size() != 3 * points.size())
      throw Error({.file = "result",
                   .found = std::to_string(result.size()) + " numbers",
                   .expected = "three for each of " + std::to_string(points.size()) + " vertices"});
    const std::vector<Rigid> all = motions(kind, axis_angles);
    for (std::size_t v = 0; v < points.size(); ++v) {
      const Vec3f p = (moved(v, all) / estimate.metres + estimate.centre).template as<float>();
      result[3 * v] = p.x, result[3 * v + 1] = p.y, result[3 * v + 2] = p.z;
    }
  }

  /// The skeleton and skin weights, in the mesh's own unit, place and pose.
  SkinnedSkeleton skeleton(const BodyKind& kind) const {
    SkinnedSkeleton result;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const int parent = kind.bound_body().tables().parents[j];
      result.names.push_back(kind.skeleton_names[j]);
      result.parents.push_back(parent < 0 ? SkinnedSkeleton::no_parent : static_cast<std::size_t>(parent));
      result.joints.push_back(joints[j] / estimate.metres + estimate.centre);
    }
    if (has_still_vertices()) {
      result.names.emplace_back(still_joint_name);
      result.parents.push_back(SkinnedSkeleton::no_parent);
      result.joints.push_back(estimate.centre);
    }
    result.start.push_back(0);
    for (std::size_t v = 0; v < weights.rows; ++v) {
      for (std::size_t i = weights.start[v]; i < weights.start[v + 1]; ++i)
        result.influences.push_back({static_cast<std::uint16_t>(weights.column[i]), weights.value[i]});
      if (is_still(v)) result.influences.push_back({static_cast<std::uint16_t>(joints.size()), 1});
      result.start.push_back(result.influences.size());
    }
    return result;
  }

  /// Of a floor or whatever else isn't the figure's.
  bool is_still(std::size_t v) const { return weights.start[v] == weights.start[v + 1]; }
  bool has_still_vertices() const {
    return std::adjacent_find(weights.start.begin(), weights.start.end()) != weights.start.end();
  }
  /// Of the joint that a skeleton has for such vertices, behind the body's.
  static constexpr const char* still_joint_name = "scenery";

  /// Where the joints' motions [J'] bring a vertex, in the body's coordinates.
  Vec3d moved(std::size_t v, std::span<const Rigid> motions) const {
    if (is_still(v)) return points[v];
    return skinned(weights.columns_of(v), weights.values_of(v), [&](std::size_t j) { return motions[j](points[v]); });
  }
};

namespace skin::internal {

/// Radians of the middle joints beyond which fingers may touch the palm.
inline constexpr double least_closed = 0.8;

/// Without the rows of vertices that none of the triangles has.
NPT_INLINE SparseMatrix weights_of_figure(const SparseMatrix& all, std::span<const Triangle> triangles) {
  std::vector<bool> own(all.rows);
  for (const Triangle& t : triangles)
    for (const std::uint32_t v : t) own[v] = true;
  SparseMatrix weights;
  weights.columns = all.columns;
  for (std::size_t v = 0; v < all.rows; ++v) {
    for (std::size_t i = all.start[v]; own[v] && i < all.start[v + 1]; ++i) weights.append(all.column[i], all.value[i]);
    weights.end_row();
  }
  return weights;
}

}  // namespace skin::internal

/// Binds a mesh to the body that was estimated for it.
/// Errors    npt::Error for an estimate without a body
template <Executor Exec = SerialExecutor>
BoundCharacter bind_character(const BodyKind& kind, const MeshView& mesh, BodyEstimate estimate,
                              const Exec& executor = Exec()) {
  BoundCharacter character;
  character.estimate = std::move(estimate);
  const BodyEstimate& e = character.estimate;
  expect_body(e, mesh.name);
  character.body = e.fit.body;
  character.body.axis_angles = kind.bound_angles(as_span(e.fit.body.axis_angles), e.hands);
  character.points = e.points_of(mesh);
  const auto closed = [&e](std::size_t side) {
    const auto& bend = e.hands[side].middle;
    return *std::max_element(bend.begin(), bend.end()) > skin::internal::least_closed;
  };
  std::vector<Triangle> kept;
  const std::span<const Triangle> own = figure_triangles(mesh, e.figure, kept);
  BoundWeights bound = body_weights(kind, character.body, character.points, own,
                                    {.facing = e.fit.facing, .closed = {closed(0), closed(1)}}, executor);
  character.fingers = bound.fingers;
  character.weights =
      e.figure.empty() ? std::move(bound.weights) : skin::internal::weights_of_figure(bound.weights, own);
  character.joints = fitted_joints(kind.bound_body(), character.body);
  return character;
}

}  // namespace npt::inline NPT_ABI
