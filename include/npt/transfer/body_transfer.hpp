/// Pose transfer between characters, by bodies: a network reads where each point of a mesh belongs on a resting body,
/// the body with proportions is fitted to points and places, the identity is bound to it, and linear blend skinning
/// gives it the pose mesh's joint angles. No mesh needs to rest, to be one piece, or to be of any unit.
///   const npt::BodyTransfer transfer(npt::CorrespondenceEstimator::open("reader.safetensors"));
///   npt::BoundCharacter character = transfer.bind(identity);        once an identity
///   npt::BodyEstimate reading = transfer.read(pose);                 once a pose
///   transfer.pose(character, reading, result);                      [V, 3]
/// The identity's root joint stays in its place.
/// Shapes    meshes: [V, 3] floats with triangles; result: as the identity
/// Threads   all members are const and may be called by any number of threads at a time
/// Numerics  the same bits for any number of threads
/// Errors    npt::Error for a mesh without triangles that have an area, and for coordinates that are not finite
/// Source    skinning as Wang et al., CVPR 2020, supplement C.1; reading and fit: docs/transfer.md
#pragma once

#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/joint_names.hpp>
#include <npt/body/mannequin/finger_joints.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/body_estimator.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/scene/affine.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/skin/body_weights.hpp>
#include <npt/skin/bound_character.hpp>
#include <npt/transfer/body_interface.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

template <class Exec = DefaultExecutor>
class BasicBodyTransfer {
 public:
  explicit BasicBodyTransfer(BasicCorrespondenceEstimator<Exec> reader, BodyEstimatorOptions options = {})
      : reader_(std::move(reader), std::move(options)) {}

  /// SMPL's 24 joints: what is fitted.
  const BodyModel& body() const noexcept { return reader_.body(); }
  /// With finger joints, 40: what characters are bound to.
  const BodyModel& fingered_body() const noexcept { return reader_.fingered_body(); }

  /// How a body lies in a mesh.
  BodyEstimate read(const MeshView& mesh) const { return reader_.read(mesh); }
  /// The next frame of a sequence, from the last one's reading.
  BodyEstimate follow(const MeshView& mesh, const BodyEstimate& last) const { return reader_.follow(mesh, last); }

  /// Of a mesh in which a body lies.
  JointPose joints(const BodyEstimate& reading) const {
    expect_body(reading, "mesh");
    const BodyFit& fit = reading.fit.body;
    const std::vector<Vec3d> rest = body().joints(fit.betas);
    double legs = 0;  // joints 1, 4, 7 are the left hip, knee and ankle, 2, 5, 8 the right ones
    for (const std::size_t hip : {std::size_t{1}, std::size_t{2}})
      legs += length(rest[hip + 3] - rest[hip]) + length(rest[hip + 6] - rest[hip + 3]);
    return {fit.axis_angles, (rest[0] + fit.translation) / reading.metres + reading.centre,
            0.5 * legs / reading.metres};
  }

  BoundCharacter bind(const MeshView& identity) const { return bind(identity, read(identity)); }
  BoundCharacter bind(const MeshView& identity, BodyEstimate reading) const {
    BoundCharacter character;
    character.reading = std::move(reading);
    const BodyEstimate& r = character.reading;
    expect_body(r, identity.name);
    character.body = r.fit.body;
    character.body.axis_angles = with_fingers(r.fit.body.axis_angles, r.hands);
    character.points = r.points_of(identity);
    const auto closed = [&r](std::size_t side) { return std::ranges::max(r.hands[side].middle) > least_closed; };
    std::array<skeleton::internal::HandMeasure, 2> measured;
    character.weights = body_weights(fingered_body(), character.body, character.points, identity.triangles,
                                     {.facing = r.fit.facing, .closed = {closed(0), closed(1)}}, &measured);
    const std::vector<Vec3d> rest = fingered_body().joints(r.fit.body.betas);
    const auto motions = fingered_body().bone_motions(r.fit.body.betas, character.body.axis_angles);
    for (std::size_t j = 0; j < rest.size(); ++j)
      character.joints.push_back(motions[j](rest[j]) + r.fit.body.translation);
    character.hands = measured_hands(r, measured, character.joints);
    character.fingers = {measured[0].fingers, measured[1].fingers};
    character.body.axis_angles = with_fingers(r.fit.body.axis_angles, character.hands);
    return character;
  }

  /// An identity's skeleton and skin weights, in its own unit, place and pose. Joints have their usual humanoid names.
  SkinnedSkeleton skeleton(const BoundCharacter& identity, JointNames names = JointNames::vrm) const {
    SkinnedSkeleton skeleton;
    for (std::size_t j = 0; j < identity.joints.size(); ++j) {
      const int parent = fingered_body().tables().parents[j];
      skeleton.names.emplace_back(joint_name(j, names));
      skeleton.parents.push_back(parent < 0 ? SkinnedSkeleton::no_parent : static_cast<std::size_t>(parent));
      skeleton.joints.push_back(identity.joints[j] / identity.reading.metres + identity.reading.centre);
    }
    const SparseMatrix& weights = identity.weights;
    skeleton.start.assign(weights.start.begin(), weights.start.end());
    for (std::size_t i = 0; i < weights.value.size(); ++i)
      skeleton.influences.push_back({static_cast<std::uint16_t>(weights.column[i]), weights.value[i]});
    return skeleton;
  }

  /// [J] How the identity's joints move to the pose's angles, in its own unit and place.
  std::vector<Affine> motions(const BoundCharacter& identity, const BodyEstimate& pose) const {
    expect_body(pose, "pose");
    return motions(identity, identity.angles(pose.fit.body.axis_angles, pose));
  }
  /// [J] How the identity's joints move to joint angles [40, 3], in its own unit and place.
  std::vector<Affine> motions(const BoundCharacter& identity, std::span<const float> axis_angles) const {
    std::vector<Affine> result;
    for (const RigidMotion& m : identity.motions(fingered_body(), axis_angles)) {
      const Vec3d centre = identity.reading.centre;
      result.push_back({m.rotation, m.shift / identity.reading.metres + centre - m.rotation * centre});
    }
    return result;
  }

  /// The identity's vertices with the pose's joint angles, in its own unit and place.
  void pose(const BoundCharacter& identity, const BodyEstimate& pose, std::span<float> result) const {
    expect_body(pose, "pose");
    this->pose(identity, identity.angles(pose.fit.body.axis_angles, pose), result);
  }
  /// The identity's vertices with joint angles [40, 3], in its own unit and place.
  void pose(const BoundCharacter& identity, std::span<const float> axis_angles, std::span<float> result) const {
    if (result.size() != 3 * identity.points.size())
      throw Error({.file = "result",
                   .found = std::to_string(result.size()) + " numbers",
                   .expected = "three for each of " + std::to_string(identity.points.size()) + " vertices"});
    const std::vector<RigidMotion> motions = identity.motions(fingered_body(), axis_angles);
    for (std::size_t v = 0; v < identity.points.size(); ++v) {
      const Vec3f p = (identity.moved(v, motions) / identity.reading.metres + identity.reading.centre).as<float>();
      result[3 * v] = p.x, result[3 * v + 1] = p.y, result[3 * v + 2] = p.z;
    }
  }

 private:
  /// Radians of the middle joints beyond which fingers may touch the palm.
  static constexpr double least_closed = 0.8;

  /// How far the hands are closed after the fingers of closed ones were measured; their joints' places, too.
  static std::array<HandBend, 2> measured_hands(const BodyEstimate& reading,
                                                const std::array<skeleton::internal::HandMeasure, 2>& measured,
                                                std::span<Vec3d> joints) {
    // Radians that no finger bends: then it was measured wrongly.
    constexpr double least = -0.4, most = 2.1;
    std::array<HandBend, 2> hands = reading.hands;
    for (std::size_t side = 0; side < 2; ++side)
      for (std::size_t f = 0; f < finger_count; ++f) {
        const skeleton::internal::FingerMeasure& finger = measured[side].closed[f];
        for (std::size_t k = 0; k < 2; ++k)
          if (finger.joints[k]) joints[middle_finger_joint(side, f) + k] = *finger.joints[k];
        const double middle = hands[side].middle[f] + finger.turns[0];
        const double end = hands[side].middle[f] * 2 / 3 + finger.turns[1] - finger.turns[0];
        if (std::min(middle, end) < least || std::max(middle, end) > most) continue;
        hands[side].middle[f] = middle;
        hands[side].end[f] = end - middle * 2 / 3;
      }
    return hands;
  }

  BasicBodyEstimator<Exec> reader_;
};

using BodyTransfer = BasicBodyTransfer<>;

}  // namespace npt::inline NPT_ABI
