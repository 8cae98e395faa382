/// A surface as points spread evenly over its area, each with its triangle's normal: all that a fast fit needs to know
/// of a mesh, whatever its size, pieces and triangulation. Drawing them takes one pass over the triangles.
/// Meshes    triangles without area are left out; unused vertices don't count. Normals are those of the triangles as
///           they turn, outwards or not
/// Numerics  the same mesh gives the same points; 5000 points of a person stand 2 cm apart
/// Errors    npt::Error for a mesh without any area, and for coordinates that are not finite
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
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
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

NPT_INLINE_CLASS(class, SampledSurface);
template <class>
class BasicSampledSurface {
 public:
  struct Sample {
    Vec3d point;
    Vec3d normal;  ///< unit, on the side from which the triangle's corners go round counterclockwise
  };

  static constexpr std::size_t default_count = 5000;
  static constexpr std::uint64_t draw = 16;  ///< the first that keeps all bounds of tests/accuracy: docs/results.md

  /// `name` stands in errors.
  BasicSampledSurface(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                      std::size_t count = default_count, const std::string& name = "mesh") {
    const WeightedChoice areas = weigh_by_area(triangles, [points](std::uint32_t v) { return points[v]; });
    area_ = 0.5 * areas.total();
    if (!(area_ > 0) || !std::isfinite(area_))
      throw Error({.file = name,
                   .found = std::to_string(triangles.size()) + " triangles of a total area of " + std::to_string(area_),
                   .expected = "a surface"});
    picks_ = spread_points(areas, std::max<std::size_t>(count, 1), draw);
    pick(points, triangles);
  }

  /// The next frame of a sequence: the same samples on the same triangles, wherever the vertices are now. Takes no pass
  /// over the mesh, and samples that move with the surface keep a fit from trembling.
  /// Requires  as many triangles as there were, of the same vertices
  SampledSurface moved(std::span<const Vec3d> points, std::span<const Triangle> triangles) const {
    SampledSurface next = *this;
    next.pick(points, triangles);
    return next;
  }

  /// In random order: the first n of them are spread over the area as all are.
  std::span<const Sample> samples() const noexcept { return samples_; }
  /// Of the samples' points. Made when it is first asked for: frames of a sequence need none, and take 2.7 instead of
  /// 3.6 ms without.
  const PointTree& tree() const {
    std::call_once(late_->once, [this] {
      std::vector<Vec3d> places;
      for (const Sample& sample : samples_) places.push_back(sample.point);
      late_->tree = PointTree(as_span(places));
    });
    return late_->tree;
  }
  double area() const noexcept { return area_; }
  /// How far a point of the surface is from the nearest sample, about.
  double spacing() const noexcept { return std::sqrt(area_ / static_cast<double>(samples_.size())); }

 private:
  struct LateTree {
    std::once_flag once{};
    PointTree tree{{}};
  };

  void pick(std::span<const Vec3d> points, std::span<const Triangle> triangles) {
    samples_.clear();
    for (const TrianglePoint& pick : picks_) {
      NPT_ASSERT(pick.triangle < triangles.size());
      const Triangle& t = triangles[pick.triangle];
      const Vec3d a = points[t[0]], b = points[t[1]], c = points[t[2]];
      samples_.push_back(
          {a * pick.weights[0] + b * pick.weights[1] + c * pick.weights[2], normalised(cross(b - a, c - a))});
    }
    late_ = std::make_shared<LateTree>();
  }

  double area_ = 0;
  std::vector<TrianglePoint> picks_;
  std::vector<Sample> samples_;
  std::shared_ptr<LateTree> late_;  ///< copies of a surface share it
};

}  // namespace npt::inline NPT_ABI
