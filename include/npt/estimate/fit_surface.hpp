/// A surface as points spread evenly over its area, each with its triangle's normal: all that a fast fit needs to know
/// of a mesh, whatever its size, pieces and triangulation. Drawing them takes one pass over the triangles.
/// Meshes    triangles without area are left out; unused vertices don't count. Normals are those of the triangles as
///           they turn: which way that is, a reading tells (reading_fit.hpp)
/// Numerics  the same mesh gives the same points; 5000 points of a person stand 2 cm apart
/// Errors    npt::Error for a mesh without any area, and for coordinates that are not finite
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

class FitSurface {
 public:
  struct Sample {
    Vec3d point;
    Vec3d normal;  ///< unit, on the side from which the triangle's corners go round counterclockwise
  };

  static constexpr std::size_t default_count = 5000;

  /// `name` stands in errors.
  FitSurface(std::span<const Vec3d> points, std::span<const Triangle> triangles, std::size_t count = default_count,
             const std::string& name = "mesh")
      : FitSurface(
            AnyPoints{}, [points](std::uint32_t v) { return points[v]; }, triangles, count, name) {}

  /// xyz: [V, 3]
  FitSurface(std::span<const float> xyz, std::span<const Triangle> triangles, std::size_t count = default_count,
             const std::string& name = "mesh")
      : FitSurface(
            AnyPoints{}, [xyz](std::uint32_t v) { return point_of(xyz, v); }, triangles, count, name) {}

  /// The next frame of a sequence: the same samples on the same triangles, wherever the vertices are now. Takes no pass
  /// over the mesh, and samples that move with the surface keep a fit from trembling.
  /// Requires  as many triangles as there were, of the same vertices
  FitSurface moved(std::span<const Vec3d> points, std::span<const Triangle> triangles) const {
    return FitSurface(
        *this, [points](std::uint32_t v) { return points[v]; }, triangles);
  }
  FitSurface moved(std::span<const float> xyz, std::span<const Triangle> triangles) const {
    return FitSurface(
        *this, [xyz](std::uint32_t v) { return point_of(xyz, v); }, triangles);
  }

  /// In random order: the first n of them are spread over the area as all are.
  std::span<const Sample> samples() const noexcept { return samples_; }
  /// Of the samples' points.
  const PointTree& tree() const noexcept { return tree_; }
  /// The surface's centre of mass, and its area.
  Vec3d centroid() const noexcept { return centroid_; }
  double area() const noexcept { return area_; }
  /// How far a point of the surface is from the nearest sample, about.
  double spacing() const noexcept { return std::sqrt(area_ / static_cast<double>(samples_.size())); }

 private:
  struct AnyPoints {};

  /// Where a sample lies: the weights of the triangle's first two corners.
  struct Pick {
    std::uint32_t triangle = 0;
    double first = 0, second = 0;
  };

  static Vec3d point_of(std::span<const float> xyz, std::uint32_t v) {
    return Vec3f{xyz[3 * std::size_t{v}], xyz[3 * std::size_t{v} + 1], xyz[3 * std::size_t{v} + 2]}.as<double>();
  }

  /// point(v): vertex v.
  template <class PointOf>
  FitSurface(AnyPoints, const PointOf& point, std::span<const Triangle> triangles, std::size_t count,
             const std::string& name)
      : samples_(spread(point, triangles, std::max<std::size_t>(count, 1), name)), tree_(tree_of(samples_)) {}

  template <class PointOf>
  FitSurface(const FitSurface& before, const PointOf& point, std::span<const Triangle> triangles)
      : centroid_(before.centroid_),
        area_(before.area_),
        picks_(before.picks_),
        samples_(picked(point, triangles)),
        tree_(tree_of(samples_)) {}

  template <class PointOf>
  std::vector<Sample> picked(const PointOf& point, std::span<const Triangle> triangles) const {
    std::vector<Sample> samples;
    samples.reserve(picks_.size());
    for (const Pick& pick : picks_) {
      NPT_ASSERT(pick.triangle < triangles.size());
      const Triangle& t = triangles[pick.triangle];
      const Vec3d a = point(t[0]), b = point(t[1]), c = point(t[2]);
      samples.push_back(
          {a * pick.first + b * pick.second + c * (1 - pick.first - pick.second), normalised(cross(b - a, c - a))});
    }
    return samples;
  }

  /// Stratified: point k lies in the k-th of `count` equal shares of the area.
  template <class PointOf>
  std::vector<Sample> spread(const PointOf& point, std::span<const Triangle> triangles, std::size_t count,
                             const std::string& name) {
    std::vector<double> until(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const Vec3d a = point(triangles[t][0]), b = point(triangles[t][1]), c = point(triangles[t][2]);
      const double area = 0.5 * length(cross(b - a, c - a));
      area_ += area;
      until[t] = area_;
      centroid_ += (a + b + c) * (area / 3);
    }
    if (!(area_ > 0) || !std::isfinite(area_))
      throw Error({.file = name,
                   .found = std::to_string(triangles.size()) + " triangles of a total area of " + std::to_string(area_),
                   .expected = "a surface"});
    centroid_ = centroid_ / area_;
    Random random(20200316);
    std::vector<Pick> ordered;
    ordered.reserve(count);
    std::uint32_t i = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const double wanted = (static_cast<double>(k) + random.uniform()) / static_cast<double>(count) * area_;
      while (until[i] < wanted && i + 1 < triangles.size()) ++i;
      const double root = std::sqrt(random.uniform()), v = random.uniform() * root;
      ordered.push_back({i, 1 - root, v});
    }
    picks_.reserve(count);
    for (const std::uint32_t k : random_permutation(static_cast<std::uint32_t>(count), random))
      picks_.push_back(ordered[k]);
    return picked(point, triangles);
  }

  static PointTree tree_of(std::span<const Sample> samples) {
    std::vector<Vec3d> points;
    points.reserve(samples.size());
    for (const Sample& s : samples) points.push_back(s.point);
    return PointTree(points);
  }

  Vec3d centroid_;
  double area_ = 0;
  std::vector<Pick> picks_;
  std::vector<Sample> samples_;
  PointTree tree_;
};

}  // namespace npt::inline NPT_ABI
