/// Remeshes a sheet on an implicit surface: triangles near equilateral, edges near a wanted length that varies in
/// space. The sheet is the half x >= 0 of a mirror-symmetric surface; its border stays in the plane x = 0.
/// Numerics  positions are rounded to multiples of 2^-20 (about 1 micrometre): every decision then compares numbers
///           that compilers agree on, and the same mesh comes out whatever the instruction set
/// Source    Botsch and Kobbelt, "A remeshing approach to multiresolution modeling", SGP 2004
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/loft.hpp>
#include <npt/body/mannequin/surface.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <sculpt/half_edges.hpp>
#include <utility>
#include <vector>

namespace sculpt {

using npt::Vec3d;
using npt::anatomy::rounded;
using npt::anatomy::TriangleSheet;

/// Remeshing of a sheet on `figure`. `edge_length(p)` is the wanted length, `count` the wanted number of vertices of
/// the whole surface: those off the plane x = 0 count twice. The lengths are scaled until the count fits.
template <class Figure, class EdgeLength>
class Remesher {
 public:
  Remesher(const Figure& figure, EdgeLength edge_length, std::size_t count, const TriangleSheet& sheet)
      : figure_(figure), edge_length_(edge_length), count_(count), p_(sheet.positions), topology_(sheet) {
    for (Vec3d& p : p_) p = rounded(p);
  }

  TriangleSheet operator()() {
    for (int pass = 0; pass < passes; ++pass) {
      split_long();
      collapse_short();
      flip_for_valence();
      for (int i = 0; i < 2; ++i) relax();
      // A little above the count: what is too many goes in reach_count(), and merging is gentler than splitting.
      if (pass >= 2) scale_ *= std::sqrt(static_cast<double>(full_count()) / (1.004 * static_cast<double>(count_)));
    }
    reach_count();
    for (int i = 0; i < 6; ++i) {
      flip_for_valence();
      relax();
    }
    return compact();
  }

 private:
  static constexpr int passes = 8;
  static constexpr std::uint32_t none = SheetTopology::none;

  double target(Vec3d p) const { return scale_ * edge_length_(p); }
  /// Length of edge h in units of the wanted length there.
  double relative_length(std::uint32_t h) const {
    const Vec3d a = p_[topology_.from(h)], b = p_[topology_.to(h)];
    return length(b - a) / target((a + b) * 0.5);
  }
  /// Each edge has one or two half-edges: this is the one that stands for it.
  bool represents(std::uint32_t h) const {
    return !topology_.removed(h) && (topology_.opposite(h) == none || h < topology_.opposite(h));
  }

  std::size_t full_count() const {
    std::size_t n = 0;
    for (std::uint32_t v = 0; v < topology_.vertices(); ++v) {
      if (!topology_.vertex_removed(v)) n += p_[v].x == 0.0 ? 1U : 2U;
    }
    return n;
  }

  /// The surface point near p; within x = 0 for points of the border.
  Vec3d project(Vec3d p, bool border) const {
    for (int step = 0; step < 2; ++step) {
      Vec3d g = npt::anatomy::gradient(figure_, p);
      if (border) g.x = 0.0;
      // Where the field is flat or kinked a full Newton step would overshoot.
      Vec3d move = g * (figure_(p) / std::max(dot(g, g), 0.1));
      const double n = length(move), most = 0.5 * target(p);
      if (n > most) move *= most / n;
      p = p - move;
    }
    if (border) p.x = 0.0;
    return rounded(p);
  }

  void split_edge(std::uint32_t h) {
    const bool border = topology_.opposite(h) == none;
    const Vec3d middle = (p_[topology_.from(h)] + p_[topology_.to(h)]) * 0.5;
    topology_.split(h);
    p_.push_back(project(middle, border));
  }

  void split_long() {
    const std::uint32_t n = topology_.half_edges();
    for (std::uint32_t h = 0; h < n; ++h) {
      if (represents(h) && relative_length(h) > 4.0 / 3.0) split_edge(h);
    }
  }

  void collapse_short() {
    for (std::uint32_t h = 0; h < topology_.half_edges(); ++h) {
      if (!topology_.removed(h) && relative_length(h) < 0.8) collapse_edge(h);
    }
  }

  /// Merges the ends of h if that leaves a good mesh.
  bool collapse_edge(std::uint32_t h) {
    if (!topology_.can_collapse(h)) return false;
    const std::uint32_t a = topology_.from(h), b = topology_.to(h);
    const bool border = topology_.opposite(h) == none;
    if (!border && p_[b].x == 0.0 && would_bridge(a, b)) return false;
    const Vec3d merged = !border && p_[b].x == 0.0 ? p_[b] : (p_[a] + p_[b]) * 0.5;
    if (!keeps_shape(a, b, merged) || !keeps_shape(b, a, merged)) return false;
    topology_.collapse(h);
    p_[b] = merged;
    return true;
  }

  /// Whether moving inner vertex a into border vertex b would join b to another part of the border by an inner edge:
  /// the mirror image would have the same edge.
  bool would_bridge(std::uint32_t a, std::uint32_t b) {
    std::vector<std::uint32_t> beside;
    topology_.neighbours(b, beside);
    topology_.neighbours(a, ring_);
    return std::ranges::any_of(
        ring_, [&](std::uint32_t v) { return v != b && p_[v].x == 0.0 && v != beside.front() && v != beside.back(); });
  }

  /// Whether the triangles of v that don't hold `partner` stay alike when v moves to `to`.
  bool keeps_shape(std::uint32_t v, std::uint32_t partner, Vec3d to) const {
    bool good = true;
    topology_.around(v, [&](std::uint32_t h) {
      const std::uint32_t b = topology_.to(h), c = topology_.apex(h);
      if (b == partner || c == partner) return;
      const Vec3d before = cross(p_[b] - p_[v], p_[c] - p_[v]), after = cross(p_[b] - to, p_[c] - to);
      good = good && dot(before, after) > 0.5 * length(before) * length(after);
      good = good && length(p_[b] - to) < 1.4 * target((p_[b] + to) * 0.5);
    });
    return good;
  }

  /// Number of neighbours of each vertex less the ideal one: 6, or 4 on the border.
  std::vector<int> valence_errors() const {
    std::vector<int> error(topology_.vertices(), 0);
    for (std::uint32_t v = 0; v < error.size(); ++v) error[v] = p_[v].x == 0.0 ? -4 : -6;
    for (std::uint32_t h = 0; h < topology_.half_edges(); ++h) {
      if (!represents(h)) continue;
      ++error[topology_.from(h)];
      ++error[topology_.to(h)];
    }
    return error;
  }

  void flip_for_valence() {
    std::vector<int> error = valence_errors();
    const auto square = [](int x) { return x * x; };
    for (std::uint32_t h = 0; h < topology_.half_edges(); ++h) {
      if (!represents(h) || topology_.opposite(h) == none) continue;
      const std::uint32_t a = topology_.from(h), b = topology_.to(h), c = topology_.apex(h),
                          d = topology_.apex(topology_.opposite(h));
      const int before = square(error[a]) + square(error[b]) + square(error[c]) + square(error[d]);
      const int after = square(error[a] - 1) + square(error[b] - 1) + square(error[c] + 1) + square(error[d] + 1);
      // An inner edge between border vertices would coincide with its mirror image.
      if (after >= before || (p_[c].x == 0.0 && p_[d].x == 0.0) || !flip_is_flat(a, b, c, d)) continue;
      topology_.neighbours(c, ring_);
      if (std::ranges::count(ring_, d) != 0) continue;
      topology_.flip(h);
      --error[a], --error[b], ++error[c], ++error[d];
    }
  }

  /// Whether both triangles that a flip makes face the way of those it replaces.
  bool flip_is_flat(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const {
    const Vec3d before = cross(p_[b] - p_[a], p_[c] - p_[a]) + cross(p_[d] - p_[a], p_[b] - p_[a]);
    const auto faces = [&](Vec3d n) { return dot(n, before) > 0.7 * length(n) * length(before); };
    return faces(cross(p_[d] - p_[c], p_[b] - p_[c])) && faces(cross(p_[c] - p_[d], p_[a] - p_[d]));
  }

  /// Each vertex moves along the surface towards the middle of its neighbours.
  void relax() {
    const std::vector<Vec3d> old = p_;
    for (std::uint32_t v = 0; v < topology_.vertices(); ++v) {
      if (topology_.vertex_removed(v)) continue;
      const bool border = old[v].x == 0.0;
      topology_.neighbours(v, ring_);
      // On the border only the neighbours along it count: the first and the last.
      if (border) ring_ = {ring_.front(), ring_.back()};
      Vec3d mean{};
      for (const std::uint32_t n : ring_) mean += old[n];
      Vec3d move = (mean / static_cast<double>(ring_.size()) - old[v]) * 0.6;
      Vec3d g = npt::anatomy::gradient(figure_, old[v]);
      if (border) g.x = 0.0;
      const double steepness = std::max(dot(g, g), 0.1);
      move = move - g * (dot(move, g) / steepness);
      if (!border) move.x = std::max(move.x, -0.8 * old[v].x);
      const Vec3d moved = old[v] + move;
      p_[v] = rounded(moved - g * (figure_(moved) / steepness));
      if (border) p_[v].x = 0.0;
      if (!border && p_[v].x <= 0.0) p_[v] = old[v];
    }
  }

  /// Merges the relatively shortest edges, or cuts the longest, until the count is met.
  void reach_count() {
    while (full_count() != count_) {
      const std::size_t now = full_count();
      if (!change_one(now > count_, now % 2 != count_ % 2)) break;
    }
  }

  /// One collapse or split: of a border edge (which changes the count by one) or of an inner one (by two).
  bool change_one(bool merge, bool border) {
    std::vector<std::pair<double, std::uint32_t>> edges;
    for (std::uint32_t h = 0; h < topology_.half_edges(); ++h) {
      if (!represents(h) || (topology_.opposite(h) == none) != border) continue;
      if (!border && (p_[topology_.from(h)].x == 0.0 || p_[topology_.to(h)].x == 0.0)) continue;
      edges.emplace_back(merge ? relative_length(h) : -relative_length(h), h);
    }
    std::ranges::sort(edges);
    for (const auto& [ignored, h] : edges) {
      if (!merge) {
        split_edge(h);
        return true;
      }
      if (collapse_edge(h)) return true;
    }
    return false;
  }

  TriangleSheet compact() const {
    TriangleSheet sheet;
    std::vector<std::uint32_t> name(topology_.vertices(), none);
    for (std::uint32_t v = 0; v < topology_.vertices(); ++v) {
      if (topology_.vertex_removed(v)) continue;
      name[v] = static_cast<std::uint32_t>(sheet.positions.size());
      sheet.positions.push_back(p_[v]);
    }
    sheet.triangles = topology_.triangles();
    for (auto& t : sheet.triangles) t = {name[t[0]], name[t[1]], name[t[2]]};
    return sheet;
  }

  const Figure& figure_;
  EdgeLength edge_length_;
  std::size_t count_;
  double scale_ = 1.0;
  std::vector<Vec3d> p_;
  SheetTopology topology_;
  std::vector<std::uint32_t> ring_;
};

}  // namespace sculpt
