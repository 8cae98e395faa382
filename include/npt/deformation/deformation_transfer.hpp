/// Deformation transfer: the target mesh deforms as the source mesh does. Prepared once for a source's and a target's rest
/// mesh and pairs of their triangles, then asked for any number of the source's poses.
///   minimise over the target's vertices  sum over pairs (s, t) of ||S_s - T_t||_F^2
/// with the deformation gradients S of the source and T of the target. Each fourth vertex of the target occurs in the terms of
/// one triangle only, where minimising over it leaves sum ||(S_s - T_t) P_t||_F^2 with P_t the projection to the triangle's
/// rest plane. That is exact, and the normal equations have a third of the unknowns: one for each vertex of the target.
/// What the gradients leave open is the place of each piece of the target:
///   pieces that lie on each other, as clothes on a body, are linked where they do (piece_links.hpp): the way from a point to
///   its link follows the gradients around both, as a term of the energy;
///   the largest piece moves as the centre of its paired source triangles does, scaled by the size of target to source;
///   what is still apart, and each vertex without a face, keeps its place on the nearest triangle (piece_tree.hpp).
/// So the undeformed source gives the target back, and a source that is the target, and is one piece, is followed exactly.
/// Shapes    pose: [Vs, 3] floats, a pose of the source's vertices; result: [Vt, 3]. Target's units; source's directions
/// Numerics  double; the same bits for any executor. A NaN in the pose comes out as NaNs
/// Threads   one object may be used by several threads
/// Errors    npt::Error for meshes without an area, for triangle numbers out of range, no pairs, a pose of another size
/// Source    Sumner and Popovic, "Deformation Transfer for Triangle Meshes", SIGGRAPH 2004, sections 3 and 4
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/matrix3.hpp>
#include <npt/core/vec3.hpp>
#include <npt/deformation/deformation_gradient.hpp>
#include <npt/deformation/piece_tree.hpp>
#include <npt/deformation/surface.hpp>
#include <npt/deformation/triangle_pairs.hpp>
#include <npt/linear/sparse_cholesky.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/union_find.hpp>
#include <npt/parallel/executor.hpp>
#include <npt/surface/closest_point.hpp>
#include <npt/surface/piece_links.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct DeformationTransferOptions {
  /// Vertices of one mesh at the same point in rest move together. False: seams open.
  bool weld = true;
  /// Pieces that lie on each other hold together. False: each keeps to the nearest triangle only.
  bool link_pieces = true;
  /// From the source's directions to the target's, a rotation: for a target that faces another way than the source does.
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
        turn_(options.turn) {
    sort_pairs(pairs);
    for (std::size_t s = 0; s < source_.triangles.size(); ++s) {
      const auto [a, b, c] = source_.corners(s);
      source_rest_.push_back(source_.flat[s] != 0 ? RestTriangle() : RestTriangle(a, b, c));
    }
    join_pieces(options.link_pieces);
    assemble();
    place_largest();
    place_others();
  }

  std::size_t source_vertex_count() const noexcept { return source_vertices_; }
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
    std::vector<Vec3d> points = solve(gradients, executor);
    place(points, posed, gradients);
    for (std::size_t v = 0; v < target_.point_of.size(); ++v) {
      const Vec3f p = points[target_.point_of[v]].as<float>();
      result[3 * v] = p.x, result[3 * v + 1] = p.y, result[3 * v + 2] = p.z;
    }
  }

 private:
  void sort_pairs(std::span<const TrianglePair> pairs) {
    std::vector<std::vector<std::uint32_t>> sources(target_.triangles.size());
    for (const auto& [s, t] : pairs) {
      if (s >= source_.triangles.size()) out_of_range("source", s, source_.triangles.size());
      if (t >= target_.triangles.size()) out_of_range("target", t, target_.triangles.size());
      if (source_.flat[s] == 0) sources[t].push_back(s);
    }
    complete(sources);
    source_start_.push_back(0);
    for (std::vector<std::uint32_t>& list : sources) {
      std::ranges::sort(list);
      list.erase(std::unique(list.begin(), list.end()), list.end());
      sources_.insert(sources_.end(), list.begin(), list.end());
      source_start_.push_back(sources_.size());
    }
  }

  [[noreturn]] static void out_of_range(const char* which, std::uint32_t triangle, std::size_t count) {
    throw Error({.file = "triangle pairs",
                 .found = std::string(which) + " triangle " + std::to_string(triangle),
                 .expected = "a number below " + std::to_string(count)});
  }

  /// Gives each target triangle without a source those of the nearest one that has some.
  void complete(std::vector<std::vector<std::uint32_t>>& sources) const {
    std::vector<Vec3d> centres;
    std::vector<Triangle> points;
    std::vector<std::uint32_t> number;
    for (std::uint32_t t = 0; t < sources.size(); ++t) {
      if (sources[t].empty()) continue;
      const auto i = static_cast<std::uint32_t>(centres.size());
      centres.push_back(target_.centroid(t));
      points.push_back({i, i, i});
      number.push_back(t);
    }
    if (number.empty())
      throw Error({.file = "triangle pairs", .found = "none", .expected = "a pair whose source triangle has an area"});
    if (number.size() == sources.size()) return;
    const TriangleTree tree(centres, points);
    for (std::uint32_t t = 0; t < sources.size(); ++t)
      if (sources[t].empty()) sources[t] = sources[number[tree.closest(target_.centroid(t)).triangle]];
  }

  /// Links, and pieces that hang together by triangles or links: piece 0 has the most triangles that are not flat.
  void join_pieces(bool link) {
    pieces_ = deformation::pieces_of(target_);
    if (!link || pieces_.count < 2) return;
    double area = 0;
    for (std::size_t t = 0; t < target_.triangles.size(); ++t) {
      const auto [a, b, c] = target_.corners(t);
      area += length(cross(b - a, c - a)) / 2;
    }
    links_ = piece_links(target_.points, target_.triangles, link_reach * std::sqrt(area));
    UnionFind linked(pieces_.count);
    for (const auto& [p, q] : links_) linked.unite(pieces_.of_point[p], pieces_.of_point[q]);
    for (std::uint32_t& piece : pieces_.of_point) piece = linked.find(piece);
  }

  std::size_t pair_count(std::size_t t) const { return source_start_[t + 1] - source_start_[t]; }

  /// The quadratic form of every triangle, and its right-hand side as vectors that the triangle's gradient is applied to. A flat
  /// triangle has no T; its sides are to follow its sources instead, (v'_b - v'_a) = S (v_b - v_a).
  void assemble() {
    first_of_piece_.assign(pieces_.count, no_index);
    for (std::uint32_t p = 0; p < target_.points.size(); ++p)
      if (std::uint32_t& first = first_of_piece_[pieces_.of_point[p]]; first == no_index) first = p;
    unknown_.assign(target_.points.size(), no_index);
    std::uint32_t unknowns = 0;
    // The first point of each piece stays at the origin: place() moves pieces to where they belong.
    for (std::uint32_t p = 0; p < target_.points.size(); ++p)
      if (first_of_piece_[pieces_.of_point[p]] != p) unknown_[p] = unknowns++;

    std::vector<SymmetricEntry> entries;
    entries.reserve(6 * target_.triangles.size());
    const auto add = [&](std::uint32_t p, std::uint32_t q, double value) {
      if (unknown_[p] != no_index && unknown_[q] != no_index) entries.push_back({unknown_[p], unknown_[q], value});
    };
    const double side = target_.mean_side();
    load_.resize(target_.triangles.size());
    for (std::size_t t = 0; t < target_.triangles.size(); ++t) {
      const Triangle& triangle = target_.triangles[t];
      const auto [a, b, c] = target_.corners(t);
      const auto weight = static_cast<double>(pair_count(t));
      if (target_.flat[t] == 0) {
        const RestTriangle rest(a, b, c);
        const double share = target_.weight(t, side);
        for (std::size_t i = 0; i < 3; ++i) {
          load_[t][i] = rest.plane_slope(i) * share;
          for (std::size_t k = i; k < 3; ++k)
            add(triangle[i], triangle[k], weight * dot(load_[t][i], rest.plane_slope(k)));
        }
        continue;
      }
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t k = (i + 1) % 3;
        if (triangle[i] == triangle[k]) continue;
        const double w = 1e-6 / (side * side);  // so weak that it decides only where nothing else does
        add(triangle[i], triangle[i], weight * w);
        add(triangle[k], triangle[k], weight * w);
        add(triangle[i], triangle[k], -weight * w);
        const Vec3d along = (target_.points[triangle[k]] - target_.points[triangle[i]]) * w;
        load_[t][k] += along;
        load_[t][i] += -along;
      }
    }
    link_weight_ = link_weight * static_cast<double>(sources_.size()) /
                   (static_cast<double>(target_.triangles.size()) * side * side);
    for (const auto& [p, q] : links_) {
      add(p, p, link_weight_);
      add(q, q, link_weight_);
      add(p, q, -link_weight_);
    }
    cholesky_.emplace(unknowns, entries);

    corner_start_.assign(target_.points.size() + 1, 0);
    for (const Triangle& t : target_.triangles)
      for (const std::uint32_t p : t) ++corner_start_[p + 1];
    for (std::size_t p = 0; p < target_.points.size(); ++p) corner_start_[p + 1] += corner_start_[p];
    corner_.resize(corner_start_.back());
    std::vector<std::size_t> next(corner_start_.begin(), corner_start_.end() - 1);
    for (std::uint32_t t = 0; t < target_.triangles.size(); ++t)
      for (std::uint32_t i = 0; i < 3; ++i) corner_[next[target_.triangles[t][i]]++] = {t, i};
  }

  /// Whether the target's place hangs on this triangle: those of the largest piece with pairs of their own.
  bool guides(std::size_t t) const { return target_.flat[t] == 0 && pieces_.of_point[target_.triangles[t][0]] == 0; }

  /// The centre of the source triangles that are paired with the largest piece.
  Vec3d paired_source_centre(std::span<const Vec3d> positions) const {
    Vec3d sum;
    std::size_t count = 0;
    for (std::size_t t = 0; t < target_.triangles.size(); ++t) {
      if (!guides(t)) continue;
      for (std::size_t i = source_start_[t]; i < source_start_[t + 1]; ++i, ++count)
        sum += source_.centroid(sources_[i], positions);
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
      for (std::size_t i = source_start_[t]; i < source_start_[t + 1]; ++i) {
        const Vec3d d = source_.centroid(sources_[i]) - source_centre_, e = target_.centroid(t) - target_centre_;
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
        for (std::size_t i = source_start_[t]; i < source_start_[t + 1]; ++i) target[t] += source[sources_[i]];
        if (turned) target[t] = turn_ * target[t] * turn_.transposed();
      }
    });
    return target;
  }

  /// Every piece with its first point at the origin.
  template <Executor Exec>
  std::vector<Vec3d> solve(std::span<const Matrix3> gradients, const Exec& executor) const {
    const std::vector<Vec3d> links = link_loads(gradients);
    std::array<std::vector<double>, 3> sides;
    for (std::vector<double>& side : sides) side.resize(cholesky_->size());
    for_ranges(executor, target_.points.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t p = first; p < last; ++p) {
        if (unknown_[p] == no_index) continue;
        Vec3d sum;
        for (std::size_t i = corner_start_[p]; i < corner_start_[p + 1]; ++i)
          sum += gradients[corner_[i].triangle] * load_[corner_[i].triangle][corner_[i].corner];
        if (!links.empty()) sum += links[p];
        sides[0][unknown_[p]] = sum.x;
        sides[1][unknown_[p]] = sum.y;
        sides[2][unknown_[p]] = sum.z;
      }
    });
    executor.for_each(3, [&](int axis, int) { cholesky_->solve(sides[static_cast<std::size_t>(axis)]); });
    std::vector<Vec3d> points(target_.points.size());
    for (std::size_t p = 0; p < points.size(); ++p)
      if (const std::size_t i = unknown_[p]; i != no_index) points[p] = {sides[0][i], sides[1][i], sides[2][i]};
    return points;
  }

  /// The links' right-hand sides, [Pt]; empty where there are no links.
  std::vector<Vec3d> link_loads(std::span<const Matrix3> gradients) const {
    std::vector<Vec3d> loads(links_.empty() ? 0 : target_.points.size());
    for (const auto& [p, q] : links_) {
      const Matrix3 around = (gradient_at(p, gradients) + gradient_at(q, gradients)) * 0.5;
      const Vec3d way = around * (target_.points[q] - target_.points[p]) * link_weight_;
      loads[q] += way;
      loads[p] += -way;
    }
    return loads;
  }

  /// The mean of the gradients around a point that has triangles.
  Matrix3 gradient_at(std::size_t p, std::span<const Matrix3> gradients) const {
    Matrix3 sum;
    std::size_t count = 0;
    for (std::size_t i = corner_start_[p]; i < corner_start_[p + 1]; ++i) {
      sum += gradients[corner_[i].triangle];
      count += pair_count(corner_[i].triangle);
    }
    return sum * (1 / static_cast<double>(count));
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

  struct Corner {
    std::uint32_t triangle = 0, corner = 0;
  };

  /// As detail_refiner.hpp holds pieces together: within a fiftieth of the root of the surface's area, as stiff as an edge of two
  /// equilateral triangles.
  static constexpr double link_reach = 0.02, link_weight = 0.577;

  deformation::Surface source_, target_;
  std::size_t source_vertices_;
  Matrix3 turn_;
  std::vector<std::size_t> source_start_;  ///< [Tt + 1]
  std::vector<std::uint32_t> sources_;     ///< the source triangles of each target triangle, one after another
  std::vector<RestTriangle> source_rest_;  ///< [Ts]
  deformation::Pieces pieces_;             ///< of the target
  std::vector<Edge> links_;                ///< of its points
  double link_weight_ = 0;
  std::vector<std::uint32_t> first_of_piece_;
  std::vector<std::uint32_t> unknown_;      ///< [Pt] number in the linear system; no_index: the first point of a piece
  std::vector<std::array<Vec3d, 3>> load_;  ///< [Tt] right-hand side of corner i: the sum of S times load i
  std::vector<std::size_t> corner_start_;   ///< [Pt + 1]
  std::vector<Corner> corner_;              ///< the corners at each point
  std::optional<SparseCholesky> cholesky_;
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
