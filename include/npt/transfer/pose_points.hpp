/// Which points of a pose mesh the network is given, and in which order: every random choice of a transfer, made once and then
/// followed. Frames of a sequence must share them: points that are drawn anew for every frame, or an order that is derived from
/// each frame's coordinates, make the result flicker.
/// Shapes    xyz: [V, 3] floats, row major
/// Requires  triangle indices below V
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/random.hpp>
#include <npt/core/view.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/resample.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/vertex_order.hpp>
#include <npt/transfer/options.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// A mesh in one point has no pose and no shape, whatever it is normalised by.
inline void expect_extent(std::span<const float> xyz, const std::string& name) {
  for (std::size_t i = 3; i < xyz.size(); ++i)
    if (!(xyz[i] == xyz[i % 3])) return;  // NaN counts as different: it goes through to the result
  if (!xyz.empty())
    throw Error({.file = name, .found = "all vertices in one point", .expected = "a mesh with an extent"});
}

}  // namespace internal

/// A choice of points on meshes of one vertex count.
struct PosePoints {
  std::size_t vertices = 0;          ///< V
  std::vector<SurfacePoint> points;  ///< empty: the vertices as they come

  std::size_t count() const noexcept { return points.empty() ? vertices : points.size(); }
};

/// `count` points of a pose mesh, as many as it has vertices for 0. `pairing` numbers independent choices of one seed; in
/// choice 0 of the plain mode vertices stay as they come.
/// Errors  npt::Error for an empty mesh, one whose vertices are all in one point, and another count without
///         options.resample
inline PosePoints choose_points(std::span<const float> xyz, std::span<const Triangle> triangles, std::size_t count,
                                const TransferOptions& options, std::uint64_t pairing = 0,
                                const std::string& name = "pose") {
  expect_points(xyz, name);
  internal::expect_extent(xyz, name);
  PosePoints chosen{xyz.size() / 3, {}};
  const auto vertices = static_cast<std::uint32_t>(chosen.vertices);
  if (count == 0) count = vertices;
  if (count != vertices && !options.resample)
    throw Error({.file = name,
                 .found = std::to_string(vertices) + " vertices",
                 .expected = std::to_string(count) +
                             ", as many as the identity has (or resampling, or weights with the pooled feature)"});
  // Another seed than the identity's: a mesh that takes its own pose must not be paired vertex by vertex.
  std::vector<std::uint32_t> order;
  if (options.invariant) order = canonical_shuffle(xyz, options.seed + 1);
  Random random(options.seed, pairing);
  if (count == vertices && pairing > 0) {
    std::vector<std::uint32_t> shuffle = random_permutation(vertices, random);
    if (options.invariant)
      for (std::uint32_t& place : shuffle) place = order[place];
    order = std::move(shuffle);
  }
  if (count == vertices) {
    for (const std::uint32_t v : order) chosen.points.push_back(SurfacePoint::at_vertex(v));
    return chosen;
  }
  if (order.empty()) {
    chosen.points = draw_points(xyz, triangles, count, random);
    return chosen;
  }
  // Drawn in the canonical order, so that the points don't depend on the vertices' numbers even where there are no faces.
  const std::vector<std::uint32_t> place = inverse_order(internal::view(order));
  std::vector<float> points(xyz.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) points[3 * i + axis] = xyz[3 * std::size_t{order[i]} + axis];
  std::vector<Triangle> faces(triangles.begin(), triangles.end());
  for (Triangle& t : faces) t = {place[t[0]], place[t[1]], place[t[2]]};
  chosen.points = draw_points(internal::view(points), internal::view(faces), count, random);
  for (SurfacePoint& point : chosen.points)
    for (std::uint32_t& corner : point.corners) corner = order[corner];
  return chosen;
}

/// The chosen points of a pose mesh as the network sees them: [count, 3], normalised by the mesh's frame.
/// Errors  npt::Error for another vertex count than they were chosen for, and a mesh in one point
inline std::vector<float> pose_input(std::span<const float> xyz, const PosePoints& chosen,
                                     const TransferOptions& options, const std::string& name = "pose") {
  if (xyz.size() != 3 * chosen.vertices)
    throw Error({.file = name,
                 .found = std::to_string(xyz.size() / 3) + " vertices",
                 .expected = std::to_string(chosen.vertices) + ", as the mesh that the points were chosen on"});
  internal::expect_extent(xyz, name);
  std::vector<float> points;
  if (chosen.points.empty()) {
    points.assign(xyz.begin(), xyz.end());
  } else {
    points.reserve(3 * chosen.points.size());
    for (const Vec3f p : positions_of(internal::view(chosen.points), xyz)) {
      points.push_back(p.x);
      points.push_back(p.y);
      points.push_back(p.z);
    }
  }
  normalising_transform(xyz, options.normalisation, name).apply(internal::view(points), internal::view(points));
  return points;
}

/// The choices for all pairings of a transfer; one where the network pairs no vertices. `identity_vertices` 0: it pairs
/// none.
/// Errors  those of choose_points, and npt::Error for fewer than one pairing
inline std::vector<PosePoints> choose_pairings(std::span<const float> xyz, std::span<const Triangle> triangles,
                                               std::size_t identity_vertices, const TransferOptions& options,
                                               const std::string& name = "pose") {
  if (options.pairings < 1)
    throw Error({.file = "pairings", .found = std::to_string(options.pairings), .expected = "at least 1"});
  std::vector<PosePoints> pairings;
  const int count = identity_vertices == 0 ? 1 : options.pairings;
  for (int p = 0; p < count; ++p)
    pairings.push_back(choose_points(xyz, triangles, identity_vertices, options, static_cast<std::uint64_t>(p), name));
  return pairings;
}

/// The choices for a sequence: made on its first frame and kept for all that follow. A mesh with other faces or another
/// vertex count is the first frame of another sequence.
class SequencePoints {
 public:
  /// As choose_pairings.
  const std::vector<PosePoints>& of(std::span<const float> xyz, std::span<const Triangle> triangles,
                                    std::size_t identity_vertices, const TransferOptions& options,
                                    const std::string& name = "pose") {
    const bool same = !chosen_.empty() && chosen_.front().vertices == xyz.size() / 3 &&
                      identity_vertices_ == identity_vertices &&
                      std::equal(triangles_.begin(), triangles_.end(), triangles.begin(), triangles.end());
    if (!same) {
      chosen_ = choose_pairings(xyz, triangles, identity_vertices, options, name);
      identity_vertices_ = identity_vertices;
      triangles_.assign(triangles.begin(), triangles.end());
    }
    return chosen_;
  }

 private:
  std::vector<PosePoints> chosen_;
  std::vector<Triangle> triangles_;
  std::size_t identity_vertices_ = 0;
};

}  // namespace npt::inline NPT_ABI
