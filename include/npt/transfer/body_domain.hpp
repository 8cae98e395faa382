/// A domain's body estimation as PoseTransfer knows it: what stands between it and the parts that take long to
/// compile. A weights file with a body estimator is a domain; people's is transfer/open_domain.hpp.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/control.hpp>
#include <npt/body/joint_pose.hpp>
#include <npt/body/kind_words.hpp>
#include <npt/config.hpp>
#include <npt/estimate/warning_code.hpp>
#include <npt/io/safetensors_class.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/transfer/options.hpp>

#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

template <class>
class BasicTensorList;  // TensorList of io/tensor_list.hpp

/// What a domain found in a mesh. Made by one domain, understood by it alone.
class DomainEstimate {
 public:
  DomainEstimate() = default;
  DomainEstimate(const DomainEstimate&) = delete;
  DomainEstimate& operator=(const DomainEstimate&) = delete;
  virtual ~DomainEstimate() = default;

  double confidence = 0;  ///< 0 to 1
  double coverage = 0;    ///< 0 to 1: share of the mesh's surface that has what was estimated within 3 cm
  std::vector<WarningCode> warnings;
  std::vector<bool> figure;  ///< [T] the mesh's triangles that are the domain's; empty: all
};

/// A mesh bound to what was estimated for it.
class DomainBinding {
 public:
  DomainBinding() = default;
  DomainBinding(const DomainBinding&) = delete;
  DomainBinding& operator=(const DomainBinding&) = delete;
  virtual ~DomainBinding() = default;
};

/// Threads   all members may be called by any number of threads at a time
/// Numerics  the same bits for any number of threads
/// Errors    npt::Error for meshes without a triangle that has an area, and for coordinates that are not finite
class BodyDomain {
 public:
  BodyDomain() = default;
  BodyDomain(const BodyDomain&) = delete;
  BodyDomain& operator=(const BodyDomain&) = delete;
  virtual ~BodyDomain() = default;

  /// What it recognises, for messages; kept_words()'s.
  virtual const KindWords& words() const = 0;

  virtual std::shared_ptr<const DomainEstimate> estimate(const MeshView& mesh, const Control& control) const = 0;
  /// The next frame of a sequence, from the last one's estimate.
  virtual std::shared_ptr<const DomainEstimate> follow(const MeshView& frame, const DomainEstimate& last) const = 0;
  virtual std::shared_ptr<const DomainBinding> bind(const MeshView& identity, const DomainEstimate& estimate) const = 0;
  /// Writes the identity's vertices in the pose, in its own unit and place. result: [V, 3]
  virtual void pose(const DomainBinding& identity, const DomainEstimate& pose, std::span<float> result) const = 0;

  virtual JointPose joints(const DomainEstimate& estimate) const = 0;
  /// The identity's skeleton and skin weights, in its own unit, place and pose.
  virtual SkinnedSkeleton skeleton(const DomainBinding& identity) const = 0;
  /// [J] How the joints move to the pose: blended by all skin weights, these give what pose() does.
  virtual std::vector<Affine> motions(const DomainBinding& identity, const DomainEstimate& pose) const = 0;

  /// [J] How the joints move to the body's rest, from which clips turn them: people's is a T pose that looks along +z.
  /// The root joint stays in its place.
  virtual std::vector<Affine> rest_motions(const DomainBinding& identity) const = 0;

  /// Adds the tensors that give estimate and binding back.
  virtual void save(const DomainEstimate& estimate, const DomainBinding& binding, BasicTensorList<void>& out) const = 0;
  /// Errors    npt::Error that names the file, for one that lacks a tensor or has it in another shape
  virtual std::pair<std::shared_ptr<const DomainEstimate>, std::shared_ptr<const DomainBinding>> load(
      const SafetensorsFile& file) const = 0;
};

/// Opens what a weights file holds for body estimation; nullptr where it holds nothing. threads 0: as many as the
/// process may use
/// Errors    npt::Error for weights that are broken or another network's
#ifdef NPT_COMPILED
std::shared_ptr<const BodyDomain> open_body_domain(const SafetensorsFile& file, const BodyOptions& options,
                                                   int threads);
#else
template <class = void>
std::shared_ptr<const BodyDomain> open_body_domain(const SafetensorsFile& file, const BodyOptions& options,
                                                   int threads);
#endif

}  // namespace npt::inline NPT_ABI
