/// Meshes whose joints are known, and how far an estimate's are off: shared by the programs here.
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/points.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace measured {

/// A mesh, and where its joints are.
struct Case {
  std::string name, family;
  bool person = true;
  std::vector<float> xyz{};
  std::vector<npt::Triangle> triangles{};
  std::vector<std::optional<npt::Vec3d>> joints{};  // [J] or none
  double height = 0;                                // in its unit
};

inline std::pair<std::string, std::string> file_and_family(const std::string& argument) {
  const std::size_t sign = argument.rfind('=');
  if (sign == std::string::npos)
    throw npt::Error({.file = argument, .found = "a file without a family", .expected = "FILE=FAMILY"});
  return {argument.substr(0, sign), argument.substr(sign + 1)};
}

/// Joints that all of a kind have, and rigs put into about the same places.
inline std::vector<std::size_t> joints_of(const npt::BodyPlan& plan) {
  std::vector<std::size_t> joints;
  for (const npt::LimbPair& pair : plan.limb_pairs())
    for (const std::vector<std::size_t>& limb : pair.joints)
      for (std::size_t k = pair.first; k <= pair.middle() + 1; ++k) joints.push_back(limb[k]);
  joints.push_back(static_cast<std::size_t>(
      std::ranges::find(plan.joints, npt::JointKind::neck, &npt::JointPlan::kind) - plan.joints.begin()));
  return joints;
}

/// A body in a pose. Its longest side at rest is its height.
inline Case posed_body(const npt::BodyModel& body, const npt::BodyPlan& plan, std::span<const float> shape,
                       std::span<const float> pose) {
  Case made;
  made.xyz.resize(3 * body.vertex_count());
  body.posed(shape, std::vector<float>(pose.size()), made.xyz);
  made.height = npt::bounding_box(made.xyz).longest_side();
  body.posed(shape, pose, made.xyz);
  made.triangles.assign(body.triangles().begin(), body.triangles().end());
  const std::vector<npt::Vec3d> rest = body.joints(shape);
  const std::vector<npt::Rigid> motions = body.bone_motions(shape, pose);
  made.joints.resize(plan.joint_count());
  for (const std::size_t j : joints_of(plan)) made.joints[j] = motions[j](rest[j]);
  return made;
}

/// The rest or a frame of a clip, turned anywhere about the vertical axis.
struct Moment {
  std::vector<float> pose;          // axis angles [J, 3]
  std::size_t clip = 0, frame = 0;  // not of the first one, which is the rest
};

/// The rest and so many frames of clips, which hold axis angles [J, 3] each; the rest alone where there are no clips.
template <class Clips>
std::vector<Moment> moments_of(const Clips& clips, std::size_t joint_count, std::size_t frames, std::uint64_t seed) {
  std::vector<Moment> moments;
  npt::Random random(seed);
  for (std::size_t f = 0; f <= frames; ++f) {
    if (f > 0 && clips.empty()) break;
    Moment& made = moments.emplace_back();
    made.pose.resize(3 * joint_count);
    if (f > 0) {
      made.clip = random.below(static_cast<std::uint32_t>(clips.size()));
      made.frame = random.below(static_cast<std::uint32_t>(clips[made.clip].size()));
      std::ranges::copy(clips[made.clip][made.frame], made.pose.begin());
    }
    const npt::Vec3d turn{0, random.uniform(-std::numbers::pi, std::numbers::pi), 0};
    npt::set_joint_rotation(npt::as_span(made.pose), 0, npt::rotation_matrix(turn) * npt::joint_rotation(made.pose, 0));
  }
  return moments;
}

/// [J] Distances of an estimate's joints, by the figure's height; none where the truth isn't known.
inline std::vector<std::optional<double>> joint_errors(const Case& of, const npt::BodyModel& model,
                                                       const npt::BodyEstimate& estimate) {
  std::vector<std::optional<double>> errors(of.joints.size());
  const std::vector<npt::Vec3d> fitted = npt::fitted_joints(model, estimate.fit.body);
  for (std::size_t j = 0; j < errors.size(); ++j) {
    if (!of.joints[j]) continue;
    const npt::Vec3d place = fitted[j] * (1 / estimate.metres) + estimate.centre;
    errors[j] = length(place - *of.joints[j]) / of.height;
  }
  return errors;
}

/// 1 where none is known.
inline double mean(std::span<const std::optional<double>> errors) {
  double sum = 0, count = 0;
  for (const std::optional<double>& error : errors)
    if (error) sum += *error, ++count;
  return count > 0 ? sum / count : 1;
}

}  // namespace measured
