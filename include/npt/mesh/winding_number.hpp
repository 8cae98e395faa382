/// How often a surface encloses a point: the generalised winding number. Outside of a closed surface whose triangles
/// face outwards it is 0, inside 1, where two parts of it overlap 2; at a hole it changes gradually.
///   WindingTree tree(points, triangles);   a tree of triangles (closest_point.hpp)
///   tree.winding(p)
/// Numerics  double; nodes far away count as one vector of area in their centre: within 0.11 of the sum over all
///           triangles on the surfaces of three people in six poses; 3 us of 13776 triangles
/// Threads   queries may run side by side
/// Source    Jacobson et al., "Robust Inside-Outside Segmentation using Generalized Winding Numbers", 2013; Barill et
///           al., "Fast Winding Numbers for Soups and Clouds", 2018, eq. 10 (the first term)
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

class WindingTree : public TriangleTree {
 public:
  /// Requires  as TriangleTree
  WindingTree(std::span<const Vec3d> points, std::span<const Triangle> triangles) : TriangleTree(points, triangles) {
    sum_up();
  }
  void move(std::span<const Vec3d> points, std::span<const Triangle> triangles) {
    TriangleTree::move(points, triangles);
    sum_up();
  }

  /// on: the triangle that p lies on, which doesn't count: a closed surface then encloses its own points by half.
  double winding(Vec3d p, std::uint32_t on = no_index) const {
    if (nodes_.empty()) return 0;
    double sum = 0;
    std::array<std::uint32_t, most_open> open{};
    std::size_t count = 1;
    while (count > 0) {
      const std::uint32_t n = open[--count];
      const auto& node = nodes_[n];
      const Sum& all = sums_[n];
      const Vec3d d = all.centre - p;
      const double squared = dot(d, d);
      if (squared > far * far * all.squared_radius) {
        sum += dot(all.area, d) / (squared * std::sqrt(squared));
        continue;
      }
      for (const std::uint32_t child : node.child) {
        if (child == no_index) continue;
        if (!is_triangle(child))
          open[count++] = child;
        else if (triangle_of(child) != on)
          sum += solid_angle(corners_[triangle_of(child)], p);
      }
    }
    return sum / (4 * std::numbers::pi);
  }

 private:
  static constexpr double far = 2;  ///< radii: Barill et al.'s choice

  /// The triangles of a node.
  struct Sum {
    Vec3d area;    ///< of all, along their normals
    Vec3d centre;  ///< weighted by area
    double size = 0, squared_radius = 0;
  };

  /// Source    van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983
  static double solid_angle(const std::array<Vec3d, 3>& t, Vec3d p) {
    const Vec3d a = t[0] - p, b = t[1] - p, c = t[2] - p;
    const double la = length(a), lb = length(b), lc = length(c);
    return 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }

  void sum_up() {
    constexpr double inf = std::numeric_limits<double>::infinity();
    sums_.assign(nodes_.size(), {});
    for (std::size_t n = nodes_.size(); n-- > 0;) {  // children stand behind their parents
      const auto& node = nodes_[n];
      Sum& all = sums_[n];
      const auto add = [&all](Vec3d area, Vec3d centre, double size) {
        all.area += area;
        all.centre += centre * size;
        all.size += size;
      };
      Vec3d low{inf, inf, inf}, high{-inf, -inf, -inf};
      for (std::size_t k = 0; k < width; ++k) {
        low = {std::min(low.x, node.low[0][k]), std::min(low.y, node.low[1][k]), std::min(low.z, node.low[2][k])};
        high = {std::max(high.x, node.high[0][k]), std::max(high.y, node.high[1][k]),
                std::max(high.z, node.high[2][k])};
        const std::uint32_t child = node.child[k];
        if (child == no_index) continue;
        if (!is_triangle(child)) {
          const Sum& below = sums_[child];
          add(below.area, below.centre, below.size);
          continue;
        }
        const auto& [a, b, c] = corners_[triangle_of(child)];
        const Vec3d area = cross(b - a, c - a) * 0.5;
        add(area, (a + b + c) / 3.0, length(area));
      }
      all.centre = all.size > 0 ? all.centre / all.size : (low + high) / 2.0;
      const Vec3d above = high - all.centre, below = all.centre - low;
      const Vec3d most{std::max(above.x, below.x), std::max(above.y, below.y), std::max(above.z, below.z)};
      all.squared_radius = dot(most, most);
    }
  }

  std::vector<Sum> sums_;  ///< of the nodes
};

}  // namespace npt::inline NPT_ABI
