/// The normal equations of deformation transfer, factored once: the points of the target whose deformation gradients
/// are nearest to given ones.
///   minimise over the target's points  sum over pairs (s, t) of ||(S_s - T_t) P_t||_F^2
/// P_t is the projection to the rest plane of triangle t. Each fourth vertex occurs in the terms of one triangle only,
/// and minimising over it leaves this: exact, with a third of the unknowns.
/// A flat triangle has no T. Its sides are to follow its sources instead: v'_b - v'_a = S (v_b - v_a).
/// Links join points of pieces that lie on each other: the way from one to the other follows the gradients around both.
/// Gradients say nothing of places: the first point of each piece is at the origin.
/// Shapes    gradients: [T], for each triangle the sum of the gradients that it follows; points: [P]
/// Numerics  double; the same bits for any executor
/// Source    Sumner and Popovic, "Deformation Transfer for Triangle Meshes", SIGGRAPH 2004, section 4
#pragma once

#include <npt/base/executor.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/baseline/deformation/deformation_gradient.hpp>
#include <npt/baseline/deformation/surface.hpp>
#include <npt/baseline/deformation/triangle_sources.hpp>
#include <npt/config.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/solve/sparse_cholesky.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI::deformation {

class DeformationSystem {
 public:
  /// Every point must be joined to the first one of its piece by triangles or links.
  DeformationSystem(const Surface& target, const TriangleSources& sources, const Pieces& pieces,
                    std::span<const Edge> links) {
    number_unknowns(pieces);
    std::vector<SymmetricEntry> entries;
    entries.reserve(6 * target.triangles.size());
    const double side = target.mean_side();
    add_triangles(target, sources, side, entries);
    add_links(target, sources, side, links, entries);
    cholesky_.emplace(unknown_count_, entries);
    list_corners(target);
    if (links.empty()) return;
    source_count_.resize(target.points.size());
    for (std::size_t t = 0; t < target.triangles.size(); ++t)
      for (const std::uint32_t p : target.triangles[t]) source_count_[p] += static_cast<double>(sources.of(t).size());
  }

  template <Executor Exec>
  std::vector<Vec3d> solve(std::span<const Matrix3> gradients, const Exec& executor) const {
    const std::vector<Vec3d> links = link_loads(gradients);
    std::array<std::vector<double>, 3> sides;
    for (std::vector<double>& side : sides) side.resize(cholesky_->size());
    for_ranges(executor, unknown_.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t p = first; p < last; ++p) {
        if (unknown_[p] == no_index) continue;
        Vec3d sum;
        for (const auto& [triangle, corner] : corners_at(p)) sum += gradients[triangle] * load_[triangle][corner];
        if (!links.empty()) sum += links[p];
        sides[0][unknown_[p]] = sum.x;
        sides[1][unknown_[p]] = sum.y;
        sides[2][unknown_[p]] = sum.z;
      }
    });
    executor.for_each(3, [&](int axis, int) { cholesky_->solve(sides[static_cast<std::size_t>(axis)]); });
    std::vector<Vec3d> points(unknown_.size());
    for (std::size_t p = 0; p < points.size(); ++p)
      if (const std::size_t i = unknown_[p]; i != no_index) points[p] = {sides[0][i], sides[1][i], sides[2][i]};
    return points;
  }

 private:
  struct Corner {
    std::uint32_t triangle = 0, corner = 0;
  };
  struct Link {
    std::uint32_t from = 0, to = 0;
    Vec3d way;  ///< between them at rest, times the weight
  };

  /// What an edge between two equilateral triangles has.
  static constexpr double link_weight = 0.577;

  void number_unknowns(const Pieces& pieces) {
    std::vector<std::uint32_t> first_point(pieces.count, no_index);
    unknown_.assign(pieces.of_point.size(), no_index);
    for (std::uint32_t p = 0; p < unknown_.size(); ++p) {
      if (std::uint32_t& first = first_point[pieces.of_point[p]]; first == no_index)
        first = p;
      else
        unknown_[p] = unknown_count_++;
    }
  }

  void add_entry(std::uint32_t p, std::uint32_t q, double value, std::vector<SymmetricEntry>& entries) const {
    if (unknown_[p] != no_index && unknown_[q] != no_index) entries.push_back({unknown_[p], unknown_[q], value});
  }
  /// weight * |p - q|^2
  void add_difference(std::uint32_t p, std::uint32_t q, double weight, std::vector<SymmetricEntry>& entries) const {
    add_entry(p, p, weight, entries);
    add_entry(q, q, weight, entries);
    add_entry(p, q, -weight, entries);
  }

  void add_triangles(const Surface& target, const TriangleSources& sources, double side,
                     std::vector<SymmetricEntry>& entries) {
    load_.resize(target.triangles.size());
    for (std::size_t t = 0; t < target.triangles.size(); ++t) {
      const Triangle& triangle = target.triangles[t];
      const auto weight = static_cast<double>(sources.of(t).size());
      if (target.flat[t] == 0) {
        const auto [a, b, c] = target.corners(t);
        const RestTriangle rest(a, b, c);
        const double share = target.weight(t, side);
        for (std::size_t i = 0; i < 3; ++i) {
          load_[t][i] = rest.plane_slope(i) * share;
          for (std::size_t k = i; k < 3; ++k)
            add_entry(triangle[i], triangle[k], weight * dot(load_[t][i], rest.plane_slope(k)), entries);
        }
        continue;
      }
      const double w = 1e-6 / (side * side);  // so weak that it decides only where nothing else does
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t k = (i + 1) % 3;
        if (triangle[i] == triangle[k]) continue;
        add_difference(triangle[i], triangle[k], weight * w, entries);
        const Vec3d along = (target.points[triangle[k]] - target.points[triangle[i]]) * w;
        load_[t][k] += along;
        load_[t][i] += -along;
      }
    }
  }

  void add_links(const Surface& target, const TriangleSources& sources, double side, std::span<const Edge> links,
                 std::vector<SymmetricEntry>& entries) {
    const double weight = link_weight * static_cast<double>(sources.size()) /
                          (static_cast<double>(target.triangles.size()) * side * side);
    for (const auto& [p, q] : links) {
      add_difference(p, q, weight, entries);
      links_.push_back({p, q, (target.points[q] - target.points[p]) * weight});
    }
  }

  void list_corners(const Surface& target) {
    corner_start_.assign(target.points.size() + 1, 0);
    for (const Triangle& t : target.triangles)
      for (const std::uint32_t p : t) ++corner_start_[p + 1];
    for (std::size_t p = 0; p < target.points.size(); ++p) corner_start_[p + 1] += corner_start_[p];
    corners_.resize(corner_start_.back());
    std::vector<std::size_t> next(corner_start_.begin(), corner_start_.end() - 1);
    for (std::uint32_t t = 0; t < target.triangles.size(); ++t)
      for (std::uint32_t i = 0; i < 3; ++i) corners_[next[target.triangles[t][i]]++] = {t, i};
  }
  std::span<const Corner> corners_at(std::size_t p) const {
    return {corners_.data() + corner_start_[p], corner_start_[p + 1] - corner_start_[p]};
  }

  /// The links' right-hand sides, [P]; empty where there are no links.
  std::vector<Vec3d> link_loads(std::span<const Matrix3> gradients) const {
    std::vector<Vec3d> loads(links_.empty() ? 0 : unknown_.size());
    for (const Link& link : links_) {
      const Matrix3 around = (gradient_at(link.from, gradients) + gradient_at(link.to, gradients)) * 0.5;
      const Vec3d way = around * link.way;
      loads[link.to] += way;
      loads[link.from] += -way;
    }
    return loads;
  }

  /// The mean of the gradients around a point that has triangles.
  Matrix3 gradient_at(std::size_t p, std::span<const Matrix3> gradients) const {
    Matrix3 sum;
    for (const Corner& corner : corners_at(p)) sum += gradients[corner.triangle];
    return sum * (1 / source_count_[p]);
  }

  std::vector<std::uint32_t> unknown_;  ///< [P] number in the linear system; no_index: the first point of a piece
  std::uint32_t unknown_count_ = 0;
  std::vector<std::array<Vec3d, 3>> load_;  ///< [T] right-hand side of corner i: the sum of S times load i
  std::vector<std::size_t> corner_start_;   ///< [P + 1]
  std::vector<Corner> corners_;             ///< at each point
  std::vector<Link> links_;
  std::vector<double> source_count_;  ///< [P] of the gradients around a point; empty without links
  std::optional<SparseCholesky> cholesky_;
};

}  // namespace npt::inline NPT_ABI::deformation
