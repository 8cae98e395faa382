/// Which triangles of two meshes belong together. Where both have the same faces: one to one. Otherwise they are found
/// from a few markers: the source is registered onto the target, and triangles whose centroids then are nearest are
/// paired.
/// Errors    npt::Error as surface_of() and register_surfaces() throw it, and for meshes of which one is inside out
/// Source    Sumner and Popovic, "Deformation Transfer for Triangle Meshes", SIGGRAPH 2004, section 5
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/vec3.hpp>
#include <npt/baseline/deformation/markers.hpp>
#include <npt/baseline/deformation/registration.hpp>
#include <npt/baseline/deformation/surface.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/solve/best_similarity.hpp>

#include <algorithm>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// A triangle of the source and one of the target that belong together, by their numbers in triangulate().
struct TrianglePair {
  std::uint32_t source = 0, target = 0;
  friend auto operator<=>(const TrianglePair&, const TrianglePair&) = default;  // NOLINT(modernize-use-nullptr)
};

namespace deformation {

/// The triangles of a surface as centroids, to find the nearest that faces the same way.
class Centroids {
 public:
  Centroids(const Surface& surface, std::span<const Vec3d> positions) {
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
      const auto [a, b, c] = surface.corners(t, positions);
      if (surface.flat[t] != 0) continue;
      number_.push_back(t);
      centre_.push_back((a + b + c) / 3.0);
      normal_.push_back(cross(b - a, c - a));
    }
    tree_ = PointTree(centre_);
  }

  std::size_t size() const { return number_.size(); }
  std::uint32_t number(std::size_t i) const { return number_[i]; }

  /// The triangle nearest to triangle i of `other` whose normal is less than 90 degrees away; no_index: there is none.
  std::uint32_t nearest(const Centroids& other, std::size_t i) const {
    const ClosestPoint found =
        tree_.closest(other.centre_[i], [&](std::uint32_t k) { return dot(normal_[k], other.normal_[i]) > 0; });
    return found.triangle == no_index ? no_index : number_[found.triangle];
  }

 private:
  std::vector<std::uint32_t> number_;  ///< of the triangle
  std::vector<Vec3d> centre_, normal_;
  PointTree tree_{std::span<const Vec3d>()};
};

}  // namespace deformation

/// For each triangle of the one surface the nearest of the other, and the other way round; every pair once, ascending.
/// `registered`: the source's points where they lie on the target.
template <Executor Exec = SerialExecutor>
std::vector<TrianglePair> nearest_pairs(const deformation::Surface& source, std::span<const Vec3d> registered,
                                        const deformation::Surface& target, const Exec& executor = Exec()) {
  const deformation::Centroids from(source, registered), to(target, target.points);
  std::vector<TrianglePair> pairs(from.size() + to.size());
  for_ranges(executor, pairs.size(), [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      pairs[i] = i < from.size() ? TrianglePair{from.number(i), to.nearest(from, i)}
                                 : TrianglePair{from.nearest(to, i - from.size()), to.number(i - from.size())};
  });
  std::erase_if(pairs, [](const TrianglePair& p) { return p.source == no_index || p.target == no_index; });
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

/// Whether triangle i of one mesh is triangle i of the other: the same vertices in the same faces.
inline bool same_topology(const Mesh& source, const Mesh& target) {
  return source.vertex_count() == target.vertex_count() && source.face_start == target.face_start &&
         source.corners == target.corners;
}

/// Triangle i with triangle i.
inline std::vector<TrianglePair> identical_pairs(std::size_t triangle_count) {
  std::vector<TrianglePair> pairs(triangle_count);
  for (std::uint32_t t = 0; t < triangle_count; ++t) pairs[t] = {t, t};
  return pairs;
}

struct CorrespondenceOptions {
  bool weld = true;  ///< vertices of one mesh at the same point are one
  RegistrationOptions registration;
};

struct Correspondence {
  std::vector<TrianglePair> pairs;
  Similarity similarity;          ///< from source to target, by the markers
  std::vector<Vec3f> registered;  ///< [Vs] the source's vertices where they lie on the target
};

/// Once for a pair of bodies, whatever their poses later. `progress` is called after every step of the registration.
template <Executor Exec = SerialExecutor>
Correspondence find_correspondence(const Mesh& source, const Mesh& target, std::span<const Marker> markers,
                                   const CorrespondenceOptions& options = {}, const RegistrationProgress& progress = {},
                                   const Exec& executor = Exec()) {
  const deformation::Surface from = deformation::surface_of(source, "source", options.weld);
  const deformation::Surface to = deformation::surface_of(target, "target", options.weld);
  const Registration registration = register_surfaces(from, to, markers, options.registration, progress, executor);
  Correspondence result{nearest_pairs(from, registration.points, to, executor), registration.similarity, {}};
  if (result.pairs.empty())
    throw Error({.file = "source and target",
                 .found = "no triangles that face the same way",
                 .expected = "two meshes whose faces turn the same way around, and markers at matching places"});
  for (const std::uint32_t p : from.point_of) result.registered.push_back(registration.points[p].as<float>());
  return result;
}

}  // namespace npt::inline NPT_ABI
