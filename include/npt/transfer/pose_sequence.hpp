/// The frames of sequences, one after another: points are chosen on a sequence's first frame and kept for all that
/// follow. A mesh with other faces or another vertex count is the first frame of another sequence.
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/transfer/pose_transfer.hpp>
#include <npt/transfer/prepared.hpp>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

namespace npt::inline NPT_ABI {

/// Prepares poses that come frame by frame. Those that go through bodies are followed from the first one: where another
/// mesh with the same triangles reads better, such as a rig at rest, prepare that one first and leave its pose.
/// Threads   one at a time; PoseTransfer::choose_points and prepare_pose serve several
/// Memory    a frame of a known sequence allocates nothing
/// Requires  that the transfer outlives it
template <class Exec>
class PoseSequence {
 public:
  explicit PoseSequence(const BasicPoseTransfer<Exec>& transfer) : transfer_(&transfer) {}

  /// Encodes a frame for identities of so many vertices.
  /// Errors    those of PoseTransfer::prepare_pose
  void prepare(const MeshView& frame, std::size_t identity_vertices, PreparedPose& prepared) {
    const bool next = continues(frame, identity_vertices);
    if (!next) {
      transfer_->choose_points(frame, identity_vertices, choice_);
      triangles_.assign(frame.triangles.begin(), frame.triangles.end());
      identity_vertices_ = identity_vertices;
    }
    transfer_->prepare_pose(frame, choice_, prepared, next ? last_.get() : nullptr);
    last_ = prepared.shared_body();
  }

  /// Makes the next mesh the first frame of another sequence.
  void restart() { choice_ = {}, last_.reset(); }

 private:
  bool continues(const MeshView& frame, std::size_t identity_vertices) const {
    return choice_.vertex_count() == frame.vertex_count() &&
           (identity_vertices_ == identity_vertices || !transfer_->pairs_vertices()) &&
           std::equal(triangles_.begin(), triangles_.end(), frame.triangles.begin(), frame.triangles.end());
  }

  const BasicPoseTransfer<Exec>* transfer_;
  PoseChoice choice_;
  std::shared_ptr<const BodyRead> last_;  ///< how the last frame was read as a body
  std::vector<Triangle> triangles_;
  std::size_t identity_vertices_ = 0;
};

}  // namespace npt::inline NPT_ABI
