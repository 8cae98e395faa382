/// What the pose transfer network needs of one mesh, computed once. Part of a Character and of a Pose.
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/resample.hpp>
#include <npt/nn/engine/encoded_input.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

template <class Exec>
class NetworkTransfer;
template <class Exec>
class BasicPoseTransfer;

/// An identity mesh as the network sees it, and the way back.
struct NetworkIdentity {
  std::size_t vertices = 0;  ///< V; 0: nothing prepared
  double unit = 1;           ///< metres in one unit of the mesh's coordinates, where the weights ask for one
  NormalisingTransform transform;
  std::vector<float> coordinates;    ///< [V, 3] normalised, in the network's order
  std::vector<float> mirrored;       ///< [V, 3] their mirror image, where asked for
  std::vector<std::uint32_t> place;  ///< [V] the network's vertex whose result each vertex takes; empty: its own
};

/// The points of one pairing on meshes of one vertex count: the vertices in their own order or another one, or points
/// of the surface.
struct PosePoints {
  std::size_t vertices = 0;           ///< V of the pose mesh
  std::vector<std::uint32_t> order;   ///< [V] or empty
  std::vector<SurfacePoint> surface;  ///< [count] or empty

  std::size_t count() const noexcept { return surface.empty() ? vertices : surface.size(); }
};

/// The choice of points for the frames of a sequence: made on its first frame, and kept, so that nothing flickers. Made
/// by PoseTransfer::choose_points.
class PoseChoice {
 public:
  /// V of the meshes that it is for; 0: nothing chosen yet.
  std::size_t vertex_count() const noexcept { return pairings_.empty() ? 0 : pairings_.front().vertices; }
  /// The points of each pairing; of the first weights file's network, where a transfer has several.
  const std::vector<PosePoints>& pairings() const noexcept { return pairings_; }

 private:
  template <class>
  friend class NetworkTransfer;
  template <class>
  friend class BasicPoseTransfer;
  std::vector<PosePoints> pairings_;
  std::vector<PoseChoice> others_;  ///< of the further domains' networks
};

/// An encoded pose mesh.
struct NetworkPose {
  std::size_t count = 0;                   ///< vertices of the identities that it is for; 0: any
  std::vector<EncodedInput<float>> codes;  ///< by pairing; then those of the mirror images; empty: not encoded
};

namespace internal {

/// x to -x.
NPT_INLINE void mirror(std::span<const float> xyz, std::vector<float>& mirrored) {
  mirrored.resize(xyz.size());
  for (std::size_t i = 0; i < xyz.size(); ++i) mirrored[i] = i % 3 == 0 ? -xyz[i] : xyz[i];
}

}  // namespace internal

}  // namespace npt::inline NPT_ABI
