/// The mannequin as a rigged scene, bound in any pose, with clips: what the tests of rigs are about.
#pragma once

#include <npt/body/body_model.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/scene/animate.hpp>
#include <npt/scene/from_mesh.hpp>

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace rigged {

using Angles = std::array<float, 3 * npt::smpl_joint_count>;

/// Names of a game pack's kind, in SMPL's order.
inline constexpr std::array<const char*, npt::smpl_joint_count> names{
    "Hips",       "UpperLeg.L", "UpperLeg.R", "Abdomen",    "LowerLeg.L", "LowerLeg.R", "Torso",      "Foot.L",
    "Foot.R",     "Chest",      "Toes.L",     "Toes.R",     "Neck",       "Shoulder.L", "Shoulder.R", "Head",
    "UpperArm.L", "UpperArm.R", "LowerArm.L", "LowerArm.R", "Hand.L",     "Hand.R",     "Fingers.L",  "Fingers.R"};

/// clips: of each the poses that it goes through, a second each.
inline npt::Scene figure(const Angles& bind = {}, const std::vector<std::vector<Angles>>& clips = {}) {
  const npt::BodyModel& body = npt::mannequin();
  const npt::Mesh mesh = npt::to_mesh(body, {}, bind);
  const std::vector<npt::Rigid> bound = body.bone_motions({}, bind);
  const std::vector<npt::Vec3d> joints = body.joints({});
  npt::SkinnedSkeleton skeleton;
  for (std::size_t j = 0; j < npt::smpl_joint_count; ++j) {
    skeleton.names.emplace_back(names[j]);
    skeleton.parents.push_back(j == 0 ? npt::no_item : static_cast<std::size_t>(npt::smpl_parents[j]));
    skeleton.joints.push_back(bound[j](joints[j]));
  }
  const npt::SparseMatrix& weights = body.tables().weights;
  skeleton.start.assign(weights.start.begin(), weights.start.end());
  for (std::size_t i = 0; i < weights.value.size(); ++i)
    skeleton.influences.push_back({static_cast<std::uint16_t>(weights.column[i]), weights.value[i]});
  npt::MeshScene made = npt::scene_from(mesh, "figure");
  const std::size_t first = npt::add_skeleton(made, skeleton);
  for (std::size_t c = 0; c < clips.size(); ++c) {
    std::vector<double> times;
    std::vector<std::vector<npt::Affine>> frames;
    for (const Angles& pose : clips[c]) {
      times.push_back(static_cast<double>(times.size()));
      std::vector<npt::Affine>& frame = frames.emplace_back();
      const std::vector<npt::Rigid> moved = body.bone_motions({}, pose);
      for (std::size_t j = 0; j < moved.size(); ++j) {
        const npt::Rigid m = moved[j] * inverse(bound[j]);
        frame.push_back({m.rotation, m.shift});
      }
    }
    npt::add_skeleton_clip(made, skeleton, first, "clip" + std::to_string(c), times, frames);
  }
  return made.scene;
}

/// A pose with one joint turned.
inline Angles turned(npt::SmplJoint joint, float x, float y, float z, Angles pose = {}) {
  const std::size_t at = 3 * npt::joint_index(joint);
  pose[at] = x, pose[at + 1] = y, pose[at + 2] = z;
  return pose;
}

}  // namespace rigged
