/// A mesh as deformation transfer sees it: triangles in double, coincident vertices welded, and what hangs together.
/// Errors    npt::Error for what validate() finds, for a mesh without faces, and for one without a face that has an
///           area
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/baseline/deformation/deformation_gradient.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/mesh/weld.hpp>

#include <algorithm>
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace deformation {

/// P points and T triangles of a mesh with V vertices.
struct Surface {
  std::vector<Vec3d> points;             ///< [P]
  std::vector<std::uint32_t> point_of;   ///< [V] the point that a vertex became
  std::vector<std::uint32_t> vertex_of;  ///< [P] the first vertex that became this point
  std::vector<Triangle> triangles;       ///< [T] of points; numbered as triangulate() numbers them
  std::vector<char> flat;                ///< [T] whether is_flat

  std::array<Vec3d, 3> corners(std::size_t t) const { return corners(t, points); }
  /// The triangle where its points are at `positions` instead. [P]
  std::array<Vec3d, 3> corners(std::size_t t, std::span<const Vec3d> positions) const {
    return {positions[triangles[t][0]], positions[triangles[t][1]], positions[triangles[t][2]]};
  }
  Vec3d centroid(std::size_t t) const { return centroid(t, points); }
  Vec3d centroid(std::size_t t, std::span<const Vec3d> positions) const {
    const auto [a, b, c] = corners(t, positions);
    return (a + b + c) / 3.0;
  }
  /// The mean length of the triangles' sides.
  double mean_side() const {
    double sum = 0;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const auto [a, b, c] = corners(t);
      sum += length(b - a) + length(c - b) + length(a - c);
    }
    return sum / (3 * static_cast<double>(triangles.size()));
  }
  /// Gradients are differences over heights, so that the energies here weigh a triangle by the inverse square of its
  /// height. Below a hundredth of `side`, the mean side, that is taken back: else a few slivers would drown all others
  /// in rounding errors.
  double weight(std::size_t t, double side) const {
    const auto [a, b, c] = corners(t);
    const double height = length(cross(b - a, c - a)) / std::max({length(b - a), length(c - b), length(a - c)});
    const double share = height / (0.01 * side);
    return std::min(1.0, share * share);
  }
  /// The points at the positions of other vertices of the mesh, [V, 3].
  void points_at(std::span<const float> xyz, std::span<Vec3d> positions) const {
    for (std::size_t p = 0; p < positions.size(); ++p) {
      const std::size_t v = 3 * std::size_t{vertex_of[p]};
      positions[p] = Vec3f{xyz[v], xyz[v + 1], xyz[v + 2]}.as<double>();
    }
  }
};

/// The surface of a mesh. `name` stands in messages of errors.
inline Surface surface_of(const Mesh& mesh, const std::string& name, bool weld_seams = true) {
  validate(mesh, name);
  if (mesh.face_count() == 0) throw Error({.file = name, .found = "no faces", .expected = "a mesh with faces"});
  Surface surface;
  Welding welding = weld_seams ? weld(mesh.coordinates()) : unwelded(mesh.vertex_count());
  for (const std::uint32_t v : welding.vertex_of) surface.points.push_back(mesh.positions[v].as<double>());
  surface.triangles = welding.welded(triangulate(mesh));
  surface.point_of = std::move(welding.point_of);
  surface.vertex_of = std::move(welding.vertex_of);
  surface.flat.resize(surface.triangles.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto [a, b, c] = surface.corners(t);
    surface.flat[t] = is_flat(a, b, c) ? 1 : 0;
  }
  if (std::ranges::count(surface.flat, 0) == 0)
    throw Error({.file = name, .found = "faces without an area", .expected = "a face with an area"});
  return surface;
}

/// Unit normals of triangles at `positions`; (0, 0, 0) for one without an area.
inline std::vector<Vec3d> triangle_normals(const Surface& surface, std::span<const Vec3d> positions) {
  std::vector<Vec3d> normals(surface.triangles.size());
  for (std::size_t t = 0; t < normals.size(); ++t) {
    const auto [a, b, c] = surface.corners(t, positions);
    if (!is_flat(a, b, c)) normals[t] = normalised(cross(b - a, c - a));
  }
  return normals;
}

/// A side of a triangle as an edge {a, b}, a < b.
struct TriangleSide {
  Edge edge;
  std::uint32_t triangle = 0;
  friend auto operator<=>(const TriangleSide&, const TriangleSide&) = default;  // NOLINT(modernize-use-nullptr)
};

/// The sides of triangles that are not flat, sorted: those of one edge stand together.
inline std::vector<TriangleSide> sorted_sides(const Surface& surface) {
  std::vector<TriangleSide> sides;
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    if (surface.flat[t] != 0) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [a, b] = std::minmax(surface.triangles[t][i], surface.triangles[t][(i + 1) % 3]);
      sides.push_back({{a, b}, t});
    }
  }
  std::ranges::sort(sides);
  return sides;
}

/// Which piece each point belongs to: pieces hang together by triangles. Piece 0 has the most triangles that are not
/// flat; points of no triangle are separate components, at the end.
struct Pieces {
  std::vector<std::uint32_t> of_point;  ///< [P]
  std::size_t count = 0;
};

inline Pieces pieces_of(const Surface& surface) {
  const std::size_t point_count = surface.points.size();
  const std::vector<std::uint32_t> root = connected_components(surface.triangles, point_count);
  // Flat triangles count too, but less than one that isn't.
  std::vector<std::size_t> size(point_count);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    size[root[surface.triangles[t][0]]] += surface.flat[t] != 0 ? 1 : 1 + surface.triangles.size();
  std::vector<std::uint32_t> roots;
  for (std::uint32_t p = 0; p < point_count; ++p)
    if (root[p] == p) roots.push_back(p);
  std::ranges::stable_sort(roots, [&size](std::uint32_t a, std::uint32_t b) { return size[a] > size[b]; });
  std::vector<std::uint32_t> number(point_count);
  for (std::uint32_t i = 0; i < roots.size(); ++i) number[roots[i]] = i;
  Pieces pieces{std::vector<std::uint32_t>(point_count), roots.size()};
  for (std::uint32_t p = 0; p < point_count; ++p) pieces.of_point[p] = number[root[p]];
  return pieces;
}

}  // namespace deformation

}  // namespace npt::inline NPT_ABI
