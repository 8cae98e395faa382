/// A sequence of poses on one character, and the moving scene that it becomes.
///   npt::ClipFrames frames(npt::read_scene("walker.glb"), "walker.glb", {.clip = "walk"});
///   npt::Animation animation = npt::animate(transfer, hero, npt::frame_source(frames));
///   npt::write_scene("result.glb", npt::animation_scene(identity, "hero", animation, "walk", frames.times()));
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/control.hpp>
#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/joint_names.hpp>
#include <npt/body/joint_pose.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/scene/animate.hpp>
#include <npt/scene/clip_frames.hpp>
#include <npt/scene/from_mesh.hpp>
#include <npt/scene/scene.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/transfer/character.hpp>
#include <npt/transfer/named_skeleton.hpp>
#include <npt/transfer/pose_tracker.hpp>
#include <npt/transfer/pose_transfer_class.hpp>
#include <npt/transfer/result.hpp>
#include <npt/transfer/root_trajectory.hpp>

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A character through a sequence.
struct Animation {
  std::vector<std::vector<float>> positions;  ///< [frames][V, 3]
  /// What moves it, where every frame was made by body estimation: [frames][J] motions of the skeleton's joints.
  std::optional<SkinnedSkeleton> skeleton;
  std::vector<std::vector<Affine>> motions;
  TransferReport report;                  ///< of the frame with the lowest confidence
  std::size_t weakest = 0;                ///< that frame
  std::optional<double> pose_confidence;  ///< of its pose alone; none where no body was estimated
};

/// Makes an Animation frame by frame.
/// Threads   one at a time
/// Requires  that transfer and character outlive it
template <class Exec = DefaultExecutor>
class Animator {
 public:
  Animator(const BasicPoseTransfer<Exec>& transfer, const Character& character, JointNames names = JointNames::vrm)
      : transfer_(&transfer), character_(&character), tracker_(transfer) {
    animation_.skeleton = named_skeleton(character, names);
  }

  /// The first frame, followed from the best of it and of `count` others: PoseTracker::start.
  TransferReport start(const Mesh& first, std::string_view name, std::size_t count,
                       const std::function<Mesh(std::size_t)>& other) {
    return take(tracker_.start(first, name, character_->vertex_count(), count, other));
  }
  /// The next frame.
  TransferReport add(const MeshView& frame) { return take(tracker_.next(frame, character_->vertex_count())); }

  const Animation& animation() const noexcept { return animation_; }

  /// The animation; follow_root: along the poses' root trajectory, in proportion to the character's legs, where every
  /// frame was made by body estimation. Without it the root joint of all frames is in one place.
  Animation finish(bool follow_root = true) {
    if (follow_root) move_root();
    return std::move(animation_);
  }

 private:
  TransferReport take(const Pose& pose) {
    Animation& a = animation_;
    std::vector<float>& xyz = a.positions.emplace_back(3 * character_->vertex_count());
    const TransferReport report = transfer_->apply(*character_, pose, xyz);
    if (a.positions.size() == 1 || report.confidence < a.report.confidence)
      a.report = report, a.weakest = a.positions.size() - 1, a.pose_confidence = pose.confidence();
    if (report.method != Method::body) a.skeleton.reset(), a.motions.clear();
    if (a.skeleton) a.motions.push_back(*transfer_->motions(*character_, pose));
    if (report.method == Method::body) poses_.push_back(*pose.joints());
    return report;
  }

  void move_root() {
    Animation& a = animation_;
    if (poses_.empty() || poses_.size() != a.positions.size()) return;
    std::vector<double> lowest;
    for (const std::vector<float>& xyz : a.positions) lowest.push_back(bounding_box(xyz).low.y);
    const std::vector<Vec3d> trajectory =
        root_trajectory(character_->joints()->leg, poses_, lowest, bounding_box(character_->positions()).low.y);
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
      move_points(a.positions[i], trajectory[i]);
      if (a.skeleton)
        for (Affine& motion : a.motions[i]) motion.shift += trajectory[i];
    }
  }

  const BasicPoseTransfer<Exec>* transfer_;
  const Character* character_;
  PoseTracker<Exec> tracker_;
  Animation animation_;
  std::vector<JointPose> poses_;
};

/// Where the frames of a sequence come from.
struct FrameSource {
  std::size_t count = 0;
  std::function<const Mesh&(std::size_t)> frame{};  ///< i < count; valid until the next call
  std::function<std::string(std::size_t)> name{};   ///< of a frame's mesh in messages; empty: "pose"
  std::size_t other_count = 0;                      ///< meshes with the same triangles: a rig at rest, further frames
  std::function<Mesh(std::size_t)> other{};         ///< k < other_count
};

/// The frames of a clip, with its scene at rest among the meshes to begin from. frames must outlive the source
NPT_INLINE FrameSource frame_source(ClipFrames& frames) {
  const std::size_t count = frames.size();
  return {.count = count,
          .frame = [&frames](std::size_t i) -> const Mesh& { return frames.frame(i); },
          .other_count = 1 + frames_to_try(count),
          .other = [&frames, count](std::size_t k) -> Mesh {
            return k == 0 ? frames.at_rest() : frames.frame(frame_to_try(k, count));
          }};
}

/// A sequence on a character.
/// Errors    those of PoseTransfer::apply; npt::Error (ErrorCode::stopped) where the caller asked to stop
template <class Exec>
Animation animate(const BasicPoseTransfer<Exec>& transfer, const Character& character, const FrameSource& frames,
                  bool follow_root = true, JointNames names = JointNames::vrm, const Control& control = {}) {
  Animator<Exec> animator(transfer, character, names);
  for (std::size_t i = 0; i < frames.count; ++i) {
    control.step(static_cast<double>(i) / static_cast<double>(frames.count));
    const Mesh& mesh = frames.frame(i);
    const std::string name = frames.name ? frames.name(i) : std::string("pose");
    if (i == 0) {
      const Mesh first = mesh;  // frames.other may use its memory
      animator.start(first, name, frames.other_count, frames.other);
      continue;
    }
    const std::vector<Triangle> triangles = triangulate(mesh);
    animator.add({mesh.coordinates(), triangles, name});
  }
  control.step(1);
  return animator.finish(follow_root);
}

/// The mesh with all positions multiplied.
NPT_INLINE Mesh scaled(Mesh mesh, double factor) {
  if (factor == 1) return mesh;
  for (float& x : mesh.coordinates()) x = static_cast<float>(static_cast<double>(x) * factor);
  return mesh;
}

/// Metres in a unit of a result that is written to a file in metres, such as GLB: the mesh's, as given or inferred from
/// its size; 1 where its own file says metres, and where its size tells no unit.
template <class Exec>
double output_unit(const BasicPoseTransfer<Exec>& transfer, const MeshView& identity, bool in_metres) {
  if (in_metres) return 1;
  if (transfer.options().import.unit) return *transfer.options().import.unit;
  try {
    return transfer.unit_of(identity);
  } catch (const Error&) {  // no person's size
    return 1;
  }
}

/// The same for a character, of which floors and the like don't count.
template <class Exec>
double output_unit(const BasicPoseTransfer<Exec>& transfer, const Character& character, bool in_metres) {
  if (in_metres) return 1;
  return transfer.options().import.unit.value_or(character.unit());
}

/// A scene in which the identity moves: on its skeleton, or as morph targets where there is none.
/// name: of the mesh; times: [frames] in seconds; unit: metres in one unit of the identity
NPT_INLINE Scene animation_scene(const Mesh& identity, const std::string& name, const Animation& animation,
                                 const std::string& clip, std::span<const double> times, double unit = 1) {
  const Mesh mesh = scaled(identity, unit);
  MeshScene made = scene_from(mesh, name);
  if (animation.skeleton) {
    SkinnedSkeleton skeleton = *animation.skeleton;
    for (Vec3d& joint : skeleton.joints) joint = joint * unit;
    std::vector<std::vector<Affine>> motions = animation.motions;
    for (auto& of_frame : motions)
      for (Affine& motion : of_frame) motion.shift = motion.shift * unit;
    const std::size_t first = add_skeleton(made, skeleton);
    add_skeleton_clip(made, skeleton, first, clip, times, motions);
  } else {
    std::vector<std::vector<float>> positions = animation.positions;
    for (std::vector<float>& xyz : positions)
      for (float& x : xyz) x = unit == 1 ? x : static_cast<float>(static_cast<double>(x) * unit);
    add_morph_clip(made, mesh, clip, times, positions);
  }
  return std::move(made.scene);
}

}  // namespace npt::inline NPT_ABI
