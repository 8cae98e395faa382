/// A mesh as a body is fitted to it: its triangles in a tree, which way they face, and points spread over them.
/// Meshes    triangles without area are left out; a component whose triangles don't face consistently, or that is too
///           open for an inside, is used without normals; one that faces inwards is turned. Unused vertices don't count
/// Errors    npt::Error for a mesh without any area
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
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

  /// Stratified: point k lies in the k-th of `count` equal shares of the area.
  void spread(std::span<const Vec3d> points, std::size_t count) {
    Random random(20200316);
    double passed = 0;
    std::size_t i = 0;
    const auto area_of = [&](std::size_t n) {
      const Triangle& t = triangles_[n];
      return 0.5 * length(cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]]));
    };
    double here = area_of(0);
    for (std::size_t k = 0; k < count; ++k) {
      const double wanted = (static_cast<double>(k) + random.uniform()) / static_cast<double>(count) * area_;
      while (passed + here < wanted && i + 1 < triangles_.size()) {
        passed += here;
        here = area_of(++i);
      }
      const double root = std::sqrt(random.uniform()), b = random.uniform() * root, a = 1 - root;
      const Triangle& t = triangles_[i];
      samples_.push_back({points[t[0]] * a + points[t[1]] * b + points[t[2]] * (1 - a - b), normals_[i]});
    }
    const std::vector<std::uint32_t> order = random_permutation(static_cast<std::uint32_t>(count), random);
    std::vector<Sample> shuffled;
    shuffled.reserve(count);
    for (const std::uint32_t k : order) shuffled.push_back(samples_[k]);
    samples_ = std::move(shuffled);
    spread_first(256);
  }

  /// Brings `count` samples that are far from each other to the front (farthest point sampling).
  void spread_first(std::size_t count) {
    std::vector<double> distance(samples_.size(), std::numeric_limits<double>::infinity());
    for (std::size_t k = 0; k + 1 < std::min(count, samples_.size()); ++k) {
      std::size_t next = k + 1;
      for (std::size_t i = k + 1; i < samples_.size(); ++i) {
        const Vec3d d = samples_[i].point - samples_[k].point;
        distance[i] = std::min(distance[i], dot(d, d));
        if (distance[i] > distance[next]) next = i;
      }
      std::swap(samples_[k + 1], samples_[next]);
      std::swap(distance[k + 1], distance[next]);
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
