#include <doctest/doctest.h>

#include <npt/io/safetensors.hpp>
#include <training/gathered_poses.hpp>

#include <cstddef>
#include <filesystem>
#include <vector>

#include "io/scratch.hpp"
#include "training/quadruped_figure.hpp"

namespace {

npt::PlanPose bent(const char* joint, npt::Vec3f angle) {
  npt::PlanPose pose(3 * quadruped::plan().joint_count());
  const std::size_t at = 3 * quadruped::plan().joint(joint);
  pose[at] = angle.x, pose[at + 1] = angle.y, pose[at + 2] = angle.z;
  return pose;
}

}  // namespace

TEST_CASE("a mirrored pose puts the mesh's mirror image") {
  const npt::BodyPlan& plan = quadruped::plan();
  const npt::BodyModel body = quadruped::body();
  npt::PlanPose pose = bent("l_shoulder", {0.5F, 0.2F, -0.3F});
  pose[3 * plan.joint("neck1") + 1] = 0.4F;
  const npt::PlanPose mirrored = npt::mirrored_pose(plan, pose);
  CHECK(npt::mirrored_pose(plan, mirrored) == pose);
  const auto motions = body.bone_motions({}, pose), others = body.bone_motions({}, mirrored);
  const std::vector<npt::Vec3d> joints = body.joints({});
  for (std::size_t j = 0; j < plan.joint_count(); ++j) {
    const npt::Vec3d a = motions[j](joints[j]), b = others[plan.joints[j].mirrored](joints[plan.joints[j].mirrored]);
    CHECK(length(npt::Vec3d{-a.x, a.y, a.z} - b) < 1e-3);
  }
}

TEST_CASE("distinct poses leave out what is alike; moments are both sides'") {
  const npt::BodyPlan& plan = quadruped::plan();
  std::vector<npt::PlanPose> poses{bent("l_hip", {0.5F, 0, 0}), bent("l_hip", {0.5001F, 0, 0}),
                                   bent("l_hip", {1, 0, 0}), bent("tail1", {0, 0.8F, 0})};
  const std::vector<npt::PlanPose> distinct = npt::distinct_poses(poses, 10);
  CHECK(distinct.size() == 3);
  CHECK(npt::distinct_poses(poses, 2).size() == 2);
  CHECK(npt::distinct_poses({}, 2).empty());
  const npt::GatheredMoments moments = npt::pose_moments(plan, distinct);
  const std::size_t left = 3 * plan.joint("l_hip"), right = 3 * plan.joint("r_hip"), n = 3 * plan.joint_count() - 3;
  CHECK(moments.mean[left] == doctest::Approx(0.25));
  CHECK(moments.mean[right] == doctest::Approx(0.25));
  CHECK(moments.mean[3 * plan.joint("tail1") + 1] == doctest::Approx(0));
  CHECK(moments.covariance[(left - 3) * n + left - 3] ==
        doctest::Approx(moments.covariance[(right - 3) * n + right - 3]));
  CHECK(moments.covariance[(left - 3) * n + right - 3] < 0);
  CHECK_THROWS_AS(npt::pose_moments(plan, {}), npt::Error);
  CHECK_THROWS_AS(npt::pose_moments(plan, {npt::PlanPose(3)}), npt::Error);
}

TEST_CASE("poses are written with their moments") {
  const npt::BodyPlan& plan = quadruped::plan();
  const std::vector<npt::PlanPose> poses{bent("l_hip", {0.5F, 0, 0}), bent("tail1", {0, 0.8F, 0})};
  const scratch::Folder folder;
  npt::save_poses(plan, poses, folder / "poses.safetensors");
  const npt::SafetensorsFile file = npt::SafetensorsFile::read(folder / "poses.safetensors");
  CHECK(file.at("pose_prior/poses").shape == npt::TensorShape{2, 105});
  CHECK(npt::to_float(file.at("pose_prior/poses"))[3 * plan.joint("l_hip")] == 0.5F);
  CHECK(file.at("pose_prior/covariance").shape == npt::TensorShape{102, 102});
}
