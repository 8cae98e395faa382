/// A pose that many characters take: what depends on its mesh alone, computed once.
///   npt::Pose pose = transfer.pose(mesh);
/// Threads   any number may use one at a time
#pragma once

#include <npt/body/joint_pose.hpp>
#include <npt/config.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/transfer/character.hpp>
#include <npt/transfer/network_state.hpp>

#include <cstddef>
#include <optional>
#include <vector>

namespace npt::inline NPT_ABI {

template <class Exec>
class BasicPoseTransfer;
template <class Exec>
class PoseTracker;

NPT_INLINE_CLASS(class, Pose);
template <class>
class BasicPose : public Recognition {
 public:
  /// Whether there is a pose in it.
  bool prepared() const noexcept { return own_.owner != nullptr; }
  /// Its joints, where it is recognised.
  std::optional<JointPose> joints() const {
    if (!own_.recognised) return std::nullopt;
    return own_.body->joints(*own_.estimate);
  }
  /// Vertices of the characters that it was encoded for; 0: any.
  std::size_t identity_vertices() const noexcept { return network_.count; }

 private:
  template <class>
  friend class BasicPoseTransfer;
  template <class>
  friend class PoseTracker;

  NetworkPose network_;
  /// The mesh, where it isn't encoded: it is when the network is asked.
  std::vector<float> xyz_;
  std::vector<Triangle> triangles_;
};

}  // namespace npt::inline NPT_ABI
