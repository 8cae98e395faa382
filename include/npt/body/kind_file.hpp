/// A kind of body in a weights file: what tells people's body estimation from another kind's.
///   body/...                                      the template, as in body_file.hpp, with its plan in the metadata
///                                                 "body/plan" (body_plan.hpp)
///   pose_prior/mean [J, 3]                        natural poses of the kind, radians; the root's are 0
///   pose_prior/covariance [3 (J - 1), 3 (J - 1)]
///   pose_prior/poses [N, 3 J]                     some of them, in any order
/// Errors    npt::Error that names the file and the tensor: a template without a plan, or with other joints; tensors of
///           other shapes
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/plan_proportions.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace body::internal {

/// A tensor of this shape, as floats. A size of 0: any.
NPT_INLINE std::vector<float> shaped_tensor(const SafetensorsFile& file, std::string_view name, std::size_t rows,
                                            std::size_t columns) {
  const FileTensor& tensor = file.at(name);
  const bool fits = tensor.shape.size() == 2 && (rows == 0 || tensor.shape[0] == rows) && tensor.shape[1] == columns;
  if (!fits)
    throw Error({.file = file.name(),
                 .place = "tensor '" + std::string(name) + "'",
                 .found = "shape " + to_string(tensor.shape),
                 .expected = "[" + (rows == 0 ? "any" : std::to_string(rows)) + ", " + std::to_string(columns) + "]"});
  return to_float(tensor);
}

NPT_INLINE void load_pose_prior(const SafetensorsFile& file, BodyKind& kind) {
  const std::size_t joints = kind.joint_count(), angles = 3 * (joints - 1);
  const std::vector<float> mean = shaped_tensor(file, "mean", joints, 3);
  for (std::size_t j = 0; j < joints; ++j)
    kind.moments.mean.push_back(Vec3f{mean[3 * j], mean[3 * j + 1], mean[3 * j + 2]}.as<double>());
  const std::vector<float> covariance = shaped_tensor(file, "covariance", angles, angles);
  kind.moments.covariance.assign(covariance.begin(), covariance.end());
  const std::vector<float> poses = shaped_tensor(file, "poses", 0, 3 * joints);
  for (std::size_t at = 0; at + 3 * joints <= poses.size(); at += 3 * joints) {
    const auto begin = poses.begin() + static_cast<std::ptrdiff_t>(at);
    kind.poses.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(3 * joints));
  }
  // Searches look at the first ones.
  Random random(20260620);
  for (std::size_t i = kind.poses.size(); i > 1; --i)
    std::swap(kind.poses[i - 1], kind.poses[random.below(static_cast<std::uint32_t>(i))]);
}

}  // namespace body::internal

/// nullptr: the file holds no template. Its body estimation, if any, is people's.
NPT_INLINE std::shared_ptr<const BodyKind> load_body_kind(const SafetensorsFile& file) {
  const SafetensorsFile body = file.part("body/");
  if (body.tensors().empty()) return nullptr;
  const std::string* plan = body.find_metadata("plan");
  if (plan == nullptr)
    throw Error(
        {.file = body.name(), .place = "metadata", .found = "no 'plan'", .expected = "the plan of the template"});
  auto kind = std::make_shared<BodyKind>();
  kind->plan = read_body_plan(*plan, body.name() + " plan");
  kind->body = std::make_shared<const BodyModel>(with_proportions(load_body(body), kind->plan));
  if (const SafetensorsFile prior = file.part("pose_prior/"); !prior.tensors().empty())
    body::internal::load_pose_prior(prior, *kind);
  for (const JointPlan& joint : kind->plan.joints) kind->skeleton_names.push_back(joint.name);
  return checked_kind(std::move(kind));
}

}  // namespace npt::inline NPT_ABI
