/// A skeleton in a pose that is being changed: joints are turned in the world's directions, and what is attached to
/// them follows at once.
///   PosedJoints pose(motion, follows, bound);
///   pose.set(places);
///   pose.turn(shoulder, turn_between(arm, wanted));
/// Feet that a rig moves apart from their legs follow these.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/feet_apart.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

class PosedJoints {
 public:
  /// Keeps a reference. bound: [joints] where the skin was bound
  PosedJoints(const Motion& motion, const std::vector<FootApart>& follows, const std::vector<Affine>& bound)
      : motion_(motion), base_turn_(place_of(motion.base).rotation), behind_(motion.joints.size()) {
    // A joint's descendants stand right behind it.
    for (std::size_t j = behind_.size(); j-- > 0;) {
      behind_[j] = std::max(behind_[j], j + 1);
      if (const std::size_t parent = motion.joints[j].parent; parent != no_item)
        behind_[parent] = std::max(behind_[parent], behind_[j]);
    }
    for (const auto& [foot, knee] : follows) follows_.push_back({foot, knee, inverse(bound[knee])(bound[foot].shift)});
  }

  void set(const std::vector<NodePlace>& places) {
    places_ = places;
    worlds_.resize(places.size());
    turns_.resize(places.size());
    update(0, places.size());
  }

  const std::vector<NodePlace>& places() const { return places_; }
  const std::vector<Affine>& worlds() const { return worlds_; }
  const Affine& world(std::size_t joint) const { return worlds_[joint]; }
  Vec3d position(std::size_t joint) const { return worlds_[joint].shift; }
  const Quaternion& rotation(std::size_t joint) const { return turns_[joint]; }

  void rotate(std::size_t joint, const Quaternion& world_rotation) {
    places_[joint].rotation = normalised(inverse(above(joint)) * world_rotation);
    update(joint, behind_[joint]);
    for (const Follower& follower : follows_)
      if (follower.knee >= joint && follower.knee < behind_[joint])
        place(follower.foot, worlds_[follower.knee](follower.ankle));
  }
  /// A turn about the joint, in the world's directions.
  void turn(std::size_t joint, const Quaternion& by) { rotate(joint, by * turns_[joint]); }

  void place(std::size_t joint, Vec3d position) {
    places_[joint].translation = inverse(outer(joint))(position);
    update(joint, behind_[joint]);
    for (const Follower& follower : follows_)
      if (follower.foot != joint && follower.knee >= joint && follower.knee < behind_[joint])
        place(follower.foot, worlds_[follower.knee](follower.ankle));
  }
  void move(std::size_t joint, Vec3d way) { place(joint, position(joint) + way); }

  bool is_below(std::size_t joint, std::size_t above) const { return joint >= above && joint < behind_[above]; }

 private:
  struct Follower {
    std::size_t foot, knee;
    Vec3d ankle;  ///< in the knee's coordinates
  };

  const Affine& outer(std::size_t joint) const {
    const std::size_t parent = motion_.joints[joint].parent;
    return parent == no_item ? motion_.base : worlds_[parent];
  }
  const Quaternion& above(std::size_t joint) const {
    const std::size_t parent = motion_.joints[joint].parent;
    return parent == no_item ? base_turn_ : turns_[parent];
  }
  void update(std::size_t first, std::size_t last) {
    for (std::size_t j = first; j < last; ++j) {
      turns_[j] = above(j) * places_[j].rotation;
      worlds_[j] = outer(j) * places_[j].affine();
    }
  }

  const Motion& motion_;
  Quaternion base_turn_;
  std::vector<std::size_t> behind_;  ///< [joints] the first joint that isn't below
  std::vector<Follower> follows_;
  std::vector<NodePlace> places_;
  std::vector<Affine> worlds_;
  std::vector<Quaternion> turns_;
};

}  // namespace internal

}  // namespace npt::inline NPT_ABI
