/// Skin weights by bone heat: each bone warms the surface that sees it, and the weights are the temperatures in
/// equilibrium.
///   -Laplace(w_j) + H w_j = H p_j,   H = c / d^2
/// for each joint j, with d the distance from a vertex to the nearest bone that it sees, and p_j = 1 where that bone is
/// one of joint j's. A vertex that sees no bone has H = 0 and takes its warmth from its neighbours. The Laplacian is
/// the cotangent one, divided by the vertices' areas, so that a finer mesh gives the same weights.
/// Meshes    any number of pieces; one that sees no bone counts the nearest ones as seen. Vertices in one place, as
///           along seams, count as one. Open borders, edges of many triangles, triangles without area and unused
///           vertices are fine
/// Shapes    points: [V]; weights: [V, J], not negative, each row sums to 1; those below 1e-4 are left out
/// Errors    npt::Error for no bones
/// Source    Baran and Popovic, "Automatic rigging and animation of 3D characters", SIGGRAPH 2007, section 4 (c = 1)
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/baseline/skeleton/body_bones.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/cotangent.hpp>
#include <npt/mesh/piece_links.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/weld.hpp>
#include <npt/solve/sparse_cholesky.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct BoneHeatOptions {
  double heat = 1;  ///< c: more makes weights sharper
};

namespace skeleton::internal {

/// Where a vertex gets its heat from: bones at (nearly) the same distance.
struct HeatSource {
  double squared_distance = 0;
  std::vector<std::size_t> joints;  ///< of the bones; empty: none is seen
};

class BoneHeat {
 public:
  BoneHeat(std::vector<Vec3d> points, std::vector<Triangle> triangles, std::span<const Bone> bones)
      : points_(std::move(points)), triangles_(std::move(triangles)), bones_(bones), tree_(points_, triangles_) {
    find_sources();
  }

  /// [P, joints]
  SparseMatrix weights(std::size_t joints, double heat) const {
    const CotangentWeights cotangent = cotangent_weights(points_, triangles_);
    std::vector<SymmetricEntry> entries;
    for (std::size_t e = 0; e < cotangent.edges.size(); ++e) {
      const auto [a, b] = cotangent.edges[e];
      const double w = cotangent.weights[e];
      entries.push_back({a, a, w});
      entries.push_back({b, b, w});
      entries.push_back({a, b, -w});
    }
    // A point that has no area of its own is held by its source only as firmly as any.
    const double usual = cotangent.total_area > 0 ? cotangent.total_area / static_cast<double>(points_.size()) : 1;
    std::vector<double> gain(points_.size());
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
      if (sources_[p].joints.empty()) continue;
      const double area = cotangent.areas[p] > 0 ? cotangent.areas[p] : usual;
      // No point is nearer to its bone than a hair: a joint that touches the skin would be a singularity.
      gain[p] = heat * area / std::max(sources_[p].squared_distance, 1e-8 * cotangent.total_area);
      entries.push_back({p, p, gain[p]});
    }
    const SparseCholesky system(points_.size(), entries);
    std::vector<std::vector<double>> temperature(joints, std::vector<double>(points_.size()));
    for (std::size_t p = 0; p < points_.size(); ++p)
      for (const std::size_t j : sources_[p].joints)
        temperature[j][p] += gain[p] / static_cast<double>(sources_[p].joints.size());
    for (std::vector<double>& column : temperature) system.solve(column);
    return rows(temperature);
  }

 private:
  static constexpr double least_weight_kept = 1e-4;

  /// The bones' distances from a point, nearest first.
  std::vector<std::pair<double, std::size_t>> bones_by_distance(Vec3d p) const {
    std::vector<std::pair<double, std::size_t>> result;
    for (std::size_t b = 0; b < bones_.size(); ++b) {
      const Vec3d d = nearest_on(bones_[b], p) - p;
      result.emplace_back(dot(d, d), b);
    }
    std::sort(result.begin(), result.end());
    return result;
  }

  static Vec3d nearest_on(const Bone& bone, Vec3d p) {
    const double t = closest_on_segment(p, bone.from, bone.to);
    return bone.from * (1 - t) + bone.to * t;
  }

  bool sees(std::uint32_t p, Vec3d target) const {
    return !tree_.crosses(points_[p], target, [&](std::uint32_t t) {
      return triangles_[t][0] != p && triangles_[t][1] != p && triangles_[t][2] != p;
    });
  }

  /// The nearest bone that `accept` takes, and those as near but for rounding.
  template <class Accept>
  HeatSource source_of(Vec3d p, const Accept& accept) const {
    HeatSource source;
    for (const auto& [squared, bone] : bones_by_distance(p)) {
      if (!source.joints.empty() && squared > 1.0002 * source.squared_distance) break;
      if (!accept(bone)) continue;
      if (source.joints.empty()) source.squared_distance = squared;
      if (std::ranges::find(source.joints, bones_[bone].joint) == source.joints.end())
        source.joints.push_back(bones_[bone].joint);
    }
    return source;
  }

  void find_sources() {
    const std::vector<std::uint32_t> piece = connected_components(triangles_, points_.size());
    std::vector<bool> warm(points_.size(), false);
    sources_.resize(points_.size());
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
      sources_[p] =
          source_of(points_[p], [&](std::size_t bone) { return sees(p, nearest_on(bones_[bone], points_[p])); });
      if (!sources_[p].joints.empty()) warm[piece[p]] = true;
    }
    for (std::uint32_t p = 0; p < points_.size(); ++p)
      if (!warm[piece[p]]) sources_[p] = source_of(points_[p], [](std::size_t) { return true; });
  }

  SparseMatrix rows(const std::vector<std::vector<double>>& temperature) const {
    SparseMatrix result;
    result.columns = temperature.size();
    for (std::size_t p = 0; p < points_.size(); ++p) {
      double sum = 0;
      for (const auto& column : temperature) sum += column[p] > least_weight_kept ? column[p] : 0;
      for (std::uint32_t j = 0; j < temperature.size(); ++j)
        if (temperature[j][p] > least_weight_kept) result.append(j, static_cast<float>(temperature[j][p] / sum));
      result.end_row();
    }
    return result;
  }

  std::vector<Vec3d> points_;
  std::vector<Triangle> triangles_;
  std::span<const Bone> bones_;
  TriangleTree tree_;
  std::vector<HeatSource> sources_;
};

}  // namespace skeleton::internal

/// Requires  finite points, triangles of numbers below V, bones of joints below `joint_count`
inline SparseMatrix bone_heat_weights(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                                      std::span<const Bone> bones, std::size_t joint_count,
                                      const BoneHeatOptions& options = {}) {
  if (bones.empty()) throw Error({.file = "skeleton", .found = "no bones", .expected = "at least one"});
  std::vector<float> xyz;
  for (const Vec3d p : points)
    xyz.insert(xyz.end(), {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
  const Welding welding = weld(xyz);
  std::vector<Vec3d> welded;
  for (const std::uint32_t v : welding.vertex_of) welded.push_back(points[v]);
  const SparseMatrix weights = skeleton::internal::BoneHeat(std::move(welded), welding.welded(triangles), bones)
                                   .weights(joint_count, options.heat);
  return weights.gathered(welding.point_of);
}

}  // namespace npt::inline NPT_ABI
