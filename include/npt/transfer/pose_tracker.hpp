/// The poses of a sequence, frame after frame: bodies are followed from frame to frame, and the network's random points
/// are chosen once, so that nothing flickers.
///   npt::PoseTracker tracker(transfer);
///   for (const npt::MeshView& frame : frames) transfer.apply(hero, tracker.next(frame, hero.vertex_count()), result);
/// A mesh with other faces or another vertex count is the first frame of another sequence.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/transfer/network_state.hpp>
#include <npt/transfer/pose.hpp>
#include <npt/transfer/pose_transfer_class.hpp>
#ifndef NPT_COMPILED
#include <npt/transfer/pose_transfer.hpp>
#endif

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Threads   one at a time
/// Memory    a frame of a known sequence allocates nothing where the network takes it
/// Requires  that the transfer outlives it
template <class Exec = DefaultExecutor>
class PoseTracker {
 public:
  explicit PoseTracker(const BasicPoseTransfer<Exec>& transfer) : transfer_(&transfer) {}

  /// The next frame's pose, for characters of so many vertices. Valid until the next call.
  /// Errors    those of PoseTransfer::pose
  const Pose& next(const MeshView& frame, std::size_t identity_vertices) {
    const bool follows = continues(frame, identity_vertices);
    if (!follows) begin(frame, identity_vertices);
    transfer_->prepare(frame, choice_, other_, follows ? &pose_ : nullptr);
    std::swap(pose_, other_);
    return pose_;
  }

  /// The first frame of a sequence of which other meshes with the same triangles are known, such as its further frames
  /// or a rig at rest: where the first one isn't recognised with high confidence, the sequence is followed from that of
  /// up to `count` others that is recognised best. load(k), k < count: one of them; its npt::Error is left to whoever
  /// comes to that frame. An astronaut's walk ends at 29e-4 from its rest pose, and from its first frame, which is
  /// estimated the wrong way round, at 2800e-4.
  const Pose& start(const Mesh& first, std::string_view name, std::size_t identity_vertices, std::size_t count,
                    const std::function<Mesh(std::size_t)>& load) {
    restart();
    next_mesh(first, identity_vertices, name);
    const double high = transfer_->options().body.high_confidence;
    if (!pose_.confidence() || *pose_.confidence() >= high) return pose_;
    // Less is no reason to begin elsewhere.
    constexpr double better = 0.03;
    double most = *pose_.confidence() + better;
    std::optional<Mesh> best;
    for (std::size_t k = 0; k < count && most < high; ++k) {
      try {
        Mesh mesh = load(k);
        if (mesh.vertex_count() != first.vertex_count()) continue;
        const Pose tried = transfer_->pose(mesh, identity_vertices);
        if (!tried.confidence() || *tried.confidence() <= most) continue;
        most = *tried.confidence();
        best = std::move(mesh);
      } catch (const Error& error) {
        if (error.code() == ErrorCode::stopped) throw;
      }
    }
    if (best) {
      restart();
      next_mesh(*best, identity_vertices, name);
      next_mesh(first, identity_vertices, name);
    }
    return pose_;
  }

  /// Makes the next mesh the first frame of another sequence.
  void restart() { choice_ = {}, pose_ = {}; }

 private:
  void begin(const MeshView& frame, std::size_t identity_vertices) {
    transfer_->choose_points(frame, identity_vertices, choice_);
    triangles_.assign(frame.triangles.begin(), frame.triangles.end());
    identity_vertices_ = identity_vertices;
  }
  void next_mesh(const Mesh& mesh, std::size_t identity_vertices, std::string_view name) {
    const std::vector<Triangle> triangles = triangulate(mesh);
    next({mesh.coordinates(), triangles, name}, identity_vertices);
  }
  bool continues(const MeshView& frame, std::size_t identity_vertices) const {
    return choice_.vertex_count() == frame.vertex_count() &&
           (identity_vertices_ == identity_vertices || !transfer_->pairs_vertices()) &&
           std::equal(triangles_.begin(), triangles_.end(), frame.triangles.begin(), frame.triangles.end());
  }

  const BasicPoseTransfer<Exec>* transfer_;
  PoseChoice choice_;
  Pose pose_, other_;  ///< of the last frame, and memory for the next one
  std::vector<Triangle> triangles_;
  std::size_t identity_vertices_ = 0;
};

/// How many frames of a sequence beside the first are worth a try for its start.
NPT_INLINE std::size_t frames_to_try(std::size_t frames) {
  return frames == 0 ? 0 : std::min<std::size_t>(frames - 1, 3);
}
/// Which frame that is, 0 < i <= frames_to_try(frames): spread over the sequence.
NPT_INLINE std::size_t frame_to_try(std::size_t i, std::size_t frames) {
  return frames * i / (frames_to_try(frames) + 1);
}

}  // namespace npt::inline NPT_ABI
