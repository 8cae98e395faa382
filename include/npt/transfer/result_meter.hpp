/// Measures results: result_measures.hpp says what.
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/area_sampler.hpp>
#include <npt/mesh/edge_stretch.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/winding_number.hpp>
#include <npt/transfer/result_measures.hpp>

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// Measures results for one identity.
/// Numerics  penetration is that of about 2000 points, drawn by area
/// Requires  a surface of finite points
template <class>
class BasicResultMeter {
 public:
  explicit BasicResultMeter(const MeshView& identity)
      : xyz_(identity.xyz.begin(), identity.xyz.end()),
        triangles_(identity.triangles.begin(), identity.triangles.end()),
        edges_(edges_of_triangles(identity.triangles)),
        tree_(as_span(points_of(identity.xyz)), identity.triangles) {
    const auto point = [&identity](std::size_t v) { return point_at(identity.xyz, v); };
    samples_ = spread_points(weigh_by_area(identity.triangles, point), 2000, 0);
    layers_ = layers(tree_, identity.xyz);
    double volume = 0;
    const Vec3d origin = point(triangles_[0][0]);
    for (const auto& [a, b, c] : triangles_)
      volume += dot(point(a) - origin, cross(point(b) - origin, point(c) - origin));
    facing_ = volume < 0 ? -1 : 1;
  }

  /// All but the coverages. result: [V, 3]
  ResultMeasures measure(std::span<const float> result) const {
    ResultMeasures measures;
    measures.stretch = edge_stretch(as_span(edges_), as_span(xyz_), result);
    measures.penetration = measures.stretch.common;
    if (std::isnan(measures.penetration)) return measures;
    WindingTree moved = tree_;
    moved.move(as_span(points_of(result)), as_span(triangles_));
    const std::vector<double> now = layers(moved, result);
    std::size_t inside = 0;
    for (std::size_t i = 0; i < now.size(); ++i)
      if (facing_ * (now[i] - layers_[i]) > 0.5) ++inside;
    measures.penetration = static_cast<double>(inside) / static_cast<double>(now.size());
    return measures;
  }

 private:
  /// Of each sample, how many times the surface encloses it, less what is its own triangle's.
  std::vector<double> layers(const WindingTree& tree, std::span<const float> xyz) const {
    std::vector<double> result;
    result.reserve(samples_.size());
    for (const auto& [triangle, weights] : samples_) {
      const Triangle& t = triangles_[triangle];
      Vec3d p;
      for (std::size_t k = 0; k < 3; ++k) p += point_at(xyz, t[k]) * weights[k];
      result.push_back(tree.winding(p, triangle));
    }
    return result;
  }

  std::vector<float> xyz_;
  std::vector<Triangle> triangles_;
  std::vector<Edge> edges_;
  WindingTree tree_;
  std::vector<TrianglePoint> samples_;
  std::vector<double> layers_;  ///< of the identity's samples
  double facing_ = 1;           ///< -1: triangles face inwards
};

}  // namespace npt::inline NPT_ABI
