/// Legs, arms and head in the shape of a skeleton, without names: two pairs of like branches, one where the spine
/// begins and one where it ends. A person's legs hang opposite to the spine; an animal's limbs all hang square to it
/// and end at one height.
/// Limits    bodies with two arms or forelegs, two legs and a head; which side is which stays open
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/skeleton_shape.hpp>
#include <npt/config.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Two branches of one joint that are alike.
struct BranchPair {
  std::size_t joint = no_item;            ///< that both hang from
  std::array<std::size_t, 2> branches{};  ///< their first joints
  double length = 0, likeness = 0;        ///< along the bones, without the bone to the first joint; 0 to 1
};

struct Limbs {
  BranchPair legs{}, arms{};
  std::vector<std::size_t> head{};  ///< from the joint behind the arms' to the end
  double confidence = 0;            ///< 0 to 1
};

namespace internal {

class LimbFinder {
 public:
  LimbFinder(const SkeletonShape& shape, SkeletonKind kind) : shape_(shape), kind_(kind) {}

  std::optional<Limbs> find() {
    collect_pairs();
    std::optional<Limbs> best;
    double most = 0;
    for (const BranchPair& legs : pairs_)
      for (const BranchPair& arms : pairs_) {
        if (&legs == &arms || !fit(legs, arms)) continue;
        Limbs limbs{.legs = legs, .arms = arms};
        const double score = kind_ == SkeletonKind::person ? judge(limbs) : judge_animal(limbs);
        if (score > most) most = score, best = limbs;
      }
    return best;
  }

 private:
  // A toe or a strand of hair is shorter than this part of the longest way down; the arms of the figures with the
  // shortest ones among 53 are 0.17 of it.
  static constexpr double least_limb = 0.1;
  // Beyond it the search over pairs of pairs would take long, and no body has so many.
  static constexpr std::size_t most_pairs = 60;

  void collect_pairs() {
    for (std::size_t n = 0; n < shape_.count(); ++n) {
      const std::vector<std::size_t>& children = shape_.children[n];
      if (children.size() > 64) continue;  // no body, but a file may have it
      for (std::size_t i = 0; i < children.size(); ++i)
        for (std::size_t k = i + 1; k < children.size(); ++k) add_pair(n, children[i], children[k]);
    }
    std::ranges::stable_sort(
        pairs_, [](const BranchPair& a, const BranchPair& b) { return a.length * a.likeness > b.length * b.likeness; });
    if (pairs_.size() > most_pairs) pairs_.resize(most_pairs);
  }

  /// How alike two numbers are: 1 for the same.
  static double ratio(double a, double b) { return std::max(a, b) > 0 ? std::min(a, b) / std::max(a, b) : 1; }

  void add_pair(std::size_t joint, std::size_t a, std::size_t b) {
    const double long_enough = least_limb * shape_.size;
    if (std::min(shape_.reach[a] + shape_.bone(a), shape_.reach[b] + shape_.bone(b)) < long_enough) return;
    const std::vector<std::size_t> pa = shape_.longest_path(a), pb = shape_.longest_path(b);
    if (pa.size() > pb.size() + 1 || pb.size() > pa.size() + 1) return;
    // Along as many joints as both have: what one hand holds doesn't count.
    const std::size_t both = std::min(pa.size(), pb.size());
    const double first = shape_.reach[a] - shape_.reach[pa[both - 1]];
    const double second = shape_.reach[b] - shape_.reach[pb[both - 1]];
    double likeness =
        ratio(first, second) * ratio(shape_.bone(a) + 0.02 * shape_.size, shape_.bone(b) + 0.02 * shape_.size);
    for (std::size_t i = 1; i < std::min(both, std::size_t{4}); ++i)
      likeness *= std::sqrt(ratio(shape_.bone(pa[i]) + 0.02 * shape_.size, shape_.bone(pb[i]) + 0.02 * shape_.size));
    if (likeness < 0.3) return;
    const double own = (first + second + beyond(pa) + beyond(pb)) / 2;
    pairs_.push_back({joint, {a, b}, std::max(own, 0.5 * long_enough), std::sqrt(likeness)});
  }

  /// The last bone of a limb whose file doesn't say where it ends: as long as the one before it.
  double beyond(const std::vector<std::size_t>& path) const {
    return path.size() < 2 || path.size() > 4 || shape_.ends[path.back()] ? 0 : shape_.bone(path.back());
  }

  /// The spine leads from the legs' joint, or one not far above it, to the arms'; none lies in the other. The fingers
  /// of two hands, which lie opposite each other, have both arms between them.
  bool fit(const BranchPair& legs, const BranchPair& arms) const {
    for (std::size_t i = 0; i < 2; ++i)
      if (shape_.is_below(arms.joint, legs.branches[i]) || shape_.is_below(legs.joint, arms.branches[i])) return false;
    for (const std::size_t a : legs.branches)
      for (const std::size_t b : arms.branches)
        if (a == b) return false;
    const std::size_t fork = shape_.common(legs.joint, arms.joint);
    if (fork == no_item || (legs.joint != arms.joint && fork == arms.joint)) return false;
    double way = 0;
    for (std::size_t joint = legs.joint; joint != fork; joint = shape_.parents[joint]) way += shape_.bone(joint);
    return way <= 1.5 * legs.length;
  }

  Vec3d middle(const BranchPair& pair) const {
    return (shape_.positions[pair.branches[0]] + shape_.positions[pair.branches[1]]) * 0.5;
  }
  /// With the last bones that a file doesn't have: a leg that ends at a knee reaches lower than a hanging hand.
  Vec3d ends(const BranchPair& pair) const {
    Vec3d sum{};
    for (const std::size_t branch : pair.branches) {
      const std::vector<std::size_t> path = shape_.longest_path(branch);
      sum += shape_.positions[path.back()];
      if (beyond(path) > 0) sum += shape_.positions[path.back()] - shape_.positions[path[path.size() - 2]];
    }
    return sum * 0.5;
  }
  /// From the second branch to the first, where they are apart: sides of legs and arms are the same.
  Vec3d apart(const BranchPair& pair) const {
    const std::vector<std::size_t> a = shape_.longest_path(pair.branches[0]), b = shape_.longest_path(pair.branches[1]);
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
      if (shape_.distance(a[i], b[i]) > 0.03 * shape_.size) return shape_.positions[a[i]] - shape_.positions[b[i]];
    return {};
  }
  static double cosine(Vec3d a, Vec3d b) { return dot(normalised(a), normalised(b)); }

  /// How much of a body the choice makes, in lengths; finds the head and sets the confidence.
  double judge(Limbs& limbs) const {
    const Vec3d spine = middle(limbs.arms) - middle(limbs.legs), leg = ends(limbs.legs) - middle(limbs.legs);
    const double opposite = -cosine(spine, leg);
    limbs.head = find_head(limbs, spine);
    double score = limbs.legs.length * limbs.legs.likeness * (0.3 + opposite) + limbs.arms.length * limbs.arms.likeness;
    score += 0.3 * length(spine);
    if (dot(apart(limbs.legs), apart(limbs.arms)) < 0) std::swap(limbs.arms.branches[0], limbs.arms.branches[1]);
    if (!limbs.head.empty()) score += 0.15 * shape_.size;
    const double upright = std::clamp((opposite - 0.2) / 0.5, 0.0, 1.0);
    const double whole = std::min(1.0, length(spine) / (0.1 * shape_.size)) * (limbs.head.empty() ? 0.5 : 1.0);
    // What reaches as low as the legs is a leg, too; goals of a foot are shorter than arms.
    const double rise = dot(ends(limbs.arms) - ends(limbs.legs), normalised(spine));
    const double arms = std::clamp(rise / (0.1 * shape_.size), 0.0, 1.0);
    const double legs = std::min(1.0, 2 * limbs.legs.length / limbs.arms.length);
    // Legs stand side by side, as the arms do. Of 53 figures all have a cosine over 0.7 between both lines, and one
    // within 0.1 of 0 between the legs and their line; nine of 22 animals fail in one of them.
    const double aslant = cosine(leg, apart(limbs.legs));
    const double sides =
        std::clamp((cosine(apart(limbs.legs), apart(limbs.arms)) - 0.2) / 0.4, 0.0, 1.0) * (1 - aslant * aslant);
    limbs.confidence = std::min(limbs.legs.likeness, limbs.arms.likeness) * upright * whole * arms * legs * sides;
    return score * (0.3 + 0.7 * arms * legs * sides);
  }

  /// The same of four legs. Hind legs are distinguished from forelegs by the head, which unlike a tail branches into
  /// ears and jaw, or is higher; and by knees, which bend forwards.
  double judge_animal(Limbs& limbs) const {
    const Vec3d spine = normalised(middle(limbs.arms) - middle(limbs.legs));
    const Vec3d hind = ends(limbs.legs) - middle(limbs.legs), fore = ends(limbs.arms) - middle(limbs.arms);
    const Vec3d down = normalised(hind + fore);
    if (dot(apart(limbs.legs), apart(limbs.arms)) < 0) std::swap(limbs.arms.branches[0], limbs.arms.branches[1]);
    limbs.head = find_head(limbs, spine, down * -1.0);
    const auto at_least = [](double value, double least) { return std::clamp(value / least, 0.0, 1.0); };
    const double hang = at_least(cosine(hind, down), 0.8) * at_least(cosine(fore, down), 0.8);
    const double lies = 1 - dot(spine, down) * dot(spine, down);
    const double off = std::abs(dot(ends(limbs.arms) - ends(limbs.legs), down));
    const double level = std::clamp(2 - 4 * off / std::max(length(hind), length(fore)), 0.0, 1.0);
    const double sides = at_least(cosine(apart(limbs.legs), apart(limbs.arms)), 0.6);
    // A hand's fingers hang so, too, but are short: legs of an apatosaur with its long neck are 0.15 of the way down.
    const double large = at_least(std::min(limbs.legs.length, limbs.arms.length) / shape_.size, 0.15);
    limbs.confidence = std::min(limbs.legs.likeness, limbs.arms.likeness) * hang * lies * level * sides * large *
                       (limbs.head.empty() ? 0.5 : 1);
    double front = 0;
    for (const std::size_t joint : limbs.head) front += shape_.children[joint].size() > 1 ? 0.3 : 0;
    if (!limbs.head.empty()) front -= dot(shape_.positions[limbs.head.back()] - middle(limbs.arms), down) / shape_.size;
    for (const std::size_t leg : limbs.legs.branches) front += 0.5 * knee(leg, spine);
    return (limbs.legs.length + limbs.arms.length) * limbs.confidence * (1 + at_least(front, 1));
  }

  /// How far the first bend of a leg, behind what only ties it to the trunk, stands off forwards.
  double knee(std::size_t branch, Vec3d forward) const {
    const std::vector<std::size_t> path = shape_.longest_path(branch);
    if (path.size() < 4) return 0;
    const Vec3d line = shape_.positions[path[3]] - shape_.positions[path[1]];
    return dot(shape_.positions[path[2]] - (shape_.positions[path[1]] + line * 0.5), forward) / length(line);
  }

  /// The branch of the arms' joint that goes on where the spine ends.
  /// up: of an animal, whose neck may rise from there
  std::vector<std::size_t> find_head(const Limbs& limbs, Vec3d spine, Vec3d up = {}) const {
    std::size_t best = no_item;
    double most = 0;
    for (const std::size_t child : shape_.children[limbs.arms.joint]) {
      if (child == limbs.arms.branches[0] || child == limbs.arms.branches[1] || child == limbs.legs.branches[0] ||
          child == limbs.legs.branches[1] || shape_.is_below(limbs.legs.joint, child))
        continue;
      const Vec3d way = shape_.positions[shape_.longest_path(child).back()] - middle(limbs.arms);
      const double along = dot(way, normalised(spine)) + 0.02 * shape_.size;
      const double aside = length(way - normalised(spine) * dot(way, normalised(spine)));
      const double score = up == Vec3d{} ? along - 0.7 * aside : along + 0.5 * dot(way, up);
      if (score > most) most = score, best = child;
    }
    return best == no_item ? std::vector<std::size_t>{} : shape_.longest_path(best);
  }

  const SkeletonShape& shape_;
  SkeletonKind kind_;
  std::vector<BranchPair> pairs_;
};

}  // namespace internal

/// Nothing where no two pairs of branches make a body, as where all joints are in one place.
inline std::optional<Limbs> find_limbs(const SkeletonShape& shape, SkeletonKind kind = SkeletonKind::person) {
  return shape.size > 0 ? internal::LimbFinder(shape, kind).find() : std::nullopt;
}

}  // namespace npt::inline NPT_ABI
