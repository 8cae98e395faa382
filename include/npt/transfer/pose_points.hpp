/// Which points of a pose mesh the network is given, and in which order: every random choice of a transfer. Frames of a
/// sequence must share them: points that are drawn anew for every frame, or an order that is derived from each frame's
/// coordinates, make the result flicker.
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/resample.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/vertex_order.hpp>
#include <npt/transfer/network_state.hpp>
#include <npt/transfer/options.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// Memory of choose_points, for calls that must not allocate.
struct ChoiceScratch {
  std::vector<std::uint64_t> keys;
  std::vector<std::uint32_t> canonical, place;
  std::vector<float> ordered;
  std::vector<Triangle> triangles;
  DrawScratch draw;
};

/// Chooses the points of pairing number `pairing` on a pose mesh. `count`: vertices of the identity, where the network
/// pairs vertices; 0: it pairs none, and is given all vertices.
/// Errors    npt::Error for another count without options.network.resample
NPT_INLINE void choose_points(const MeshView& pose, std::size_t count, const TransferOptions& options,
                              std::uint64_t pairing, ChoiceScratch& scratch, PosePoints& chosen) {
  const std::span<const float> xyz = pose.xyz;
  const auto vertices = static_cast<std::uint32_t>(pose.vertex_count());
  const bool paired = count != 0;
  chosen.vertices = vertices;
  chosen.order.clear();
  chosen.surface.clear();
  if (paired && count != vertices && !options.network.resample)
    throw Error({.file = std::string(pose.name),
                 .found = std::to_string(vertices) + " vertices",
                 .expected = std::to_string(count) +
                             ", as many as the identity has (or resampling, or weights with the pooled feature)"});
  if (options.network.invariant) canonical_order(xyz, scratch.keys, scratch.canonical);
  Random random(options.seed, pairing);
  if (!paired) {
    if (options.network.invariant) chosen.order = scratch.canonical;
  } else if (count == vertices) {
    if (options.network.pairing == Pairing::as_given) return;
    random_permutation(vertices, random, chosen.order);
    if (options.network.invariant)
      for (std::uint32_t& v : chosen.order) v = scratch.canonical[v];
  } else if (!options.network.invariant) {
    draw_points(xyz, pose.triangles, count, random, scratch.draw, chosen.surface);
  } else {
    // Drawn in the canonical order, so that the points don't depend on the vertices' numbers even where there are no
    // faces.
    const std::vector<std::uint32_t>& order = scratch.canonical;
    scratch.place.resize(order.size());
    scratch.ordered.resize(xyz.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      scratch.place[order[i]] = static_cast<std::uint32_t>(i);
      for (std::size_t axis = 0; axis < 3; ++axis)
        scratch.ordered[3 * i + axis] = xyz[3 * std::size_t{order[i]} + axis];
    }
    scratch.triangles.resize(pose.triangles.size());
    for (std::size_t t = 0; t < pose.triangles.size(); ++t)
      for (std::size_t corner = 0; corner < 3; ++corner)
        scratch.triangles[t][corner] = scratch.place[pose.triangles[t][corner]];
    draw_points(as_span(scratch.ordered), as_span(scratch.triangles), count, random, scratch.draw, chosen.surface);
    for (SurfacePoint& point : chosen.surface)
      for (std::uint32_t& corner : point.corners) corner = order[corner];
  }
}

/// Where a pose mesh has its chosen points: [count, 3].
/// Errors    npt::Error for another vertex count than they were chosen for
NPT_INLINE void place_points(const MeshView& pose, const PosePoints& chosen, std::vector<float>& points) {
  if (pose.vertex_count() != chosen.vertices)
    throw Error({.file = std::string(pose.name),
                 .found = std::to_string(pose.vertex_count()) + " vertices",
                 .expected = std::to_string(chosen.vertices) + ", as the mesh that the points were chosen on"});
  points.resize(3 * chosen.count());
  float* out = points.data();
  const auto put = [&out](float x, float y, float z) {
    *out++ = x;
    *out++ = y;
    *out++ = z;
  };
  for (const SurfacePoint& point : chosen.surface) {
    const Vec3f p = position_of(point, pose.xyz);
    put(p.x, p.y, p.z);
  }
  if (!chosen.surface.empty()) return;
  for (std::size_t i = 0; i < chosen.vertices; ++i) {
    const float* v = pose.xyz.data() + 3 * (chosen.order.empty() ? i : std::size_t{chosen.order[i]});
    put(v[0], v[1], v[2]);
  }
}

}  // namespace npt::inline NPT_ABI
