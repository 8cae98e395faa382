/// Joints as means of vertices, for bodies that are made from a surface and its joints.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace rig::internal {

/// [J, V] Of the vertices near a joint the mean that lies on it: the one nearest to their Gaussian weights.
inline SparseMatrix regressed_joints(std::span<const Vec3d> points, std::span<const Vec3d> joints) {
  SparseMatrix regressor;
  regressor.columns = points.size();
  for (std::size_t j = 0; j < joints.size(); ++j) {
    std::vector<std::pair<std::uint32_t, double>> near;
    for (double radius = 0.08; near.size() < 12 && radius < 10; radius *= 1.5) {
      near.clear();
      for (std::size_t v = 0; v < points.size(); ++v) {
        const double far = length(points[v] - joints[j]) / radius;
        if (far < 2.5) near.emplace_back(static_cast<std::uint32_t>(v), std::exp(-far * far));
      }
    }
    double sum = 0;
    for (const auto& [v, w] : near) sum += w;
    Vec3d mean;
    for (auto& [v, w] : near) w /= sum, mean += points[v] * w;
    Matrix3 spread;
    for (const auto& [v, w] : near) {
      const Vec3d off = points[v] - mean;
      spread += outer(off, off) * w;
    }
    const double floor = 1e-6 * (spread.rows[0].x + spread.rows[1].y + spread.rows[2].z);
    spread += Matrix3::identity() * std::max(floor, 1e-12);
    const Vec3d lift = inverse(Affine{spread, {}}).linear * (joints[j] - mean);
    for (const auto& [v, w] : near) regressor.append(v, static_cast<float>(w * (1 + dot(lift, points[v] - mean))));
    regressor.end_row();
  }
  return regressor;
}

}  // namespace rig::internal

}  // namespace npt::inline NPT_ABI
