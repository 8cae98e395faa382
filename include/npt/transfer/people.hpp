/// The domain of people: a body with proportions is estimated in both meshes, and the identity's joints take the
/// pose's angles, by linear blend skinning.
///   1. estimate  the correspondence network and the fits of estimate/body_estimator.hpp
///   2. bind      joints, skin weights and hands of the identity (skin/bound_character.hpp)
///   3. angles    of the pose: corrected by the fit's known bias, with its hands, by the pose transfer network's own
///                result, and from the identity's own posture at rest
///   4. skinning  the identity's root joint stays in its place
/// Weights   tensors and texts under "correspondence/", "network_correction/" and "fit_bias/" of a file
/// Source    Wang et al., CVPR 2020, supplement C.1 (skinning); docs/how-it-works.md (estimate)
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/as_span.hpp>
#include <npt/base/control.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/body_estimator.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/fit_bias.hpp>
#include <npt/estimate/fitted_body.hpp>
#include <npt/estimate/joint_pose.hpp>
#include <npt/estimate/rest_posture.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_list.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/skin/bound_character.hpp>
#include <npt/transfer/body_domain.hpp>
#include <npt/transfer/bound_file.hpp>
#include <npt/transfer/network_correction.hpp>
#include <npt/transfer/options.hpp>

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace transfer::internal {

NPT_INLINE_CLASS(class, PersonEstimate);
template <class>
class BasicPersonEstimate final : public DomainEstimate {
 public:
  explicit BasicPersonEstimate(BodyEstimate estimate) : body(std::move(estimate)) {
    confidence = body.confidence;
    coverage = body.fit.mesh_explained;
    warnings = body.warnings();
    figure = body.figure;
  }
  BodyEstimate body;
};

NPT_INLINE_CLASS(class, PersonBinding);
template <class>
class BasicPersonBinding final : public DomainBinding {
 public:
  explicit BasicPersonBinding(BoundCharacter bound) : character(std::move(bound)) {}
  BoundCharacter character;
};

/// Half of the views for `fast`: 4 in place of 8, of 1000 points in place of 1500.
NPT_INLINE BodyEstimatorOptions estimator_options(Quality quality) {
  BodyEstimatorOptions options;
  if (quality == Quality::fast) options.views.count = 4, options.read_points = 1000, options.fit.candidates = 3;
  if (quality == Quality::best) options.views.all = true;
  return options;
}

}  // namespace transfer::internal

template <class Exec = DefaultExecutor>
class PeopleDomain final : public BodyDomain {
 public:
  /// Errors    npt::Error for weights that are missing, broken, or another network's
  PeopleDomain(const SafetensorsFile& file, const BodyOptions& options, int threads)
      : estimator_(BasicCorrespondenceEstimator<Exec>(file.part("correspondence/"), Exec(threads)),
                   transfer::internal::estimator_options(options.quality)) {
    if (const SafetensorsFile bias = file.part("fit_bias/"); !bias.tensors().empty()) {
      bias_.emplace(bias);
      people_at_rest_ = bias_->people_at_rest();
    }
    if (const SafetensorsFile network = file.part("network_correction/"); !network.tensors().empty())
      correction_ = std::make_unique<const BasicNetworkCorrection<Exec>>(network, Exec(1));
  }

  std::shared_ptr<const DomainEstimate> estimate(const MeshView& mesh, const Control& control) const override {
    return std::make_shared<const Estimate>(estimator_.read(mesh, control));
  }
  std::shared_ptr<const DomainEstimate> follow(const MeshView& frame, const DomainEstimate& last) const override {
    return std::make_shared<const Estimate>(estimator_.follow(frame, body_of(last)));
  }
  std::shared_ptr<const DomainBinding> bind(const MeshView& identity, const DomainEstimate& estimate) const override {
    return std::make_shared<const Binding>(bind_character(fingered(), identity, body_of(estimate)));
  }
  void pose(const DomainBinding& identity, const DomainEstimate& pose, std::span<float> result) const override {
    character_of(identity).pose(fingered(), angles(identity, pose), result);
  }
  std::vector<Affine> motions(const DomainBinding& identity, const DomainEstimate& pose) const override {
    return character_of(identity).motions_in_place(fingered(), angles(identity, pose));
  }
  SkinnedSkeleton skeleton(const DomainBinding& identity) const override {
    return character_of(identity).skeleton(fingered());
  }

  std::vector<Affine> rest_motions(const DomainBinding& identity) const override {
    const BoundCharacter& character = character_of(identity);
    const std::vector<float> straight(3 * fingered().joint_count(), 0.0F);
    return character.motions_in_place(fingered(),
                                      from_own_rest(people_at_rest_, character.estimate, as_span(straight)));
  }

  JointPose joints(const DomainEstimate& estimate) const override {
    using enum SmplJoint;
    const BodyEstimate& own = body_of(estimate);
    expect_body(own, "mesh");
    const BodyFit& fit = own.fit.body;
    const std::vector<Vec3d> rest = estimator_.body().joints(fit.betas);
    const auto distance = [&rest](SmplJoint a, SmplJoint b) {
      return length(rest[joint_index(a)] - rest[joint_index(b)]);
    };
    double legs = distance(left_knee, left_hip) + distance(left_ankle, left_knee);
    legs += distance(right_knee, right_hip) + distance(right_ankle, right_knee);
    return {fit.axis_angles, (rest[0] + fit.translation) / own.metres + own.centre, 0.5 * legs / own.metres};
  }

  void save(const DomainEstimate&, const DomainBinding& binding, TensorList& out) const override {
    save_bound(character_of(binding), out);
  }
  std::pair<std::shared_ptr<const DomainEstimate>, std::shared_ptr<const DomainBinding>> load(
      const SafetensorsFile& file) const override {
    BoundCharacter character = load_bound(file, fingered().joint_count(), estimator_.body().shape_count());
    auto estimate = std::make_shared<const Estimate>(character.estimate);
    return {std::move(estimate), std::make_shared<const Binding>(std::move(character))};
  }

 private:
  using Estimate = transfer::internal::PersonEstimate;
  using Binding = transfer::internal::PersonBinding;

  const BodyModel& fingered() const { return estimator_.fingered_body(); }
  static const BodyEstimate& body_of(const DomainEstimate& estimate) {
    return static_cast<const Estimate&>(estimate).body;
  }
  static const BoundCharacter& character_of(const DomainBinding& binding) {
    return static_cast<const Binding&>(binding).character;
  }

  /// [40, 3] The joint angles that the identity takes.
  std::vector<float> angles(const DomainBinding& identity, const DomainEstimate& pose) const {
    const BodyEstimate& estimate = body_of(pose);
    expect_body(estimate, "pose");
    const BoundCharacter& character = character_of(identity);
    std::vector<float> result = bias_ ? bias_->angles(character.estimate, estimate) : estimate.fit.body.axis_angles;
    result = character.angles(as_span(result), estimate);
    if (correction_ != nullptr) result = correction_->angles(fingered(), character, estimate, std::move(result));
    return from_own_rest(people_at_rest_, character.estimate, as_span(result));
  }

  BasicBodyEstimator<Exec> estimator_;
  std::optional<FitBias> bias_;  ///< these where the file holds them
  std::array<Vec3d, smpl_joint_count> people_at_rest_{};
  std::unique_ptr<const BasicNetworkCorrection<Exec>> correction_;
};

namespace transfer::internal {

NPT_INLINE std::shared_ptr<const BodyDomain> open_people(const SafetensorsFile& file, const BodyOptions& options,
                                                         int threads) {
  if (file.part("correspondence/").tensors().empty()) return nullptr;
  if constexpr (std::is_same_v<DefaultExecutor, SerialExecutor>) threads = 1;
  return std::make_shared<const PeopleDomain<>>(file, options, threads);
}

}  // namespace transfer::internal

#ifndef NPT_PREBUILT
template <class>
std::shared_ptr<const BodyDomain> open_body_domain(const SafetensorsFile& file, const BodyOptions& options,
                                                   int threads) {
  return transfer::internal::open_people(file, options, threads);
}
#endif

}  // namespace npt::inline NPT_ABI
