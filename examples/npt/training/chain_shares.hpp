/// Weights of one joint divided among several that lie along a chain of bones.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace rig::internal {

/// [points] How far along a line of points each is, as a share of the whole.
inline std::vector<double> shares_along(std::span<const Vec3d> points) {
  std::vector<double> result{0};
  for (std::size_t i = 1; i < points.size(); ++i) result.push_back(result.back() + length(points[i] - points[i - 1]));
  const double whole = result.back();
  for (double& s : result) s = whole > 0 ? s / whole : 0;
  return result;
}

inline Vec3d point_along(std::span<const Vec3d> points, double share) {
  const std::vector<double> shares = shares_along(points);
  for (std::size_t i = 1; i < points.size(); ++i)
    if (share <= shares[i] && shares[i] > shares[i - 1])
      return points[i - 1] + (points[i] - points[i - 1]) * ((share - shares[i - 1]) / (shares[i] - shares[i - 1]));
  return points.back();
}

class ChainShares {
 public:
  /// points: of the joints, and of the end of the last one's bone
  ChainShares(std::vector<std::size_t> joints, std::vector<Vec3d> points)
      : joints_(std::move(joints)), points_(std::move(points)) {
    at_.push_back(0);
    for (std::size_t i = 1; i < points_.size(); ++i) at_.push_back(at_.back() + length(points_[i] - points_[i - 1]));
  }

  /// The joints' weight in a row goes to those of them beside which the point lies: within a quarter of the shorter of
  /// two bones from where they meet both have some.
  template <class Row>
  void divide(Row& row, Vec3d point) const {
    double sum = 0;
    for (const std::size_t j : joints_) sum += std::exchange(row[j], 0.0);
    if (!(sum > 0)) return;
    const double place = nearest(point);
    double left = sum;
    for (std::size_t i = 0; i + 1 < joints_.size(); ++i) {
      const double half = 0.25 * std::min(at_[i + 1] - at_[i], at_[i + 2] - at_[i + 1]), off = place - at_[i + 1];
      const double beyond = half > 0 ? std::clamp(0.5 + 0.5 * off / half, 0.0, 1.0) : off > 0 ? 1.0 : 0.0;
      const double further = std::min(left, sum * beyond);
      row[joints_[i]] += left - further;
      left = further;
    }
    row[joints_.back()] += left;
  }

 private:
  /// Along the line, of its point that is nearest.
  double nearest(Vec3d p) const {
    double best = std::numeric_limits<double>::infinity(), place = 0;
    for (std::size_t i = 1; i < points_.size(); ++i) {
      const Vec3d bone = points_[i] - points_[i - 1];
      const double square = dot(bone, bone);
      const double t = square > 0 ? std::clamp(dot(p - points_[i - 1], bone) / square, 0.0, 1.0) : 0;
      const double far = length(p - points_[i - 1] - bone * t);
      if (far < best) best = far, place = at_[i - 1] + t * (at_[i] - at_[i - 1]);
    }
    return place;
  }

  std::vector<std::size_t> joints_;
  std::vector<Vec3d> points_;
  std::vector<double> at_;
};

}  // namespace rig::internal

}  // namespace npt::inline NPT_ABI
