/// The target of a registration: the closest point of its surface that faces the same way as a point does, unless that
/// lies on an open border. Across a hole the closest point of every point would be on its border.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/baseline/deformation/surface.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace npt::inline NPT_ABI::deformation {

class RegistrationTarget {
 public:
  explicit RegistrationTarget(const Surface& surface)
      : triangles_(surface.triangles),
        normals_(triangle_normals(surface, surface.points)),
        on_border_(surface.points.size()),
        tree_(surface.points, surface.triangles) {
    const std::vector<TriangleSide> sides = sorted_sides(surface);
    for (std::size_t i = 0; i < sides.size(); ++i) {
      const bool alone = (i == 0 || sides[i - 1].edge != sides[i].edge) &&
                         (i + 1 == sides.size() || sides[i + 1].edge != sides[i].edge);
      if (!alone) continue;
      borders_.push_back(sides[i].edge);
      for (const std::uint32_t p : sides[i].edge) on_border_[p] = 1;
    }
  }

  /// The closest point with a normal on `normal`'s side; nothing where there is none or it lies on an open border.
  std::optional<Vec3d> closest(Vec3d p, Vec3d normal) const {
    const ClosestPoint found =
        tree_.closest(p, [&](std::uint32_t triangle) { return dot(normals_[triangle], normal) > 0; });
    if (found.triangle == no_index || is_on_border(found)) return std::nullopt;
    return found.point;
  }

 private:
  bool is_on_border(const ClosestPoint& point) const {
    std::array<std::uint32_t, 3> corners{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < 3; ++i)
      if (point.weights[i] > 0) corners[count++] = triangles_[point.triangle][i];
    if (count == 1) return on_border_[corners[0]] != 0;
    if (count == 3 || on_border_[corners[0]] == 0 || on_border_[corners[1]] == 0) return false;
    return std::ranges::binary_search(borders_,
                                      Edge{std::min(corners[0], corners[1]), std::max(corners[0], corners[1])});
  }

  std::vector<Triangle> triangles_;
  std::vector<Vec3d> normals_;
  std::vector<char> on_border_;
  std::vector<Edge> borders_;
  TriangleTree tree_;
};

}  // namespace npt::inline NPT_ABI::deformation
