/// Normals from faces, weighted by area, and their renewal after the vertices moved.
/// Requires  a valid mesh (validate.hpp)
/// Source    Newell's method for faces of any size: the sum of the cross products of successive corners is twice the
///           area times the normal, also for faces that are not flat
#pragma once

#include <npt/base/sort.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/vertex_order.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Twice the area of face f times its unit normal. Corners are taken relative to the first one: far from the origin the
/// products would cancel.
NPT_INLINE Vec3d face_area_vector(const Mesh& mesh, std::size_t f) {
  const std::span<const std::uint32_t> face = mesh.face(f);
  Vec3d sum;
  if (face.empty()) return sum;
  const Vec3d origin = mesh.positions[face[0]].as<double>();
  for (std::size_t i = 1; i + 1 < face.size(); ++i)
    sum += cross(mesh.positions[face[i]].as<double>() - origin, mesh.positions[face[i + 1]].as<double>() - origin);
  return sum;
}

/// [P] For each point the sum of its triangles' unit normals times twice their areas.
NPT_INLINE std::vector<Vec3d> area_vectors(std::span<const Vec3d> points, std::span<const Triangle> triangles) {
  std::vector<Vec3d> sums(points.size());
  for (const auto& [a, b, c] : triangles) {
    const Vec3d area = cross(points[b] - points[a], points[c] - points[a]);
    for (const std::uint32_t p : {a, b, c}) sums[p] += area;
  }
  return sums;
}

/// [P] At the least point of each set, the share of the triangles' area that its points have; 0 without any area.
/// sets: [P] as UnionFind::sets()
NPT_INLINE std::vector<double> area_shares(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                                           std::span<const std::uint32_t> sets) {
  std::vector<double> shares(points.size());
  double total = 0;
  for (const Triangle& t : triangles) {
    const double third = length(cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]])) / 3;
    for (const std::uint32_t p : t) shares[sets[p]] += third, total += third;
  }
  for (double& share : shares) share /= total > 0 ? total : 1;
  return shares;
}

/// One unit normal a vertex, the area-weighted mean of its faces'; (0, 0, 0) where no face with an area touches it.
NPT_INLINE std::vector<Vec3f> vertex_normals(const Mesh& mesh) {
  std::vector<Vec3d> sums(mesh.vertex_count());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const Vec3d area = face_area_vector(mesh, f);
    for (const std::uint32_t v : mesh.face(f)) sums[v] += area;
  }
  std::vector<Vec3f> normals(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) normals[v] = normalised(sums[v]).as<float>();
  return normals;
}

namespace internal {

/// Replaces `normal` by the direction of `sum` where it has one.
NPT_INLINE void set_direction(Vec3f& normal, Vec3d sum) {
  const Vec3d direction = normalised(sum);
  if (direction != Vec3d{}) normal = direction.as<float>();
}

/// Normals that corners refer to. The corners of one vertex that share a stored normal lie on one smooth piece around
/// it: their normal becomes the area-weighted mean of their faces', so hard edges stay hard. Exporters also let distant
/// vertices share a stored normal because the two happened to be equal in the old pose. A shared normal therefore stays
/// shared as long as its vertices agree, and a vertex that now has another direction gets a new entry at the end.
NPT_INLINE void recompute_corner_normals(Mesh& mesh) {
  struct Use {
    Vec3d sum;
    std::uint32_t index = no_index;
  };
  const auto key = [&](std::size_t c) { return pair_key(mesh.corner_normal[c], mesh.corners[c]); };
  std::vector<std::uint64_t> keys;  // each once, ascending
  for (std::size_t c = 0; c < mesh.corners.size(); ++c)
    if (mesh.corner_normal[c] != no_index) keys.push_back(key(c));
  sort_keys_once(keys);
  std::vector<Use> uses(keys.size());
  const auto use_of = [&](std::size_t c) -> Use& {
    return uses[static_cast<std::size_t>(std::lower_bound(keys.data(), keys.data() + keys.size(), key(c)) -
                                         keys.data())];
  };
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const Vec3d area = face_area_vector(mesh, f);
    for (std::size_t c = mesh.face_start[f]; c < mesh.face_start[f + 1]; ++c)
      if (mesh.corner_normal[c] != no_index) use_of(c).sum += area;
  }
  const std::vector<Vec3f> stored = mesh.normals;
  std::vector<bool> taken(stored.size());
  for (std::size_t c = 0; c < mesh.corners.size(); ++c) {
    if (mesh.corner_normal[c] == no_index) continue;
    Use& use = use_of(c);
    if (use.index == no_index) {
      const std::uint32_t old = mesh.corner_normal[c];
      Vec3f normal = stored[old];
      set_direction(normal, use.sum);
      // 1e-5: what rounding of the positions leaves between corners of one flat face.
      const bool fits = !taken[old] || dot(normal - mesh.normals[old], normal - mesh.normals[old]) < 1e-10F;
      use.index = fits ? old : static_cast<std::uint32_t>(mesh.normals.size());
      if (!fits) mesh.normals.push_back(normal);
      if (!taken[old]) mesh.normals[old] = normal;
      taken[old] = true;
    }
    mesh.corner_normal[c] = use.index;
  }
}

/// Normals one a vertex. Formats that have no index for each kind of number split vertices along the seams of texture:
/// vertices in one place whose stored normals are equal lie on one smooth piece, and take the mean of all their faces.
NPT_INLINE void recompute_vertex_normals(Mesh& mesh) {
  std::vector<Vec3d> sums(mesh.vertex_count());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const Vec3d area = face_area_vector(mesh, f);
    for (const std::uint32_t v : mesh.face(f)) sums[v] += area;
  }
  const std::vector<std::uint32_t> representative = coincident_representatives(std::as_const(mesh).coordinates());
  std::vector<bool> shared(mesh.vertex_count());
  for (std::uint32_t v = 0; v < representative.size(); ++v)
    if (representative[v] != v) shared[v] = shared[representative[v]] = true;
  std::vector<std::uint32_t> order;
  for (std::uint32_t v = 0; v < shared.size(); ++v) {
    if (shared[v])
      order.push_back(v);
    else
      set_direction(mesh.normals[v], sums[v]);
  }
  const auto key = [&](std::uint32_t v) {
    const Vec3f n = mesh.normals[v];
    return std::tuple(representative[v], order_key(n.x), order_key(n.y), order_key(n.z));
  };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return std::pair(key(a), a) < std::pair(key(b), b); });
  for (std::size_t first = 0, end = 0; first < order.size(); first = end) {
    const auto own = key(order[first]);
    Vec3d sum;
    for (end = first; end < order.size() && key(order[end]) == own; ++end) sum += sums[order[end]];
    for (std::size_t i = first; i < end; ++i) set_direction(mesh.normals[order[i]], sum);
  }
}

}  // namespace internal

/// Renews the normals of a mesh whose positions changed; a mesh without normals stays without. One normal a vertex:
/// each becomes the area-weighted mean of the faces around its point that had this normal. An index at each corner: so
/// does the normal of each smooth piece around a vertex, so that hard edges stay hard. What no face determines (points,
/// faces without area, normals that nothing refers to) keeps its value.
NPT_INLINE void recompute_normals(Mesh& mesh) {
  if (mesh.normals.empty()) return;
  if (!mesh.corner_normal.empty()) {
    internal::recompute_corner_normals(mesh);
  } else if (mesh.normals.size() == mesh.vertex_count()) {
    internal::recompute_vertex_normals(mesh);
  }
}

}  // namespace npt::inline NPT_ABI
