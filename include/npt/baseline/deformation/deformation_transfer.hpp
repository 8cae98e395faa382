/// Deformation transfer: the target mesh deforms as the source mesh does. Prepared once for a source's and a target's
/// rest mesh and pairs of their triangles, then asked for any number of the source's poses.
///   minimise over the target's vertices  sum over pairs (s, t) of ||S_s - T_t||_F^2
/// with the deformation gradients S of the source and T of the target (deformation_system.hpp).
/// What the gradients leave open is the place of each piece of the target:
///   pieces that lie on each other, as clothes on a body, are linked where they do (piece_links.hpp);
///   the largest piece moves as the centre of its paired source triangles does, scaled by the size of target to source;
///   what is still apart, and each vertex without a face, keeps its place on the nearest triangle (piece_tree.hpp).
/// The undeformed source gives the target back, and a source that is the target, and is one piece, is followed exactly.
/// Shapes    pose: [Vs, 3] floats, a pose of the source's vertices; result: [Vt, 3], in the target's units and the
///           source's directions
/// Numerics  double; the same bits for any executor. A NaN in the pose comes out as NaNs
/// Threads   one object may be used by several threads
/// Errors    npt::Error for meshes without an area, for triangle numbers out of range, no pairs, a pose of another size
/// Source    Sumner and Popovic, "Deformation Transfer for Triangle Meshes", SIGGRAPH 2004, sections 3 and 4
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/baseline/deformation/correspondence.hpp>
#include <npt/baseline/deformation/deformation_gradient.hpp>
#include <npt/baseline/deformation/deformation_system.hpp>
#include <npt/baseline/deformation/piece_tree.hpp>
#include <npt/baseline/deformation/surface.hpp>
#include <npt/baseline/deformation/triangle_sources.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/piece_links.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/union_find.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

struct DeformationTransferOptions {
  /// Vertices of one mesh at the same point in rest move together. False: seams open.
  bool weld = true;
  /// Pieces that lie on each other hold together. False: each keeps to the nearest triangle only.
  bool link_pieces = true;
  /// The rotation from the source's directions to the target's: for a target that faces another way.
  Matrix3 turn = Matrix3::identity();
};

class DeformationTransfer {
 public:
  /// A triangle of the target without a pair takes those of the nearest triangle that has some.
  DeformationTransfer(const Mesh& source, const Mesh& target, std::span<const TrianglePair> pairs,
                      const DeformationTransferOptions& options = {})
      : source_(deformation::surface_of(source, "source", options.weld)),
        target_(deformation::surface_of(target, "target", options.weld)),
        source_vertices_(source.vertex_count()),
        turn_(options.turn),
        sources_(source_, target_, pairs),
        pieces_(deformation::pieces_of(target_)) {
    for (std::size_t s = 0; s < source_.triangles.size(); ++s) {
      const auto [a, b, c] = source_.corners(s);
      source_rest_.push_back(source_.flat[s] != 0 ? RestTriangle() : RestTriangle(a, b, c));
    }
    const std::vector<Edge> links = options.link_pieces ? link_pieces() : std::vector<Edge>{};
    system_.emplace(target_, sources_, pieces_, links);
    place_largest();
    place_others();
  }

  std::size_t target_vertex_count() const noexcept { return target_.point_of.size(); }

  /// The target's vertices for a pose of the source.
  template <Executor Exec = SerialExecutor>
  void operator()(std::span<const float> pose, std::span<float> result, const Exec& executor = Exec()) const {
    if (pose.size() != 3 * source_vertices_)
      throw Error({.file = "deformed source",
                   .found = std::to_string(pose.size() / 3) + " vertices",
                   .expected = std::to_string(source_vertices_) + ", as many as the source's rest mesh has"});
    NPT_ASSERT(result.size() == 3 * target_vertex_count());
    std::vector<Vec3d> posed(source_.points.size());
    source_.points_at(pose, posed);
    const std::vector<Matrix3> gradients = target_gradients(posed, executor);
    std::vector<Vec3d> points = system_->solve(gradients, executor);
    place(points, posed, gradients);
    for (std::size_t v = 0; v < target_.point_of.size(); ++v) {
      const Vec3f p = points[target_.point_of[v]].as<float>();
      result[3 * v] = p.x, result[3 * v + 1] = p.y, result[3 * v + 2] = p.z;
    }
  }

 private:
  /// Links between the pieces of the target, which then count as one.
  std::vector<Edge> link_pieces() {
    if (pieces_.count < 2) return {};
    double area = 0;
    for (std::size_t t = 0; t < target_.triangles.size(); ++t) {
      const auto [a, b, c] = target_.corners(t);
      area += length(cross(b - a, c - a)) / 2;
    }
    std::vector<Edge> links = piece_links(target_.points, target_.triangles, link_reach * std::sqrt(area));
    UnionFind linked(pieces_.count);
    for (const auto& [p, q] : links) linked.unite(pieces_.of_point[p], pieces_.of_point[q]);
    for (std::uint32_t& piece : pieces_.of_point) piece = linked.find(piece);
    return links;
  }

  std::size_t pair_count(std::size_t t) const { return sources_.of(t).size(); }

  /// Whether the target's place is attached to this triangle: those of the largest piece with pairs of their own.
  bool guides(std::size_t t) const { return target_.flat[t] == 0 && pieces_.of_point[target_.triangles[t][0]] == 0; }

  /// The centre of the source triangles that are paired with the largest piece.
  Vec3d paired_source_centre(std::span<const Vec3d> positions) const {
    Vec3d sum;
    std::size_t count = 0;
    for (std::size_t t = 0; t < target_.triangles.size(); ++t) {
      if (!guides(t)) continue;
      for (const std::uint32_t s : sources_.of(t)) sum += source_.centroid(s, positions);
      count += pair_count(t);
    }
    return sum / static_cast<double>(count);
  }

  Vec3d largest_piece_centre(std::span<const Vec3d> positions) const {
    Vec3d sum;
    std::size_t count = 0;
    for (std::size_t t = 0; t < target_.triangles.size(); ++t) {
      if (!guides(t)) continue;
      sum += target_.centroid(t, positions) * static_cast<double>(pair_count(t));
      count += pair_count(t);
    }
    return sum / static_cast<double>(count);
  }

  void place_largest() {
    source_centre_ = paired_source_centre(source_.points);
    target_centre_ = largest_piece_centre(target_.points);
    double source = 0, target = 0;
    for (std::size_t t = 0; t < target_.triangles.size(); ++t) {
      if (!guides(t)) continue;
      for (const std::uint32_t s : sources_.of(t)) {
        const Vec3d d = source_.centroid(s) - source_centre_, e = target_.centroid(t) - target_centre_;
        source += dot(d, d);
        target += dot(e, e);
      }
    }
    scale_ = source > 0 && target > 0 ? std::sqrt(target / source) : 1;
  }

  void place_others() {
    std::vector<char> roots(pieces_.count, 1);
    for (const std::uint32_t piece : pieces_.of_point) roots[piece] = piece == 0 ? 1 : 0;
    if (std::ranges::count(roots, 0) > 0) hooks_ = deformation::PieceTree(target_, pieces_.of_point, roots).hooks();
  }

  /// For each target triangle the sum of its sources' gradients, in the target's directions.
  template <Executor Exec>
  std::vector<Matrix3> target_gradients(std::span<const Vec3d> posed, const Exec& executor) const {
    std::vector<Matrix3> source(source_.triangles.size()), target(target_.triangles.size());
    for_ranges(executor, source.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t s = first; s < last; ++s) {
        if (source_.flat[s] != 0) continue;
        const auto [a, b, c] = source_.corners(s, posed);
        source[s] = source_rest_[s].gradient(a, b, c);
      }
    });
    const bool turned = turn_ != Matrix3::identity();
    for_ranges(executor, target.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t t = first; t < last; ++t) {
        for (const std::uint32_t s : sources_.of(t)) target[t] += source[s];
        if (turned) target[t] = turn_ * target[t] * turn_.transposed();
      }
    });
    return target;
  }

  /// Moves every piece to its place.
  void place(std::span<Vec3d> points, std::span<const Vec3d> posed, std::span<const Matrix3> gradients) const {
    std::vector<Vec3d> shift(pieces_.count);
    const Vec3d moved = turn_ * (paired_source_centre(posed) - source_centre_) * scale_;
    shift[0] = target_centre_ + moved - largest_piece_centre(points);
    for (const deformation::Hook& hook : hooks_) {
      const std::size_t t = hook.at.triangle;
      const auto [a, b, c] = target_.corners(t, points);
      const Vec3d at = a * hook.at.weights[0] + b * hook.at.weights[1] + c * hook.at.weights[2];
      const Vec3d offset =
          gradients[t] * (target_.points[hook.point] - hook.at.point) / static_cast<double>(pair_count(t));
      shift[hook.piece] = at + shift[pieces_.of_point[target_.triangles[t][0]]] + offset - points[hook.point];
    }
    for (std::size_t p = 0; p < points.size(); ++p) points[p] += shift[pieces_.of_point[p]];
  }

  /// A fiftieth of the root of the surface's area, as in detail_refiner.hpp.
  static constexpr double link_reach = 0.02;

  deformation::Surface source_, target_;
  std::size_t source_vertices_;
  Matrix3 turn_;
  deformation::TriangleSources sources_;
  std::vector<RestTriangle> source_rest_;  ///< [Ts]
  deformation::Pieces pieces_;             ///< of the target
  std::optional<deformation::DeformationSystem> system_;
  Vec3d source_centre_, target_centre_;
  double scale_ = 1;
  std::vector<deformation::Hook> hooks_;  ///< of the pieces but the largest
};

/// The target mesh for a pose of the source; normals are recomputed if it has any.
template <Executor Exec = SerialExecutor>
Mesh deform(const DeformationTransfer& transfer, Mesh target, const Mesh& source_pose, const Exec& executor = Exec()) {
  if (target.vertex_count() != transfer.target_vertex_count())
    throw Error({.file = "target",
                 .found = std::to_string(target.vertex_count()) + " vertices",
                 .expected = std::to_string(transfer.target_vertex_count()) + ", as the transfer was prepared for"});
  transfer(source_pose.coordinates(), target.coordinates(), executor);
  recompute_normals(target);
  return target;
}

}  // namespace npt::inline NPT_ABI
