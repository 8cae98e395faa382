/// Natural poses of a plan of bodies, gathered for a weights file: distinct frames of clips, and their moments for a
/// prior of poses.
///   save_poses(plan, distinct_poses(frames, 1500), "prior.safetensors");
/// Shapes    a pose: [J, 3] axis angles in radians; mean: [J, 3]; covariance: [3 (J - 1), 3 (J - 1)], without the root
/// Tensors   pose_prior/mean, pose_prior/covariance, pose_prior/poses [N, 3 J]; F32
/// Errors    npt::Error where there are no poses, or of another number of joints
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

using PlanPose = std::vector<float>;

/// Left and right exchanged.
inline PlanPose mirrored_pose(const BodyPlan& plan, const PlanPose& pose) {
  PlanPose result;
  for (const JointPlan& joint : plan.joints) {
    const float* from = &pose[3 * joint.mirrored];
    const Vec3f own = mirrored(Vec3f{from[0], from[1], from[2]}.as<double>()).as<float>();
    result.insert(result.end(), {own.x, own.y, own.z});
  }
  return result;
}

/// At most `most` poses that are as far from each other as can be: each is the farthest from those before it. What is
/// within `same` radians, as a root mean square over all joints but the root, of one of them is left out.
inline std::vector<PlanPose> distinct_poses(const std::vector<PlanPose>& poses, std::size_t most, double same = 0.01) {
  std::vector<PlanPose> result;
  if (poses.empty()) return result;
  std::vector<double> far(poses.size(), std::numeric_limits<double>::infinity());
  std::size_t next = 0;
  while (result.size() < most) {
    result.push_back(poses[next]);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      double sum = 0;
      for (std::size_t k = 3; k < poses[i].size(); ++k) {
        const double off = static_cast<double>(poses[i][k] - poses[next][k]);
        sum += off * off;
      }
      far[i] = std::min(far[i], sum * 3 / static_cast<double>(poses[i].size() - 3));
    }
    next = static_cast<std::size_t>(std::ranges::max_element(far) - far.begin());
    if (far[next] <= same * same) break;
  }
  return result;
}

struct GatheredMoments {
  std::vector<float> mean, covariance;
};

/// Of the poses and their mirror images, so that both sides are alike.
inline GatheredMoments pose_moments(const BodyPlan& plan, const std::vector<PlanPose>& poses) {
  if (poses.empty()) throw Error({.file = "poses", .found = "none", .expected = "frames of clips"});
  const std::size_t n = 3 * plan.joint_count(), m = n - 3;
  std::vector<PlanPose> all = poses;
  for (const PlanPose& pose : poses) {
    if (pose.size() != n)
      throw Error({.file = "poses",
                   .found = std::to_string(pose.size()) + " numbers",
                   .expected = "three for each of " + std::to_string(plan.joint_count()) + " joints"});
    all.push_back(mirrored_pose(plan, pose));
  }
  const PoseMoments own = moments_of(all);
  GatheredMoments moments;
  for (const Vec3d mean : own.mean)
    for (const double x : {mean.x, mean.y, mean.z}) moments.mean.push_back(static_cast<float>(x));
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t k = 0; k < m; ++k)
      moments.covariance.push_back(static_cast<float>(own.covariance[std::max(i, k) * m + std::min(i, k)]));
  return moments;
}

/// A file with the poses and their moments.
inline void save_poses(const BodyPlan& plan, const std::vector<PlanPose>& poses, const std::filesystem::path& path,
                       const std::map<std::string, std::string>& metadata = {}) {
  const GatheredMoments moments = pose_moments(plan, poses);
  std::vector<float> all;
  for (const PlanPose& pose : poses) all.insert(all.end(), pose.begin(), pose.end());
  const std::uint64_t j = plan.joint_count(), m = 3 * (j - 1);
  const auto tensor = [](const char* name, TensorShape shape, const std::vector<float>& values) {
    return FileTensor{
        .name = name, .dtype = Dtype::f32, .shape = std::move(shape), .bytes = std::as_bytes(std::span(values))};
  };
  const std::vector<FileTensor> tensors{tensor("pose_prior/mean", {j, 3}, moments.mean),
                                        tensor("pose_prior/covariance", {m, m}, moments.covariance),
                                        tensor("pose_prior/poses", {poses.size(), 3 * j}, all)};
  write_safetensors(path, tensors, metadata);
}

}  // namespace npt::inline NPT_ABI
