/// The paper's data: who is in which pose, from named seeds. Parameters only, so that it fits any body model.
///   training  16 identities, each in the same 400 poses; an identity mesh and a pose mesh are picked at random
///   test      14 new identities; 72 pairs of meshes in training poses ("seen"), 72 in 200 new poses ("unseen")
/// Both meshes of a test pair are of new identities, two different ones, in two different poses of the same set.
/// Source    Wang et al., CVPR 2020, section 4.1 and Table 6. The number of new poses isn't given there.
#pragma once

#include <npt/base/random.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/config.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// [24, 3] axis angles in radians.
using PoseParameters = std::array<float, 3 * smpl_joint_count>;

/// The parameters of a pair: the identity mesh, the pose mesh, and with them the truth, the first shape in the second
/// pose.
struct BodyPair {
  std::vector<float> identity_shape;
  PoseParameters identity_pose{};
  std::vector<float> pose_shape;
  PoseParameters pose{};
};

namespace protocol {

inline constexpr std::size_t training_identities = 16, training_poses = 400;
inline constexpr std::size_t new_identities = 14, new_poses = 200, pairs = 72;

/// Each set has a seed of its own; member i of a set is drawn from stream i.
inline constexpr std::uint64_t training_identity_seed = 20200316, training_pose_seed = 20200317;
inline constexpr std::uint64_t new_identity_seed = 20200318, new_pose_seed = 20200319;
inline constexpr std::uint64_t seen_pair_seed = 20200320, unseen_pair_seed = 20200321;

}  // namespace protocol

namespace data {

inline std::vector<std::vector<float>> protocol_shapes(std::uint64_t seed, std::size_t count, std::size_t parameters,
                                                       ShapeDistribution distribution) {
  std::vector<std::vector<float>> shapes;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    shapes.push_back(sample_shape(random, parameters, distribution));
  }
  return shapes;
}

inline std::vector<PoseParameters> protocol_poses(std::uint64_t seed, std::size_t count) {
  std::vector<PoseParameters> poses;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    poses.push_back(sample_pose(random));
  }
  return poses;
}

/// Pairs of different members of both sets, no pair twice.
inline std::vector<BodyPair> protocol_pairs(std::uint64_t seed, const std::vector<std::vector<float>>& shapes,
                                            const std::vector<PoseParameters>& poses) {
  Random random(seed);
  const auto two_of = [&random](std::size_t count) {
    const auto n = static_cast<std::uint32_t>(count);
    const std::uint32_t a = random.below(n), b = random.below(n - 1);
    return std::pair<std::size_t, std::size_t>(a, b < a ? b : b + 1);
  };
  std::vector<BodyPair> pairs;
  std::set<std::array<std::size_t, 4>> taken;
  while (pairs.size() < protocol::pairs) {
    const auto [identity, other] = two_of(shapes.size());
    const auto [own, pose] = two_of(poses.size());
    if (!taken.insert({identity, own, other, pose}).second) continue;
    pairs.push_back({shapes[identity], poses[own], shapes[other], poses[pose]});
  }
  return pairs;
}

}  // namespace data

/// The paper's training set, for bodies of `shape_count` shape parameters.
struct TrainingSet {
  std::vector<std::vector<float>> shapes;  ///< [16]
  std::vector<PoseParameters> poses;       ///< [400]

  explicit TrainingSet(std::size_t shape_count, ShapeDistribution distribution = ShapeDistribution::normal)
      : shapes(data::protocol_shapes(protocol::training_identity_seed, protocol::training_identities, shape_count,
                                     distribution)),
        poses(data::protocol_poses(protocol::training_pose_seed, protocol::training_poses)) {}
};

/// The 72 pairs of new identities in training poses.
inline std::vector<BodyPair> seen_pose_pairs(std::size_t shape_count,
                                             ShapeDistribution distribution = ShapeDistribution::normal) {
  return data::protocol_pairs(
      protocol::seen_pair_seed,
      data::protocol_shapes(protocol::new_identity_seed, protocol::new_identities, shape_count, distribution),
      data::protocol_poses(protocol::training_pose_seed, protocol::training_poses));
}

/// The 72 pairs of new identities in new poses.
inline std::vector<BodyPair> unseen_pose_pairs(std::size_t shape_count,
                                               ShapeDistribution distribution = ShapeDistribution::normal) {
  return data::protocol_pairs(
      protocol::unseen_pair_seed,
      data::protocol_shapes(protocol::new_identity_seed, protocol::new_identities, shape_count, distribution),
      data::protocol_poses(protocol::new_pose_seed, protocol::new_poses));
}

}  // namespace npt::inline NPT_ABI
