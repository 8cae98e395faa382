/// The point of a surface, or of many points, that is closest to a given one: a tree of boxes over triangles or points,
/// built once, asked often.
///   closest(p)          over all triangles
///   closest(p, accept)  over triangles t with accept(t): normals that face the right way, one component, ...
/// Triangles without area count as the segment or point they are. Of a tree of points, a point is a triangle of weights
/// {1, 0, 0}.
/// Numerics  double; of triangles at the same distance the one with the least number, so that the answer depends on the
///           triangles only. Some 20 box and triangle tests for a query close to the surface
/// Threads   queries may run side by side
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// Where on a surface: `point` = the triangle's corners weighted by `weights`, which are not negative and sum to 1.
struct ClosestPoint {
  std::uint32_t triangle = no_index;  ///< no_index: no triangle was accepted
  std::array<double, 3> weights{};
  Vec3d point;
  double squared_distance = std::numeric_limits<double>::infinity();
};

/// The point of segment ab closest to p, as the weight of b.
NPT_INLINE double closest_on_segment(Vec3d p, Vec3d a, Vec3d b) {
  const double squared = dot(b - a, b - a);
  return squared > 0 ? std::clamp(dot(p - a, b - a) / squared, 0.0, 1.0) : 0.0;
}

/// The point of triangle abc closest to p, as weights of a, b and c.
/// Source: Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
NPT_INLINE std::array<double, 3> closest_on_triangle(Vec3d p, Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d ab = b - a, ac = c - a;
  const double d1 = dot(ab, p - a), d2 = dot(ac, p - a);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = dot(ab, p - b), d4 = dot(ac, p - b);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double d5 = dot(ab, p - c), d6 = dot(ac, p - c);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double wa = d3 * d6 - d5 * d4, wb = d5 * d2 - d1 * d6, wc = d1 * d4 - d3 * d2;
  if (wa > 0 && wb > 0 && wc > 0) {
    const double sum = wa + wb + wc;
    return {wa / sum, wb / sum, wc / sum};
  }
  // On a side, or in a triangle without area, where the signs above are noise: the best of all sides.
  const std::array<Vec3d, 3> corners{a, b, c};
  std::array<double, 3> best{};
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t k = (i + 1) % 3;
    const double t = closest_on_segment(p, corners[i], corners[k]);
    const Vec3d d = corners[i] * (1 - t) + corners[k] * t - p;
    if (const double squared = dot(d, d); squared < least) {
      least = squared;
      best = {};
      best[i] = 1 - t;
      best[k] = t;
    }
  }
  return best;
}

/// Corners: 3, of triangles; 1, of points, which take a fifth of a triangle's work.
template <std::size_t Corners>
class BoxTree {
 public:
  /// Requires  finite points and triangles of indices below their number. Both are copied.
  BoxTree(std::span<const Vec3d> points, std::span<const Triangle> triangles) requires(Corners == 3) {
    corners_.reserve(triangles.size());
    for (const Triangle& t : triangles) corners_.push_back({points[t[0]], points[t[1]], points[t[2]]});
    build();
  }
  /// Requires  finite points. They are copied.
  explicit BoxTree(std::span<const Vec3d> points) requires(Corners == 1) {
    corners_.reserve(points.size());
    for (const Vec3d p : points) corners_.push_back({p});
    build();
  }

  std::size_t triangle_count() const noexcept { return corners_.size(); }

  /// The closest point of all triangles.
  ClosestPoint closest(Vec3d p) const {
    return closest(p, [](std::uint32_t) { return true; });
  }

  /// The closest point on a triangle that `accept(triangle)` takes; triangle is no_index where there is none.
  template <class Accept>
  ClosestPoint closest(Vec3d p, const Accept& accept) const {
    return closest(p, accept, no_index);
  }

  /// The closest point on a triangle that `accept(triangle)` takes. `hint`, a triangle that is probably close, such as
  /// that of a query nearby, makes it faster, and so does the limit: nothing farther away is wanted.
  template <class Accept>
  ClosestPoint closest(Vec3d p, const Accept& accept, std::uint32_t hint,
                       double squared_limit = std::numeric_limits<double>::infinity()) const {
    ClosestPoint best;
    best.squared_distance = squared_limit;
    if (nodes_.empty()) return best;
    if (hint < corners_.size()) visit(hint, p, accept, best);
    // A tree that halves its triangles is at most 32 deep, and each level leaves one node behind.
    std::array<std::uint32_t, 64> open{};
    std::size_t count = 0;
    open[count++] = 0;
    while (count > 0) {
      const std::uint32_t n = open[--count];
      const Node& node = nodes_[n];
      if (squared_distance(node, p) > best.squared_distance) continue;
      if (node.count > 0) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) visit(order_[i], p, accept, best);
        continue;
      }
      const std::uint32_t left = n + 1, right = node.first;
      const bool left_first = squared_distance(nodes_[left], p) <= squared_distance(nodes_[right], p);
      open[count++] = left_first ? right : left;
      open[count++] = left_first ? left : right;
    }
    return best;
  }

  /// Moves the points; triangles are those of the construction. Some 20 times faster than a new tree, and as good for
  /// queries while what is close together stays so.
  void move(std::span<const Vec3d> points, std::span<const Triangle> triangles) requires(Corners == 3) {
    NPT_ASSERT(triangles.size() == corners_.size());
    for (std::size_t t = 0; t < triangles.size(); ++t)
      corners_[t] = {points[triangles[t][0]], points[triangles[t][1]], points[triangles[t][2]]};
    // Children stand behind their parents.
    for (std::size_t n = nodes_.size(); n-- > 0;) {
      Node& node = nodes_[n];
      if (node.count == 0) {
        const Node &left = nodes_[n + 1], &right = nodes_[node.first];
        node.low = minimum(left.low, right.low);
        node.high = maximum(left.high, right.high);
        continue;
      }
      node.low = node.high = corners_[order_[node.first]][0];
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
        for (const Vec3d corner : corners_[order_[i]]) {
          node.low = minimum(node.low, corner);
          node.high = maximum(node.high, corner);
        }
    }
  }

  /// Whether some triangle that `accept(triangle)` takes meets the open segment ab.
  template <class Accept>
  bool crosses(Vec3d a, Vec3d b, const Accept& accept) const requires(Corners == 3) {
    if (nodes_.empty()) return false;
    std::array<std::uint32_t, 64> open{};
    std::size_t count = 0;
    open[count++] = 0;
    while (count > 0) {
      const std::uint32_t n = open[--count];
      const Node& node = nodes_[n];
      if (!meets_box(node, a, b)) continue;
      if (node.count == 0) {
        open[count++] = n + 1;
        open[count++] = node.first;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
        if (meets_segment(corners_[order_[i]], a, b) && accept(order_[i])) return true;
    }
    return false;
  }

 protected:
  static Vec3d minimum(Vec3d a, Vec3d b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
  static Vec3d maximum(Vec3d a, Vec3d b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }

  static constexpr std::uint32_t leaf_size = Corners == 1 ? 8 : 4;

  /// A leaf has triangles order_[first .. first + count - 1]; another node has its left child behind it and its right
  /// one at `first`.
  struct Node {
    Vec3d low, high;
    std::uint32_t first = 0, count = 0;
  };

  static double squared_distance(const Node& node, Vec3d p) {
    const auto beyond = [](double x, double low, double high) { return std::max({low - x, x - high, 0.0}); };
    const Vec3d d{beyond(p.x, node.low.x, node.high.x), beyond(p.y, node.low.y, node.high.y),
                  beyond(p.z, node.low.z, node.high.z)};
    return dot(d, d);
  }

  /// Whether segment ab meets the box, by the slabs between its sides.
  static bool meets_box(const Node& node, Vec3d a, Vec3d b) {
    double from = 0, to = 1;
    const double start[3] = {a.x, a.y, a.z}, end[3] = {b.x, b.y, b.z};
    const double low[3] = {node.low.x, node.low.y, node.low.z}, high[3] = {node.high.x, node.high.y, node.high.z};
    for (std::size_t k = 0; k < 3; ++k) {
      const double d = end[k] - start[k];
      if (d == 0) {
        if (start[k] < low[k] || start[k] > high[k]) return false;
        continue;
      }
      const double s = (low[k] - start[k]) / d, t = (high[k] - start[k]) / d;
      from = std::max(from, std::min(s, t));
      to = std::min(to, std::max(s, t));
    }
    return from <= to;
  }

  /// Whether segment ab meets a triangle, by the signs of volumes; one seen edge-on is not met.
  static bool meets_segment(const std::array<Vec3d, 3>& t, Vec3d a, Vec3d b) {
    const Vec3d normal = cross(t[1] - t[0], t[2] - t[0]);
    const double from = dot(normal, a - t[0]), to = dot(normal, b - t[0]);
    if (from * to >= 0) return false;
    const Vec3d d = b - a;
    const double u = dot(d, cross(t[0] - a, t[1] - a)), v = dot(d, cross(t[1] - a, t[2] - a)),
                 w = dot(d, cross(t[2] - a, t[0] - a));
    return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
  }

  template <class Accept>
  void visit(std::uint32_t triangle, Vec3d p, const Accept& accept, ClosestPoint& best) const {
    Vec3d point = corners_[triangle][0];
    std::array<double, 3> weights{1, 0, 0};
    if constexpr (Corners == 3) {
      const auto& [a, b, c] = corners_[triangle];
      weights = closest_on_triangle(p, a, b, c);
      point = a * weights[0] + b * weights[1] + c * weights[2];
    }
    const double squared = dot(point - p, point - p);
    if (squared > best.squared_distance || (squared == best.squared_distance && triangle > best.triangle)) return;
    if (accept(triangle)) best = {triangle, weights, point, squared};
  }

  void build() {
    order_.resize(corners_.size());
    std::iota(order_.begin(), order_.end(), 0U);
    if (!order_.empty()) build(0, static_cast<std::uint32_t>(order_.size()));
  }
  void build(std::uint32_t first, std::uint32_t last) {
    const std::size_t n = nodes_.size();
    nodes_.emplace_back();
    constexpr double inf = std::numeric_limits<double>::infinity();
    Node node{{inf, inf, inf}, {-inf, -inf, -inf}, first, last - first};
    const auto sum = [this](std::uint32_t t) {
      Vec3d all = corners_[t][0];
      for (std::size_t k = 1; k < Corners; ++k) all += corners_[t][k];
      return all;
    };
    Vec3d low = node.low, high = node.high;  // of the sums of corners
    const auto extend = [](Vec3d& least, Vec3d& most, Vec3d p) {
      least = {std::min(least.x, p.x), std::min(least.y, p.y), std::min(least.z, p.z)};
      most = {std::max(most.x, p.x), std::max(most.y, p.y), std::max(most.z, p.z)};
    };
    for (std::uint32_t i = first; i < last; ++i) {
      for (const Vec3d corner : corners_[order_[i]]) extend(node.low, node.high, corner);
      extend(low, high, sum(order_[i]));
    }
    if (node.count > leaf_size) {
      const Vec3d extent = high - low;
      const auto along = [&](Vec3d p) {
        return extent.x >= extent.y && extent.x >= extent.z ? p.x : extent.y >= extent.z ? p.y : p.z;
      };
      const std::uint32_t middle = first + node.count / 2;
      const auto at = [this](std::uint32_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
      std::nth_element(at(first), at(middle), at(last), [&](std::uint32_t a, std::uint32_t b) {
        const double x = along(sum(a)), y = along(sum(b));
        return x != y ? x < y : a < b;
      });
      build(first, middle);
      node.first = static_cast<std::uint32_t>(nodes_.size());
      node.count = 0;
      build(middle, last);
    }
    nodes_[n] = node;
  }

  std::vector<std::array<Vec3d, Corners>> corners_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

using TriangleTree = BoxTree<3>;
using PointTree = BoxTree<1>;

}  // namespace npt::inline NPT_ABI
