/// What is apart in a mesh, hung on what is nearest: a tree of its pieces, by which each keeps its place when triangles
/// move. A piece hangs by one of its points on a triangle of its parent. The tree is the shortest that joins all pieces
/// by their nearest points; roots are given, and are attached to nothing. Pieces without a triangle that has an area, and
/// points without any triangle, are leaves: nothing is attached to them.
/// Complexity  a query of the triangles for each point, as many times as the logarithm of the number of pieces
#pragma once

#include <npt/baseline/deformation/surface.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/union_find.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI::deformation {

/// Where a piece hangs.
struct Hook {
  std::uint32_t piece = 0;
  std::uint32_t point = 0;  ///< of the piece
  ClosestPoint at;          ///< on a triangle of its parent that has an area; the nearest to the point, or nearly so
};

/// Makes the tree of one surface.
class PieceTree {
 public:
  /// piece[p] < count for every point. `roots`: [count], whether a piece holds itself.
  PieceTree(const Surface& surface, std::span<const std::uint32_t> piece, std::span<const char> roots)
      : surface_(surface),
        piece_(piece),
        roots_(roots),
        some_triangle_(surface.points.size(), no_index),
        clusters_(roots.size()),
        tree_(surface.points, surface.triangles) {
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t)
      if (surface.flat[t] == 0)
        for (const std::uint32_t p : surface.triangles[t]) some_triangle_[p] = t;
    inner_.assign(roots.size(), 0);
    for (std::size_t p = 0; p < piece.size(); ++p)
      if (some_triangle_[p] != no_index) inner_[piece[p]] = 1;
  }

  /// The hook of every piece that isn't a root, parents before children. Pieces that no root holds are left out, which
  /// happens only where all roots are leaves.
  std::vector<Hook> hooks() {
    for (std::uint32_t i = 0, first = no_index; i < roots_.size(); ++i) {
      if (roots_[i] == 0 || inner_[i] == 0) continue;
      if (first == no_index) first = i;
      clusters_.unite(first, i);
    }
    while (join_nearest()) {
    }
    std::vector<Hook> result = orient();
    hang_leaves(result);
    return result;
  }

 private:
  /// A point of one piece, and the nearest point of another.
  struct Joint {
    std::uint32_t point = no_index;
    ClosestPoint at;
  };

  std::uint32_t piece_of_triangle(std::uint32_t t) const { return piece_[surface_.triangles[t][0]]; }

  /// Boruvka's step: each cluster but the one with the most points joins what is nearest to it. False when there is one
  /// cluster.
  bool join_nearest() {
    std::vector<std::uint32_t> of(roots_.size()), size(roots_.size());
    for (std::uint32_t i = 0; i < of.size(); ++i) of[i] = clusters_.find(i);
    for (std::size_t p = 0; p < piece_.size(); ++p)
      if (inner_[piece_[p]] != 0) ++size[of[piece_[p]]];
    const auto largest = static_cast<std::uint32_t>(std::ranges::max_element(size) - size.begin());
    std::vector<Joint> joints(roots_.size());
    for (std::uint32_t p = 0; p < piece_.size(); ++p) {
      const std::uint32_t own = of[piece_[p]];
      if (some_triangle_[p] == no_index || own == largest) continue;
      Joint& best = joints[own];
      const ClosestPoint at = tree_.closest(
          surface_.points[p], [&](std::uint32_t t) { return surface_.flat[t] == 0 && of[piece_of_triangle(t)] != own; },
          no_index, best.at.squared_distance);
      if (at.squared_distance < best.at.squared_distance) best = {p, at};
    }
    bool joined = false;
    for (const Joint& joint : joints) {
      if (joint.point == no_index) continue;
      const std::uint32_t a = piece_[joint.point], b = piece_of_triangle(joint.at.triangle);
      if (!clusters_.unite(a, b)) continue;  // both chose each other
      joints_.push_back(joint);
      joined = true;
    }
    return joined;
  }

  /// Walks from the roots.
  std::vector<Hook> orient() const {
    std::vector<std::vector<std::size_t>> at(roots_.size());
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      at[piece_[joints_[j].point]].push_back(j);
      at[piece_of_triangle(joints_[j].at.triangle)].push_back(j);
    }
    std::vector<char> held(roots_.begin(), roots_.end());
    std::vector<std::uint32_t> open;
    for (std::uint32_t i = 0; i < held.size(); ++i)
      if (held[i] != 0 && inner_[i] != 0) open.push_back(i);
    std::vector<Hook> result;
    for (std::size_t next = 0; next < open.size(); ++next)
      for (const std::size_t j : at[open[next]]) {
        const Hook hook = hook_on(open[next], joints_[j]);
        if (held[hook.piece] != 0) continue;
        held[hook.piece] = 1;
        result.push_back(hook);
        open.push_back(hook.piece);
      }
    return result;
  }

  /// The other piece of a joint, as a child of `parent`.
  Hook hook_on(std::uint32_t parent, const Joint& joint) const {
    if (piece_[joint.point] != parent) return {piece_[joint.point], joint.point, joint.at};
    // The joint was found from the parent's side: the other's corner that is next to it, at the parent's point.
    const auto heaviest = std::ranges::max_element(joint.at.weights) - joint.at.weights.begin();
    const std::uint32_t point = surface_.triangles[joint.at.triangle][static_cast<std::size_t>(heaviest)];
    ClosestPoint at{.triangle = some_triangle_[joint.point], .weights = {}, .point = surface_.points[joint.point]};
    for (std::size_t k = 0; k < 3; ++k) at.weights[k] = surface_.triangles[at.triangle][k] == joint.point ? 1 : 0;
    return {piece_[point], point, at};
  }

  void hang_leaves(std::vector<Hook>& result) const {
    std::vector<Joint> joints(roots_.size());
    for (std::uint32_t p = 0; p < piece_.size(); ++p) {
      const std::uint32_t own = piece_[p];
      if (inner_[own] != 0 || roots_[own] != 0) continue;
      Joint& best = joints[own];
      const ClosestPoint at = tree_.closest(
          surface_.points[p], [&](std::uint32_t t) { return surface_.flat[t] == 0; }, no_index,
          best.at.squared_distance);
      if (at.squared_distance < best.at.squared_distance) best = {p, at};
    }
    for (std::uint32_t i = 0; i < joints.size(); ++i)
      if (joints[i].point != no_index) result.push_back({i, joints[i].point, joints[i].at});
  }

  const Surface& surface_;
  std::span<const std::uint32_t> piece_;
  std::span<const char> roots_;
  std::vector<char> inner_;                   ///< [count] whether a piece has a triangle with an area
  std::vector<std::uint32_t> some_triangle_;  ///< [P] with an area, at the point; no_index: none
  UnionFind clusters_;                        ///< of pieces
  std::vector<Joint> joints_;
  TriangleTree tree_;
};

}  // namespace npt::inline NPT_ABI::deformation
