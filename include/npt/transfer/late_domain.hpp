/// A domain that is opened when a mesh first asks for it: of several weights files people's is opened at once, and the
/// others once a mesh isn't surely a person.
/// Threads   as BodyDomain
/// Errors    npt::Error of opening it, at the first call, for weights that are broken or another network's
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/control.hpp>
#include <npt/body/joint_pose.hpp>
#include <npt/body/kind_words.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_list.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/transfer/body_domain.hpp>

#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

class LateDomain final : public BodyDomain {
 public:
  using Open = std::function<std::shared_ptr<const BodyDomain>()>;

  /// open: called once, gives a domain
  explicit LateDomain(Open open) : open_(std::move(open)) {}

  const KindWords& words() const override { return domain().words(); }
  std::shared_ptr<const DomainEstimate> estimate(const MeshView& mesh, const Control& control) const override {
    return domain().estimate(mesh, control);
  }
  std::shared_ptr<const DomainEstimate> follow(const MeshView& frame, const DomainEstimate& last) const override {
    return domain().follow(frame, last);
  }
  std::shared_ptr<const DomainBinding> bind(const MeshView& identity, const DomainEstimate& estimate) const override {
    return domain().bind(identity, estimate);
  }
  void pose(const DomainBinding& identity, const DomainEstimate& pose, std::span<float> result) const override {
    domain().pose(identity, pose, result);
  }
  JointPose joints(const DomainEstimate& estimate) const override { return domain().joints(estimate); }
  SkinnedSkeleton skeleton(const DomainBinding& identity) const override { return domain().skeleton(identity); }
  std::vector<Affine> motions(const DomainBinding& identity, const DomainEstimate& pose) const override {
    return domain().motions(identity, pose);
  }
  std::vector<Affine> rest_motions(const DomainBinding& identity) const override {
    return domain().rest_motions(identity);
  }
  void save(const DomainEstimate& estimate, const DomainBinding& binding, TensorList& out) const override {
    domain().save(estimate, binding, out);
  }
  std::pair<std::shared_ptr<const DomainEstimate>, std::shared_ptr<const DomainBinding>> load(
      const SafetensorsFile& file) const override {
    return domain().load(file);
  }

 private:
  const BodyDomain& domain() const {
    std::call_once(once_, [this] { domain_ = open_(); });
    return *domain_;
  }

  Open open_;
  mutable std::once_flag once_;
  mutable std::shared_ptr<const BodyDomain> domain_;
};

}  // namespace npt::inline NPT_ABI
