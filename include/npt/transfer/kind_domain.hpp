/// The domain of a kind of body: a body with proportions is estimated in both meshes, and the identity's joints take
/// the pose's angles, by linear blend skinning.
///   1. estimate  the correspondence network and the fits of estimate/body_estimator.hpp
///   2. bind      joints, skin weights and hands of the identity (skin/bound_character.hpp)
///   3. angles    of the pose: with its hands, and where the file says how, corrected by the fit's known bias or from
///                one shape's posture at rest to the other's, and from the identity's own posture at rest
///   4. skinning  the identity's root joint stays in its place
/// Weights   tensors and texts under "correspondence/", "fit_bias/" and "posture/" of a file
/// Source    Wang et al., CVPR 2020, supplement C.1 (skinning); docs/how-it-works.md (estimate)
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/as_span.hpp>
#include <npt/base/control.hpp>
#include <npt/base/default_executor.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/joint_pose.hpp>
#include <npt/body/kind_words.hpp>
#include <npt/config.hpp>
#include <npt/estimate/angle_correction.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/body_estimator.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/posture.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_list.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/skin/bound_character.hpp>
#include <npt/transfer/body_domain.hpp>
#include <npt/transfer/bound_file.hpp>
#include <npt/transfer/options.hpp>

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace transfer::internal {

NPT_INLINE_CLASS(class, KindEstimate);
template <class>
class BasicKindEstimate final : public DomainEstimate {
 public:
  BasicKindEstimate(BodyEstimate estimate, const BodyPlan& plan) : body(std::move(estimate)) {
    confidence = body.confidence;
    coverage = body.fit.mesh_explained;
    warnings = body.warnings(plan);
    figure = body.figure;
  }
  BodyEstimate body;
};

NPT_INLINE_CLASS(class, KindBinding);
template <class>
class BasicKindBinding final : public DomainBinding {
 public:
  explicit BasicKindBinding(BoundCharacter bound) : character(std::move(bound)) {}
  BoundCharacter character;
};

/// Half of the views for `fast`: 4 in place of 8, of 1000 points in place of 1500.
NPT_INLINE BodyEstimatorOptions estimator_options(const BodyOptions& wanted) {
  BodyEstimatorOptions options;
  options.figure = wanted.figure;
  if (wanted.quality == Quality::fast) options.views.count = 4, options.read_points = 1000, options.candidates = 3;
  if (wanted.quality == Quality::best) options.views.all = true;
  return options;
}

}  // namespace transfer::internal

template <class Exec = DefaultExecutor>
class KindDomain final : public BodyDomain {
 public:
  /// Errors    npt::Error for weights that are missing, broken, or another network's
  KindDomain(const SafetensorsFile& file, BasicCorrespondenceEstimator<Exec> reader,
             std::shared_ptr<const BodyKind> kind, const BodyOptions& options)
      : estimator_(std::move(reader), std::move(kind), transfer::internal::estimator_options(options)),
        correction_(file.part("fit_bias/"), this->kind()),
        words_(this->kind().plan.words()) {
    if (const SafetensorsFile posture = file.part("posture/"); !posture.tensors().empty())
      posture_.emplace(read_posture_model(posture, this->kind()), this->kind());
  }

  const KindWords& words() const override { return words_; }

  std::shared_ptr<const DomainEstimate> estimate(const MeshView& mesh, const Control& control) const override {
    return std::make_shared<const Estimate>(estimator_.read(mesh, control), kind().plan);
  }
  std::shared_ptr<const DomainEstimate> follow(const MeshView& frame, const DomainEstimate& last) const override {
    return std::make_shared<const Estimate>(estimator_.follow(frame, body_of(last)), kind().plan);
  }
  std::shared_ptr<const DomainBinding> bind(const MeshView& identity, const DomainEstimate& estimate) const override {
    return std::make_shared<const Binding>(bind_character(kind(), identity, body_of(estimate), estimator_.executor()));
  }
  void pose(const DomainBinding& identity, const DomainEstimate& pose, std::span<float> result) const override {
    character_of(identity).pose(kind(), angles(identity, pose), result);
  }
  std::vector<Affine> motions(const DomainBinding& identity, const DomainEstimate& pose) const override {
    return character_of(identity).motions_in_place(kind(), angles(identity, pose));
  }
  SkinnedSkeleton skeleton(const DomainBinding& identity) const override {
    return character_of(identity).skeleton(kind());
  }

  std::vector<Affine> rest_motions(const DomainBinding& identity) const override {
    const BoundCharacter& character = character_of(identity);
    std::vector<float> straight(3 * kind().bound_body().joint_count(), 0.0F);
    if (posture_) {  // as its species stands
      const std::vector<Vec3d> rest = posture_->rest(character.estimate, false);
      for (std::size_t j = 0; j < rest.size(); ++j) set_joint_rotation(as_span(straight), j, rotation_matrix(rest[j]));
    }
    return character.motions_in_place(kind(), correction_.from_own_rest(character.estimate, std::move(straight)));
  }

  JointPose joints(const DomainEstimate& estimate) const override {
    const BodyEstimate& own = body_of(estimate);
    expect_body(own, "mesh");
    const BodyFit& fit = own.fit.body;
    const std::vector<Vec3d> rest = kind().body->joints(fit.betas);
    double legs = 0, count = 0;  // limbs that hang from the trunk without a girdle
    for (const LimbPair& pair : kind().plan.limb_pairs())
      for (const std::vector<std::size_t>& leg : pair.joints)
        if (pair.first == 0) legs += length(rest[leg[1]] - rest[leg[0]]) + length(rest[leg[2]] - rest[leg[1]]), ++count;
    return {fit.axis_angles, (rest[0] + fit.translation) / own.metres + own.centre, legs / count / own.metres};
  }

  void save(const DomainEstimate&, const DomainBinding& binding, TensorList& out) const override {
    save_bound(character_of(binding), out);
  }
  std::pair<std::shared_ptr<const DomainEstimate>, std::shared_ptr<const DomainBinding>> load(
      const SafetensorsFile& file) const override {
    BoundCharacter character = load_bound(file, kind());
    auto estimate = std::make_shared<const Estimate>(character.estimate, kind().plan);
    return {std::move(estimate), std::make_shared<const Binding>(std::move(character))};
  }

 private:
  using Estimate = transfer::internal::KindEstimate;
  using Binding = transfer::internal::KindBinding;

  const BodyKind& kind() const { return estimator_.kind(); }
  static const BodyEstimate& body_of(const DomainEstimate& estimate) {
    return static_cast<const Estimate&>(estimate).body;
  }
  static const BoundCharacter& character_of(const DomainBinding& binding) {
    return static_cast<const Binding&>(binding).character;
  }

  /// [J', 3] The joint angles that the identity takes.
  std::vector<float> angles(const DomainBinding& identity, const DomainEstimate& pose) const {
    const BodyEstimate& estimate = body_of(pose);
    expect_body(estimate, "pose");
    const BoundCharacter& character = character_of(identity);
    const std::vector<float> result = posture_ ? posture_->angles(character.estimate, estimate)
                                               : correction_.without_bias(character.estimate, estimate);
    return correction_.from_own_rest(character.estimate, character.angles(kind(), as_span(result), estimate));
  }

  BasicBodyEstimator<Exec> estimator_;
  AngleCorrection correction_;
  const KindWords& words_;
  std::optional<Posture> posture_;  ///< where the file holds it
};

}  // namespace npt::inline NPT_ABI
