/// Random poses and shapes: as the paper's data set draws them, and, for use outside of it, poses of wider ranges and
/// natural ones.
/// Numerics  a draw depends on the generator's seed, stream and position only: use one stream for each mesh of a set
/// Source    Wang et al., "Neural Pose Transfer by Spatially Adaptive Instance Normalization", CVPR 2020, Table 6
#pragma once

#include <npt/base/random.hpp>
#include <npt/body/natural_poses.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>

#include <array>
#include <cstddef>
#include <initializer_list>
#include <numbers>
#include <vector>

namespace npt::inline NPT_ABI {

/// Range of one angle, in degrees.
struct AngleRange {
  double low = 0;
  double high = 0;
};
/// Ranges of a joint's three axis-angle components.
using JointRange = std::array<AngleRange, 3>;

namespace body::internal {

using PoseRanges = std::array<JointRange, smpl_joint_count>;

/// The ranges of some joints, whose numbers are as the paper prints them, from 1.
constexpr void set_ranges(PoseRanges& table, std::initializer_list<int> numbers, AngleRange x, AngleRange y,
                          AngleRange z) {
  for (const int n : numbers) table[static_cast<std::size_t>(n - 1)] = {x, y, z};
}

constexpr PoseRanges make_pose_ranges() {
  constexpr AngleRange zero{};
  PoseRanges table{};
  const auto set = [&table](std::initializer_list<int> numbers, AngleRange x, AngleRange y, AngleRange z) {
    set_ranges(table, numbers, x, y, z);
  };
  set({1}, {-2, 2}, {-2, 2}, {-2, 2});
  set({2}, {-90, 0}, zero, {0, 40});
  set({3}, {-90, 0}, zero, {-40, 0});
  set({4, 7, 10, 11, 12}, {-1, 1}, {-1, 1}, {-1, 1});
  set({5, 6}, {0, 100}, zero, zero);
  set({8, 9}, {-10, 10}, {-10, 10}, {-1, 1});
  set({13, 16}, {-3, 3}, {-3, 3}, {-3, 3});
  set({14, 15, 17, 18}, zero, {-30, 30}, {-30, 30});
  set({19}, zero, {-60, 0}, zero);
  set({20}, zero, {0, 60}, zero);
  set({21, 22}, {-10, 10}, {-10, 10}, {-1, 1});
  set({23}, {-5, 5}, {0, 10}, {-10, 0});
  set({24}, {-5, 5}, {-10, 0}, {0, 10});
  return table;
}

constexpr PoseRanges make_wide_pose_ranges() {
  PoseRanges table{};
  /// A joint of the left side, and its mirror image with the next number.
  const auto both = [&table](int left, AngleRange x, AngleRange y, AngleRange z) {
    set_ranges(table, {left}, x, y, z);
    set_ranges(table, {left + 1}, x, {-y.high, -y.low}, {-z.high, -z.low});
  };
  set_ranges(table, {1}, {-20, 35}, {-20, 20}, {-15, 15});
  both(2, {-110, 35}, {-25, 25}, {-15, 45});                      // hips
  both(5, {0, 130}, {-5, 5}, {-5, 5});                            // knees
  both(8, {-35, 30}, {-20, 20}, {-10, 10});                       // ankles
  both(11, {-30, 10}, {-2, 2}, {-2, 2});                          // feet
  set_ranges(table, {4, 7, 10}, {-8, 20}, {-12, 12}, {-10, 10});  // spine
  set_ranges(table, {13, 16}, {-20, 20}, {-25, 25}, {-12, 12});   // neck, head
  both(14, {-5, 5}, {-20, 20}, {-25, 20});                        // collars
  both(17, {-45, 45}, {-75, 40}, {-80, 50});                      // shoulders
  both(19, {-20, 20}, {-135, 0}, {-10, 10});                      // elbows
  both(21, {-30, 30}, {-20, 20}, {-30, 30});                      // wrists
  both(23, {-5, 5}, {-10, 10}, {-20, 5});                         // hands
  return table;
}

}  // namespace body::internal

/// Table 6: [24] ranges in degrees, in SMPL's order of joints.
inline constexpr std::array<JointRange, smpl_joint_count> paper_pose_ranges = body::internal::make_pose_ranges();
/// About what healthy joints do: running, sitting, dancing, reaching. The trunk leans by up to 35 degrees. Not of the
/// paper.
inline constexpr std::array<JointRange, smpl_joint_count> wide_pose_ranges = body::internal::make_wide_pose_ranges();

enum class PoseDistribution {
  paper,   ///< uniform in Table 6
  wide,    ///< uniform in wide_pose_ranges
  natural  ///< from the prior of natural poses, in any direction about the vertical
};

/// [24, 3] axis angles in radians. As many numbers are drawn for each pose of a distribution.
NPT_INLINE std::array<float, 3 * smpl_joint_count> sample_pose(
    Random& random, PoseDistribution distribution = PoseDistribution::paper) {
  if (distribution == PoseDistribution::natural) return natural_poses().sample(random);
  const auto& ranges = distribution == PoseDistribution::paper ? paper_pose_ranges : wide_pose_ranges;
  std::array<float, 3 * smpl_joint_count> pose{};
  for (std::size_t i = 0; i < pose.size(); ++i) {
    const AngleRange range = ranges[i / 3][i % 3];
    pose[i] = static_cast<float>(random.uniform(range.low, range.high) * (std::numbers::pi / 180.0));
  }
  return pose;
}

enum class ShapeDistribution {
  normal,  ///< standard normal: a body model's directions are in standard deviations
  uniform  ///< uniform in [-4, 4], as the paper's released data set
};

/// `count` shape parameters.
NPT_INLINE std::vector<float> sample_shape(Random& random, std::size_t count,
                                           ShapeDistribution distribution = ShapeDistribution::normal) {
  std::vector<float> betas(count);
  for (float& beta : betas) {
    beta = static_cast<float>(distribution == ShapeDistribution::normal ? random.normal() : random.uniform(-4.0, 4.0));
  }
  return betas;
}

}  // namespace npt::inline NPT_ABI
