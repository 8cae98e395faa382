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
#include <npt/base/weighted_choice.hpp>
#include <npt/config.hpp>
#include <npt/mesh/area_sampler.hpp>
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

NPT_INLINE_CLASS(class, FitSurface);
template <class>
class BasicFitSurface {
 public:
  struct Sample {
    Vec3d point;
    Vec3d normal;  ///< unit, on the side from which the triangle's corners go round counterclockwise
  };

  static constexpr std::size_t default_count = 5000;

  /// `name` stands in errors.
  BasicFitSurface(std::span<const Vec3d> points, std::span<const Triangle> triangles, std::size_t count = default_count,
                  const std::string& name = "mesh")
      : FitSurface(
            AnyPoints{}, [points](std::uint32_t v) { return points[v]; }, triangles, count, name) {}

  /// xyz: [V, 3]
  BasicFitSurface(std::span<const float> xyz, std::span<const Triangle> triangles, std::size_t count = default_count,
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

  static Vec3d point_of(std::span<const float> xyz, std::uint32_t v) {
    return Vec3f{xyz[3 * std::size_t{v}], xyz[3 * std::size_t{v} + 1], xyz[3 * std::size_t{v} + 2]}.as<double>();
  }

  /// point(v): vertex v.
  template <class PointOf>
  BasicFitSurface(AnyPoints, const PointOf& point, std::span<const Triangle> triangles, std::size_t count,
                  const std::string& name)
      : samples_(spread(point, triangles, std::max<std::size_t>(count, 1), name)), tree_(tree_of(samples_)) {}

  template <class PointOf>
  BasicFitSurface(const FitSurface& before, const PointOf& point, std::span<const Triangle> triangles)
      : centroid_(before.centroid_),
        area_(before.area_),
        picks_(before.picks_),
        samples_(picked(point, triangles)),
        tree_(tree_of(samples_)) {}

  template <class PointOf>
  std::vector<Sample> picked(const PointOf& point, std::span<const Triangle> triangles) const {
    std::vector<Sample> samples;
    samples.reserve(picks_.size());
    for (const TrianglePoint& pick : picks_) {
      NPT_ASSERT(pick.triangle < triangles.size());
      const Triangle& t = triangles[pick.triangle];
      const Vec3d a = point(t[0]), b = point(t[1]), c = point(t[2]);
      samples.push_back(
          {a * pick.weights[0] + b * pick.weights[1] + c * pick.weights[2], normalised(cross(b - a, c - a))});
    }
    return samples;
  }

  template <class PointOf>
  std::vector<Sample> spread(const PointOf& point, std::span<const Triangle> triangles, std::size_t count,
                             const std::string& name) {
    WeightedChoice areas;
    areas.reserve(triangles.size());
    for (const Triangle& t : triangles) {
      const Vec3d a = point(t[0]), b = point(t[1]), c = point(t[2]);
      const double area = 0.5 * length(cross(b - a, c - a));
      areas.add(area);
      centroid_ += (a + b + c) * (area / 3);
    }
    area_ = areas.total();
    if (!(area_ > 0) || !std::isfinite(area_))
      throw Error({.file = name,
                   .found = std::to_string(triangles.size()) + " triangles of a total area of " + std::to_string(area_),
                   .expected = "a surface"});
    centroid_ = centroid_ / area_;
    picks_ = stratified_points(areas, count, Random(20200316));
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
  std::vector<TrianglePoint> picks_;
  std::vector<Sample> samples_;
  PointTree tree_;
};

}  // namespace npt::inline NPT_ABI
