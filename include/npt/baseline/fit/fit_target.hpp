/// A mesh as a body is fitted to it: its triangles in a tree, which way they face, and points spread over them.
/// Meshes    triangles without area are left out; a component whose triangles don't face consistently, or that is too
///           open for an inside, is used without normals; one that faces inwards is turned. Unused vertices don't count
/// Errors    npt::Error for a mesh without any area
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/area_sampler.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/farthest_points.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

class FitTarget {
 public:
  struct Sample {
    Vec3d point;
    Vec3d normal;  ///< unit, outward; (0, 0, 0) where that is unknown
  };

  /// `name` stands in errors. `sample_count` points are spread over the area; the same mesh gives the same points.
  FitTarget(std::span<const Vec3d> points, std::span<const Triangle> triangles, std::size_t sample_count,
            const std::string& name = "mesh")
      : triangles_(with_area(points, triangles, name)), tree_(points, triangles_) {
    orient(points);
    spread(points, sample_count);
  }

  const TriangleTree& tree() const noexcept { return tree_; }
  std::span<const Triangle> triangles() const noexcept { return triangles_; }
  /// Whether it is known which side of a triangle is outside.
  bool oriented(std::uint32_t triangle) const { return !(normals_[triangle] == Vec3d{}); }
  Vec3d normal(std::uint32_t triangle) const { return normals_[triangle]; }
  /// In random order: the first n of them are spread as evenly as all.
  std::span<const Sample> samples() const noexcept { return samples_; }
  /// The surface's centre of mass, and its total area.
  Vec3d centroid() const noexcept { return centroid_; }
  double area() const noexcept { return area_; }

 private:
  static std::vector<Triangle> with_area(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                                         const std::string& name) {
    std::vector<Triangle> kept;
    for (const Triangle& t : triangles)
      if (length(cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]])) > 0) kept.push_back(t);
    if (kept.empty())
      throw Error({.file = name,
                   .found = std::to_string(triangles.size()) + " triangles, none of which has an area",
                   .expected = "a surface"});
    return kept;
  }

  struct Component {
    Vec3d centre;
    double area = 0, volume = 0;
    std::size_t edges = 0,
                clashes = 0;  ///< directed edges, and those that some other triangle has in the same direction
  };

  void orient(std::span<const Vec3d> points) {
    const std::vector<std::uint32_t> components = connected_components(triangles_, points.size());
    std::map<std::uint32_t, Component> all;
    std::vector<std::pair<Edge, std::uint32_t>> directed;
    normals_.resize(triangles_.size());
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      const Triangle& t = triangles_[i];
      const Vec3d twice = cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]);
      const Vec3d centre = (points[t[0]] + points[t[1]] + points[t[2]]) / 3.0;
      const double area = 0.5 * length(twice);
      normals_[i] = normalised(twice);
      Component& c = all[components[triangles_[i][0]]];
      c.area += area;
      c.centre += centre * area;
      centroid_ += centre * area;
      area_ += area;
      for (std::size_t k = 0; k < 3; ++k) directed.push_back({{t[k], t[(k + 1) % 3]}, components[t[0]]});
    }
    centroid_ = centroid_ / area_;
    std::sort(directed.begin(), directed.end());
    for (std::size_t i = 0; i < directed.size(); ++i) {
      Component& c = all[directed[i].second];
      ++c.edges;
      if (i > 0 && directed[i].first == directed[i - 1].first) ++c.clashes;
    }
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      Component& c = all[components[triangles_[i][0]]];
      const Triangle& t = triangles_[i];
      const Vec3d o = c.centre / c.area;
      c.volume += dot(points[t[0]] - o, cross(points[t[1]] - o, points[t[2]] - o)) / 6.0;
    }
    for (std::size_t i = 0; i < triangles_.size(); ++i)
      normals_[i] = normals_[i] * facing(all[components[triangles_[i][0]]]);
  }

  /// 1: faces outwards, -1: inwards, 0: can't be said. A flat patch has no volume: 1e-3 of a ball's of the same area is
  /// less than any limb has, and more than a patch of cloth.
  static double facing(const Component& c) {
    if (c.clashes * 50 > c.edges) return 0;
    const double ball = std::pow(c.area, 1.5) / (6 * std::sqrt(std::numbers::pi));
    if (std::abs(c.volume) < 1e-3 * ball) return 0;
    return c.volume > 0 ? 1 : -1;
  }

  void spread(std::span<const Vec3d> points, std::size_t count) {
    const auto point = [points](std::uint32_t v) { return points[v]; };
    for (const TrianglePoint& p : spread_points(weigh_by_area(as_span(triangles_), point), count, 20200316)) {
      const auto& [a, b, c] = triangles_[p.triangle];
      samples_.push_back(
          {points[a] * p.weights[0] + points[b] * p.weights[1] + points[c] * p.weights[2], normals_[p.triangle]});
    }
    spread_first(256);
  }

  /// Brings `count` samples that are far from each other to the front.
  void spread_first(std::size_t count) {
    if (samples_.empty()) return;
    std::vector<Vec3d> points;
    for (const Sample& s : samples_) points.push_back(s.point);
    std::vector<std::uint32_t> place(samples_.size()), at(samples_.size());  // of samples; which sample is at a place
    std::iota(place.begin(), place.end(), 0U), std::iota(at.begin(), at.end(), 0U);
    const std::vector<std::uint32_t> first = farthest_points(points, std::min(count, points.size()));
    for (std::uint32_t k = 0; k < first.size(); ++k) {
      const std::uint32_t other = place[first[k]];
      std::swap(samples_[k], samples_[other]);
      std::swap(at[k], at[other]);
      place[at[k]] = k, place[at[other]] = other;
    }
  }

  std::vector<Triangle> triangles_;
  TriangleTree tree_;
  std::vector<Vec3d> normals_;
  std::vector<Sample> samples_;
  Vec3d centroid_;
  double area_ = 0;
};

}  // namespace npt::inline NPT_ABI
