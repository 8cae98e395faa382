/// What a transfer knows of the way through bodies: both meshes are read as people, a body is fitted to each, and the
/// identity takes the other's joint angles. Its parts (reader, fit, skinning) take 2 s to parse and stay out of this
/// header; <npt/transfer/body_method.hpp> has npt::body_method.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/estimate/confidence.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/scene/affine.hpp>
#include <npt/scene/skinned_skeleton.hpp>

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// How a transfer is made.
enum class Method {
  automatic,  ///< through bodies where both meshes read as people, else by the pose transfer network
  body,       ///< through bodies, whatever the meshes are
  network     ///< by the pose transfer network
};

/// A mesh as a body method read it: how a body lies in it. Made for one method, read by it alone.
class BodyRead {
 public:
  BodyRead() = default;
  BodyRead(const BodyRead&) = delete;
  BodyRead& operator=(const BodyRead&) = delete;
  virtual ~BodyRead() = default;

  double confidence = 0;  ///< 0 to 1
  std::string notes;      ///< what the user should know: "lies, or its vertical axis is z"
};

/// The joint angles that a mesh was read in.
struct JointPose {
  std::vector<float> axis_angles;  ///< [J, 3], radians
  Vec3d root;                      ///< where the root joint is, in the mesh's unit and place
  double leg = 0;                  ///< from the hip over the knee to the ankle, in the mesh's unit; of both the mean
};

/// An identity bound to its body.
class BodyBinding {
 public:
  BodyBinding() = default;
  BodyBinding(const BodyBinding&) = delete;
  BodyBinding& operator=(const BodyBinding&) = delete;
  virtual ~BodyBinding() = default;
};

/// Threads   all members may be called by any number of threads at a time
/// Errors    npt::Error for meshes without a triangle that has an area, and for coordinates that are not finite
class BodyMethod {
 public:
  BodyMethod() = default;
  BodyMethod(const BodyMethod&) = delete;
  BodyMethod& operator=(const BodyMethod&) = delete;
  virtual ~BodyMethod() = default;

  virtual std::shared_ptr<const BodyRead> read(const MeshView& mesh) const = 0;
  /// The next frame of a sequence, from the last one's reading.
  virtual std::shared_ptr<const BodyRead> follow(const MeshView& frame, const BodyRead& last) const = 0;
  virtual std::shared_ptr<const BodyBinding> bind(const MeshView& identity, const BodyRead& read) const = 0;
  /// The identity's vertices with the pose's joint angles, in its own unit and place. result: [V, 3]
  virtual void pose(const BodyBinding& identity, const BodyRead& pose, std::span<float> result) const = 0;

  virtual JointPose joints(const BodyRead& read) const = 0;
  /// The identity's skeleton and skin weights, in its own unit, place and pose.
  virtual SkinnedSkeleton skeleton(const BodyBinding& identity) const = 0;
  /// [J] How the joints move to the pose's angles: blended by all skin weights, these give what pose() does.
  virtual std::vector<Affine> motions(const BodyBinding& identity, const BodyRead& pose) const = 0;
};

/// Opens a reader's weights. `threads` 0: as many as the process may use.
using MakeBodyMethod = std::shared_ptr<const BodyMethod> (*)(const std::filesystem::path& reader, int threads);

/// How a transfer was made, and how sure it is.
struct TransferReport {
  Method method = Method::network;  ///< body or network
  bool read = false;                ///< whether both meshes were read as bodies
  double identity_confidence = 0, pose_confidence = 0;
  std::string identity_notes, pose_notes;

  double confidence() const { return identity_confidence < pose_confidence ? identity_confidence : pose_confidence; }
};

}  // namespace npt::inline NPT_ABI
