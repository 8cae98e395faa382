/// What a transfer needs of one mesh, computed once: identities that take many poses, poses that many identities take.
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/vertex_order.hpp>
#include <npt/nn/engine/workspace.hpp>
#include <npt/transfer/body_interface.hpp>
#include <npt/transfer/options.hpp>
#include <npt/transfer/pose_points.hpp>
#include <npt/transfer/unit.hpp>

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

template <class Exec>
class BasicPoseTransfer;
template <class Exec>
class NetworkTransfer;

/// An identity mesh as the network sees it, and the way back. Made by PoseTransfer::prepare_identity, for that
/// transfer.
class PreparedIdentity {
 public:
  /// V, of the mesh and of results; 0: nothing prepared yet.
  std::size_t vertex_count() const noexcept { return vertices_; }
  /// Metres in one unit of the mesh's coordinates, where the weights ask for one; else 1.
  double unit() const noexcept { return unit_; }
  /// How it reads as a body; nullptr where the transfer has no way through bodies.
  const BodyRead* body() const noexcept { return body_.get(); }

 private:
  template <class>
  friend class BasicPoseTransfer;
  template <class>
  friend class NetworkTransfer;

  std::size_t vertices_ = 0;
  double unit_ = 1;
  NormalisingTransform transform_;
  std::vector<float> coordinates_;    ///< [V, 3] normalised, in the network's order
  std::vector<float> mirrored_;       ///< [V, 3] their mirror image, where asked for
  std::vector<std::uint32_t> place_;  ///< [V] the network's vertex whose result each vertex takes; empty: its own
  std::unique_ptr<const Refinement> refinement_;
  std::shared_ptr<const BodyRead> body_;
  std::shared_ptr<const BodyBinding> binding_;  ///< where it may be taken
  std::exception_ptr not_for_network_;          ///< why the network can't have it, where it can't
  /// The mesh as it came, where a result is held against it.
  std::vector<float> xyz_;
  std::vector<Triangle> triangles_;
};

/// The choice of points for the frames of a sequence: made on its first frame, and kept, so that nothing flickers. Made
/// by PoseTransfer::choose_points.
class PoseChoice {
 public:
  /// V of the meshes that it is for; 0: nothing chosen yet.
  std::size_t vertex_count() const noexcept { return pairings_.empty() ? 0 : pairings_.front().vertices; }
  /// The points of each pairing.
  const std::vector<PosePoints>& pairings() const noexcept { return pairings_; }

 private:
  template <class>
  friend class BasicPoseTransfer;
  template <class>
  friend class NetworkTransfer;
  std::vector<PosePoints> pairings_;
};

/// An encoded pose mesh. Made by PoseTransfer::prepare_pose, for that transfer.
class PreparedPose {
 public:
  /// Vertices of the identities that it is for; 0: any.
  std::size_t identity_vertices() const noexcept { return count_; }
  /// Whether there is a pose in it.
  bool encoded() const noexcept { return !codes_.empty() || body_ != nullptr; }
  /// How it reads as a body; nullptr where the transfer has no way through bodies.
  const BodyRead* body() const noexcept { return body_.get(); }
  /// To go on from with the next frame of a sequence.
  std::shared_ptr<const BodyRead> shared_body() const noexcept { return body_; }

 private:
  template <class>
  friend class BasicPoseTransfer;
  template <class>
  friend class NetworkTransfer;
  std::size_t count_ = 0;
  std::vector<PoseCode<float>> codes_;  ///< by pairing; then those of the mirror images
  std::shared_ptr<const BodyRead> body_;
  /// The mesh, where it reads so well that the network will hardly be asked: it is encoded when it is.
  std::vector<float> xyz_;
  std::vector<Triangle> triangles_;
};

namespace internal {

/// Everything about a mesh that a transfer can't take.
/// Errors    npt::Error for no vertices, all vertices in one point (NaN counts as different), and triangles of other
///           vertices
NPT_INLINE void expect_transferable(const MeshView& mesh) {
  const std::string_view name = mesh.name;
  expect_points(mesh.xyz, name);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t corner : mesh.triangles[t])
      if (corner >= mesh.vertex_count())
        throw Error({.file = std::string(name),
                     .place = "triangle " + std::to_string(t),
                     .found = "vertex " + std::to_string(corner),
                     .expected = "a number below " + std::to_string(mesh.vertex_count())});
  for (std::size_t i = 3; i < mesh.xyz.size(); ++i)
    if (!(mesh.xyz[i] == mesh.xyz[i % 3])) return;
  throw Error({.file = std::string(name), .found = "all vertices in one point", .expected = "a mesh with an extent"});
}

/// A mesh with the name of what it is used for, where it has none.
inline MeshView named(MeshView mesh, std::string_view name) {
  if (mesh.name.empty()) mesh.name = name;
  return mesh;
}

/// Whether two views are of the same mesh in the same place.
inline bool same_memory(const MeshView& a, const MeshView& b) {
  return a.xyz.data() == b.xyz.data() && a.xyz.size() == b.xyz.size() && a.triangles.data() == b.triangles.data() &&
         a.triangles.size() == b.triangles.size();
}

/// Errors    npt::Error for a result of another size
NPT_INLINE void expect_result(std::size_t found, std::size_t expected) {
  if (found != expected)
    throw Error({.file = "result",
                 .found = std::to_string(found) + " numbers",
                 .expected = std::to_string(expected) + ", three for each of the identity's vertices"});
}

/// x to -x.
NPT_INLINE void mirror(std::span<const float> xyz, std::vector<float>& mirrored) {
  mirrored.resize(xyz.size());
  for (std::size_t i = 0; i < xyz.size(); ++i) mirrored[i] = i % 3 == 0 ? -xyz[i] : xyz[i];
}

}  // namespace internal

}  // namespace npt::inline NPT_ABI
