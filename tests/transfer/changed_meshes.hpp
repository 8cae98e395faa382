/// What is done to a mesh that must make no difference to a transfer, and how to undo it in a result.
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/random.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/permute.hpp>
#include <npt/transfer/warning.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

namespace changed_meshes {

/// p -> linear p + shift, and vertices in another order.
struct Change {
  std::string name;
  npt::Matrix3 linear = npt::Matrix3::identity();
  npt::Vec3d shift{};
  bool shuffles = false;

  bool mirrors() const { return linear.determinant() < 0; }
  bool turns() const { return linear.rows[0].x + linear.rows[1].y + linear.rows[2].z < 2.9 * scale() && !mirrors(); }
  double scale() const { return std::cbrt(std::abs(linear.determinant())); }
};

/// Scaled, turned by 90 and 180 degrees about each axis, mirrored, shuffled and moved.
inline std::vector<Change> changes() {
  std::vector<Change> all;
  for (const double scale : {0.01, 1000.0})
    all.push_back({"scaled by " + std::to_string(scale), npt::Matrix3::identity() * scale});
  for (const double angle : {std::numbers::pi / 2, std::numbers::pi})
    for (const npt::Vec3d axis : {npt::Vec3d{1, 0, 0}, npt::Vec3d{0, 1, 0}, npt::Vec3d{0, 0, 1}})
      all.push_back({std::string("turned by ") + (angle > 2 ? "180" : "90") + " degrees about " +
                         (axis.x > 0   ? "x"
                          : axis.y > 0 ? "y"
                                       : "z"),
                     npt::rotation_matrix(axis * angle)});
  all.push_back({"mirrored", {{{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}}});
  all.push_back({.name = "shuffled", .shuffles = true});
  all.push_back({.name = "moved by 100 m", .shift = {60, -64, 48}});
  return all;
}

/// order[new] = old
inline std::vector<std::uint32_t> order_of(const npt::Mesh& mesh, const Change& change) {
  npt::Random random(11);
  std::vector<std::uint32_t> order = npt::random_permutation(static_cast<std::uint32_t>(mesh.vertex_count()), random);
  if (!change.shuffles) std::sort(order.begin(), order.end());
  return order;
}

inline npt::Mesh changed(const npt::Mesh& mesh, const Change& change) {
  npt::Mesh result = npt::permute_vertices(mesh, order_of(mesh, change));
  for (npt::Vec3f& p : result.positions) p = (change.linear * p.as<double>() + change.shift).as<float>();
  if (change.mirrors())  // so that faces still face outwards
    for (std::size_t f = 0; f < result.face_count(); ++f)
      std::reverse(result.corners.begin() + static_cast<std::ptrdiff_t>(result.face_start[f]),
                   result.corners.begin() + static_cast<std::ptrdiff_t>(result.face_start[f + 1]));
  return result;
}

/// The positions of a result of a changed mesh, as if nothing had been done. Mirrored meshes are mirrored both.
inline std::vector<npt::Vec3d> undone(const npt::Mesh& result, const Change& change, npt::MeshRole role) {
  const bool of_identity = role == npt::MeshRole::identity;
  const std::vector<std::uint32_t> order = order_of(result, of_identity ? change : Change{});
  // A pose has its direction from its mesh, and its place and size from the identity.
  npt::Matrix3 back = npt::Matrix3::identity();
  if (change.mirrors() || !of_identity) back = change.linear.transposed() * (1 / change.scale());
  std::vector<npt::Vec3d> points(result.vertex_count());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto p = result.positions[i].as<double>();
    points[order[i]] = back * (of_identity ? (p - change.shift) / change.scale() : p);
  }
  return points;
}

struct Distance {
  double mean = 0, largest = 0;
};
/// Between points of the same number, as if the longest side of the second ones' box, which is given, were 1.75 m; both
/// about their means where only directions count.
inline Distance distance(const std::vector<npt::Vec3d>& a, const std::vector<npt::Vec3d>& b, double longest_side,
                         bool about_means) {
  npt::Vec3d mean_a, mean_b;
  for (std::size_t i = 0; about_means && i < a.size(); ++i) mean_a += a[i], mean_b += b[i];
  const npt::Vec3d shift = (mean_b - mean_a) / static_cast<double>(a.size());
  Distance result;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = npt::length(a[i] + shift - b[i]) * 1.75 / longest_side;
    result.mean += d / static_cast<double>(a.size());
    result.largest = std::max(result.largest, d);
  }
  return result;
}

}  // namespace changed_meshes
