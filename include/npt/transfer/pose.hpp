/// A pose that many characters take: what depends on its mesh alone, computed once.
///   npt::Pose pose = transfer.pose(mesh);
/// Threads   any number may use one at a time
#pragma once

#include <npt/config.hpp>
#include <npt/estimate/joint_pose.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/transfer/character.hpp>
#include <npt/transfer/network_state.hpp>
#include <npt/transfer/warning.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

template <class Exec>
class BasicPoseTransfer;
template <class Exec>
class PoseTracker;

NPT_INLINE_CLASS(class, Pose);
template <class>
class BasicPose {
 public:
  /// Whether there is a pose in it.
  bool prepared() const noexcept { return own_.owner != nullptr; }
  /// Of the weights that recognised it, or that take it: "human"; empty where the weights name none.
  const std::string& domain() const noexcept { return own_.domain_name; }
  /// Whether its confidence is high enough for body estimation.
  bool recognised() const noexcept { return own_.recognised; }
  /// What it is recognised as: "person", "four-legged animal"; empty where it isn't. As long as the program runs.
  std::string_view kind() const noexcept { return own_.recognised_kind(); }
  /// Errors    npt::Error (not_recognised) that says how low the confidence is, where it isn't recognised
  void expect_recognised() const { own_.expect_recognised(); }
  /// That it is of the domain, and that its pose was estimated rightly: 0 to 1; none where no body was estimated.
  std::optional<double> confidence() const {
    return own_.estimate == nullptr ? std::nullopt : std::optional(own_.estimate->confidence);
  }
  /// What a user should know of it.
  const Warnings& warnings() const noexcept { return own_.recognised ? own_.by_body : own_.by_network; }
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

  transfer::internal::Prepared own_;
  NetworkPose network_;
  /// The mesh, where it isn't encoded: it is when the network is asked.
  std::vector<float> xyz_;
  std::vector<Triangle> triangles_;
};

}  // namespace npt::inline NPT_ABI
