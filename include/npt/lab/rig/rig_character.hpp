/// A rigged character of any kind whose proportions and pose can be set: for training and judging on animals and
/// whatever else has joints.
///   const RigCharacter horse(make_rig(read_scene("horse.glb"), "horse.glb"));
///   horse.posed(proportions, pose, xyz);
/// A pose is what the joints of one rig do, identified by their names, so that any rig that has such names can take it: each
/// joint's rotation in the scene, and how far it is moved out of its place at its parent.
/// Joints    a joint that a clip moves by itself and not by its parent (a foot of an inverse-kinematics rig, which
///           is attached to the root) belongs to the joint that it stands still to
/// Shapes    frames: of each clip at frame_rate; xyz: [V, 3] in the scene's axes
/// Place     the root joint stays where it was bound
/// Numerics  in double, rounded once
/// Errors    npt::Error for rigs without a clip, clips that move no joint, joints of one name, and bones without a
///           length that a clip turns
/// Threads   all members are const
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/kinematics.hpp>
#include <npt/body/roles/joint_name.hpp>
#include <npt/config.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/lab/rig/rig_axes.hpp>
#include <npt/mesh/skinning.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Of each joint of the rig that it was taken from.
struct RigPose {
  std::vector<Matrix3> rotations;  ///< [J] in the scene, from the bind pose
  std::vector<Vec3d> offsets;      ///< [J] from its place at its parent, in the parent's axes; shares of the rig's size
};

/// Relative lengths and girths by the joints' names without side and number, so that both sides change alike.
struct RigProportions {
  struct Part {
    double length = 1, girth = 1;
  };
  std::map<std::string, Part> parts;
};

class RigCharacter {
 public:
  static constexpr double frame_rate = 15;

  explicit RigCharacter(const Rig& rig) : name_(rig.name), triangles_(rig.triangles), weights_(rig.weights) {
    if (rig.scene.clips.empty())
      throw Error({.file = name_, .found = "no clip", .expected = "clips, whose poses are trained on"});
    for (std::size_t j = 0; j < rig.joint_count(); ++j) {
      names_.push_back(rig.joint_name(j));
      if (!numbers_.emplace(names_.back(), j).second)
        throw Error({.file = name_,
                     .place = "joint '" + names_.back() + "'",
                     .found = "two joints of this name",
                     .expected = "names of their own: poses are shared by them"});
      bases_.push_back(base_of(names_.back()));
    }
    edges_ = edges_of_triangles(as_span(triangles_));
    bring_upright(rig);
    find_doubles();
    std::vector<std::vector<Moment>> moments;
    for (const Clip& clip : rig.scene.clips) moments.push_back(moments_of(rig, clip));
    find_parents(rig, moments);
    for (std::size_t c = 0; c < moments.size(); ++c) {
      clip_names_.push_back(rig.scene.clips[c].name);
      std::vector<RigPose>& frames = clips_.emplace_back();
      for (const Moment& moment : moments[c]) frames.push_back(pose_of(moment));
    }
    find_ranges();
  }

  const std::string& name() const noexcept { return name_; }
  std::size_t vertex_count() const noexcept { return positions_.size(); }
  /// The longest side of its box as bound, in the scene's unit.
  double extent() const noexcept { return extent_; }
  std::span<const Triangle> triangles() const noexcept { return triangles_; }
  std::span<const Edge> edges() const noexcept { return edges_; }
  const std::vector<std::string>& clip_names() const noexcept { return clip_names_; }
  const std::vector<std::vector<RigPose>>& clips() const noexcept { return clips_; }
  const std::map<std::string, std::size_t>& joints() const noexcept { return numbers_; }

  /// The pose of this rig's joints between two of its own.
  RigPose between(const RigPose& a, const RigPose& b, double share) const {
    RigPose result = a;
    for (std::size_t j = 0; j < a.rotations.size(); ++j) {
      result.rotations[j] = matrix_of(slerp(quaternion_of(a.rotations[j]), quaternion_of(b.rotations[j]), share));
      result.offsets[j] = a.offsets[j] + (b.offsets[j] - a.offsets[j]) * share;
    }
    return result;
  }
  /// Parts of one pose and parts of another: where limbs begin, at joints that have several after them, each takes up
  /// either pose with equal chance and keeps it to its end or to where it divides again.
  RigPose mixed(const RigPose& a, const RigPose& b, Random& random) const {
    RigPose result = a;
    std::vector<std::size_t> children(names_.size());
    for (const std::size_t parent : parents_)
      if (parent != no_item) ++children[parent];
    std::vector<char> second(names_.size());
    for (const std::size_t j : order_) {
      const std::size_t parent = parents_[j];
      if (parent == no_item) continue;
      second[j] = second[parent];
      if (children[parent] > 1) second[j] = random.uniform() < 0.5 ? 1 : 0;
      const RigPose& from = second[j] != 0 ? b : a;
      result.rotations[j] = result.rotations[parent] * (from.rotations[parent].transposed() * from.rotations[j]);
      result.offsets[j] = from.offsets[j];
    }
    return result;
  }
  /// Turns every joint by normal noise of `amount` of what its clips turn it; those after it are carried along.
  RigPose disturbed(const RigPose& pose, double amount, Random& random) const {
    RigPose result = pose;
    for (const std::size_t j : order_) {
      const Vec3d turn = Vec3d{random.normal(), random.normal(), random.normal()} * (amount * ranges_[j]);
      const Matrix3 local =
          parents_[j] == no_item ? pose.rotations[j] : pose.rotations[parents_[j]].transposed() * pose.rotations[j];
      result.rotations[j] =
          (parents_[j] == no_item ? local : result.rotations[parents_[j]] * local) * rotation_matrix(turn);
    }
    return result;
  }

  /// Half of the characters keep theirs; the others' parts are 0.75 to 1.33 times as long and thick, log-uniform.
  RigProportions sample_proportions(Random& random) const {
    RigProportions result;
    const double amount = random.uniform() < 0.5 ? 0 : std::log(4.0 / 3);
    for (const std::string& base : bases_)
      if (!result.parts.contains(base))
        result.parts[base] = {std::exp(random.uniform(-amount, amount)), std::exp(random.uniform(-amount, amount))};
    return result;
  }

  /// The character with these proportions in a pose of rig `source`, which may be itself. xyz: [V, 3]
  void posed(const RigProportions& proportions, const RigCharacter& source, const RigPose& pose,
             std::span<float> xyz) const {
    const std::size_t count = names_.size();
    std::vector<Vec3d> grown(count), places(count);
    std::vector<Matrix3> stretches(count), rotations(count);
    for (const std::size_t j : order_) {
      const auto part = proportions.parts.find(bases_[j]);
      const RigProportions::Part own = part == proportions.parts.end() ? RigProportions::Part{} : part->second;
      stretches[j] = Matrix3::identity() * own.girth + outer(along_[j], along_[j]) * (own.length - own.girth);
      const auto found = source.numbers_.find(names_[j]);
      const std::size_t s = found == source.numbers_.end() ? no_item : found->second;
      const std::size_t parent = parents_[j];
      if (parent == no_item) {
        rotations[j] = s == no_item ? Matrix3::identity() : pose.rotations[s];
        grown[j] = places[j] = joints_[j];
        continue;
      }
      rotations[j] = s == no_item ? rotations[parent] : pose.rotations[s];
      grown[j] = grown[parent] + stretches[parent] * (joints_[j] - joints_[parent]);
      const bool same_parent =
          s != no_item && source.parents_[s] != no_item && source.names_[source.parents_[s]] == names_[parent];
      const Vec3d offset = same_parent ? pose.offsets[s] * size_ : Vec3d{};
      places[j] = places[parent] + rotations[parent] * (grown[j] - grown[parent] + offset);
    }
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      if (const std::size_t same = same_as_[v]; same != v) {
        for (std::size_t k = 0; k < 3; ++k) xyz[3 * v + k] = xyz[3 * same + k];
        continue;
      }
      const std::span<const std::uint32_t> joints = weights_.columns_of(v);
      const std::span<const float> weights = weights_.values_of(v);
      const Vec3d rest = skinned(joints, weights,
                                 [&](std::size_t j) { return grown[j] + stretches[j] * (positions_[v] - joints_[j]); });
      const auto moved = [&](std::size_t j) { return places[j] + rotations[j] * (rest - grown[j]); };
      const Vec3f p = skinned(joints, weights, moved).as<float>();
      xyz[3 * v] = p.x, xyz[3 * v + 1] = p.y, xyz[3 * v + 2] = p.z;
    }
  }

 private:
  /// Where the joints are at a moment of a clip, in the scene.
  struct Moment {
    std::vector<Matrix3> rotations;
    std::vector<Vec3d> places;
  };

  static std::string base_of(const std::string& name) {
    std::string base = parse_joint_name(name).words.front();
    while (!base.empty() && base.back() >= '0' && base.back() <= '9') base.pop_back();
    return base.empty() ? name : base;
  }

  /// The bind pose in the scene's axes and unit: turned by whole quarters, as the joints stand on the whole.
  void bring_upright(const Rig& rig) {
    const RigAxes axes = rig_axes(rig);
    axes_ = axes.turn;
    scale_ = axes.scale;
    if (!(scale_ > 0)) throw Error({.file = name_, .found = "joints with a scale of 0", .expected = "above 0"});
    for (const Vec3f p : rig.positions) positions_.push_back(axes_ * p.as<double>() * scale_);
    for (std::size_t j = 0; j < rig.joint_count(); ++j) joints_.push_back(axes_ * rig.joint_place(j) * scale_);
    Vec3d low = positions_.front(), high = low;
    for (const Vec3d p : positions_) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    size_ = length(high - low);
    extent_ = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  }
  /// Files hold a vertex once for each normal and UV at it, about four times: it is posed once.
  void find_doubles() {
    std::map<std::array<double, 3>, std::vector<std::size_t>> places;
    const auto weights_of = [this](std::size_t v) {
      std::vector<std::pair<std::uint32_t, float>> row;
      for (std::size_t i = weights_.start[v]; i < weights_.start[v + 1]; ++i)
        row.emplace_back(weights_.column[i], weights_.value[i]);
      return row;
    };
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      const Vec3d p = positions_[v];
      std::vector<std::size_t>& here = places[{p.x, p.y, p.z}];
      const auto same = std::ranges::find_if(here, [&](std::size_t u) { return weights_of(u) == weights_of(v); });
      same_as_.push_back(same == here.end() ? v : *same);
      if (same == here.end()) here.push_back(v);
    }
  }
  std::vector<Moment> moments_of(const Rig& rig, const Clip& clip) const {
    bool moves = false;
    for (const ClipChannel& channel : clip.channels)
      moves = moves || std::ranges::find(rig.joints, channel.node) != rig.joints.end();
    if (!moves)
      throw Error({.file = name_,
                   .place = "clip '" + clip.name + "'",
                   .found = clip.channels.empty() ? "no keys" : "no keys of a joint",
                   .expected = "a clip that moves the skeleton"});
    std::vector<Moment> moments;
    for (const double time : frame_times(clip, frame_rate)) {
      Moment& m = moments.emplace_back();
      const std::vector<Affine> motions = rig.motions(&clip, time);
      for (std::size_t j = 0; j < motions.size(); ++j) {
        m.rotations.push_back(orthonormal(motions[j].linear) * axes_.transposed());
        m.places.push_back(motions[j](rig.joint_place(j)));
      }
    }
    return moments;
  }

  /// A joint whose place its parent doesn't tell belongs to one that does.
  void find_parents(const Rig& rig, const std::vector<std::vector<Moment>>& moments) {
    parents_ = rig.parents;
    // Of several roots the one that most joints are attached to is the root, and the others, feet often, are attached to it.
    std::vector<std::size_t> hanging(joints_.size());
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      std::size_t root = j;
      while (parents_[root] != no_item) root = parents_[root];
      ++hanging[root];
    }
    const auto root = static_cast<std::size_t>(std::ranges::max_element(hanging) - hanging.begin());
    for (std::size_t j = 0; j < joints_.size(); ++j)
      if (parents_[j] == no_item && j != root) parents_[j] = root;
    const auto loose = [&](std::size_t j, std::size_t to) {
      double sum = 0, count = 0;
      for (const auto& clip : moments)
        for (std::size_t f = 0; f < clip.size(); f += 3) {
          const Vec3d at = clip[f].rotations[to].transposed() * (clip[f].places[j] - clip[f].places[to]);
          const Vec3d off = at - (joints_[j] - joints_[to]);
          sum += dot(off, off), ++count;
        }
      return std::sqrt(sum / count) / size_;
    };
    const auto below = [&](std::size_t k, std::size_t j) {
      while (k != no_item && k != j) k = parents_[k];
      return k == j;
    };
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      if (parents_[j] == no_item) continue;
      double least = loose(j, parents_[j]);
      if (least < 0.02) continue;
      // Of joints to which it is equally still, a stiff leg's hip and knee, the nearest.
      constexpr double equal = 1e-3;
      const double limit = least / 2;
      double nearest = std::numeric_limits<double>::infinity();
      least = limit;
      for (std::size_t k = 0; k < joints_.size(); ++k) {
        if (k == j || below(k, j)) continue;
        const double own = loose(j, k), distance = length(joints_[j] - joints_[k]);
        if (own >= limit || own > least + equal || (own > least - equal && distance > nearest)) continue;
        least = std::min(least, own), nearest = distance, parents_[j] = k;
      }
    }
    std::vector<bool> placed(joints_.size());
    const auto place = [&](auto&& self, std::size_t j) -> void {
      if (placed[j]) return;
      if (parents_[j] != no_item) self(self, parents_[j]);
      placed[j] = true;
      order_.push_back(j);
    };
    for (std::size_t j = 0; j < joints_.size(); ++j) place(place, j);
    along_.assign(joints_.size(), {});
    for (const std::size_t j : order_)
      if (const std::size_t p = parents_[j]; p != no_item && along_[p] == Vec3d{})
        along_[p] = normalised(joints_[j] - joints_[p]);
    for (const std::size_t j : order_)
      if (along_[j] == Vec3d{} && parents_[j] != no_item) along_[j] = along_[parents_[j]];
  }

  RigPose pose_of(const Moment& m) const {
    RigPose pose{m.rotations, std::vector<Vec3d>(joints_.size())};
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const std::size_t p = parents_[j];
      if (p == no_item) continue;
      const Vec3d at = m.rotations[p].transposed() * (m.places[j] - m.places[p]);
      pose.offsets[j] = (at - (joints_[j] - joints_[p])) * (1 / size_);
    }
    return pose;
  }

  /// How far clips turn each joint against its parent: the root of the mean square of the angle, in radians.
  void find_ranges() {
    ranges_.assign(joints_.size(), 0);
    double count = 0;
    for (const auto& clip : clips_)
      for (const RigPose& pose : clip) {
        ++count;
        for (std::size_t j = 0; j < joints_.size(); ++j) {
          if (parents_[j] == no_item) continue;
          const Quaternion q = quaternion_of(pose.rotations[parents_[j]].transposed() * pose.rotations[j]);
          const double angle = 2 * std::acos(std::min(1.0, q.w));
          ranges_[j] += angle * angle;
        }
      }
    for (double& range : ranges_) range = std::sqrt(range / std::max(count, 1.0));
  }

  std::string name_;
  std::vector<std::string> names_, bases_;
  std::map<std::string, std::size_t> numbers_;
  std::vector<Triangle> triangles_;
  std::vector<Edge> edges_;
  SparseMatrix weights_;
  Matrix3 axes_ = Matrix3::identity();
  double scale_ = 1, size_ = 1, extent_ = 1;
  std::vector<Vec3d> positions_, joints_;  ///< bound, in the scene's axes
  std::vector<std::size_t> same_as_;       ///< [V] the first vertex with its place and weights
  std::vector<std::size_t> parents_, order_;
  std::vector<Vec3d> along_;  ///< [J] unit, of the joint's bone; 0 where it has none
  std::vector<std::string> clip_names_;
  std::vector<std::vector<RigPose>> clips_;
  std::vector<double> ranges_;
};

}  // namespace npt::inline NPT_ABI
