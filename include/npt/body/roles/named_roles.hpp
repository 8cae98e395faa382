/// The roles of joints as their names have them.
#pragma once

#include <npt/body/roles/dialects.hpp>
#include <npt/body/roles/joint_name.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/config.hpp>
#include <npt/scene/motion.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// The joint of each role; no_item: none. kind: of the body whose roles they are
struct RoleTable : std::array<std::size_t, joint_role_count> {
  SkeletonKind kind = SkeletonKind::person;
};

struct NamedRoles {
  RoleTable joints{};
  std::string_view dialect{};  ///< the one that knows most names; empty: none knows any
  std::size_t known = 0;       ///< names that are known
};

namespace internal {

/// Calls f(part) for each part of a text between separators.
template <class F>
void each_part(std::string_view text, char separator, F&& f) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    f(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

/// Joints by side (2: none) and word, and how much hangs below each: of two with one name the one with more is meant.
class JointsByName {
 public:
  explicit JointsByName(const Motion& motion) : below_(motion.joints.size(), 1) {
    for (std::size_t j = motion.joints.size(); j-- > 0;)
      if (motion.joints[j].parent != no_item) below_[motion.joints[j].parent] += below_[j];
    for (std::size_t j = 0; j < motion.joints.size(); ++j) {
      if (motion.joints[j].end) continue;
      const JointName name = parse_joint_name(motion.joints[j].name);
      for (std::size_t w = 0; w < name.words.size(); ++w) add({name.side.value_or(2), name.words[w]}, {j, w});
      // "lfemur": a side's letter that nothing divides from its word.
      const std::string& word = name.words.front();
      if (!name.side && word.size() > 1 && (word[0] == 'l' || word[0] == 'r'))
        add({word[0] == 'l' ? 0U : 1U, word.substr(1)}, {j, name.words.size()});
    }
  }

  /// For words separated by '/', the first that a joint has.
  std::size_t find(std::string_view words, std::size_t side) const {
    std::size_t joint = no_item, worst = no_item;
    each_part(words, '/', [&](std::string_view word) {
      const auto found = known_.find({side, std::string(word)});
      if (found == known_.end() || found->second.rank >= worst) return;
      joint = found->second.joint, worst = found->second.rank;
    });
    return joint;
  }

 private:
  struct Found {
    std::size_t joint = no_item, rank = 0;
  };
  void add(const std::pair<std::size_t, std::string>& key, Found found) {
    const auto [at, fresh] = known_.emplace(key, found);
    if (fresh || at->second.rank < found.rank) return;
    if (at->second.rank > found.rank || below_[at->second.joint] < below_[found.joint]) at->second = found;
  }

  std::map<std::pair<std::size_t, std::string>, Found> known_;
  std::vector<std::size_t> below_;
};

/// Calls f(role, words) for each role that a dialect has words for, and side of it (2: the middle).
template <class F>
void each_role(const JointDialect& dialect, F&& f) {
  constexpr std::array<JointRole, 5> middle{JointRole::hips, JointRole::neck, JointRole::head, JointRole::tail_1,
                                            JointRole::jaw};
  std::size_t i = 0;
  each_part(dialect.middle, ' ', [&](std::string_view words) {
    if (words != "-") f(middle[i], words, std::size_t{2});
    ++i;
  });
  for (std::size_t side = 0; side < 2; ++side) {
    std::size_t part = 0;
    for (const std::string_view text : {dialect.arm, dialect.leg, dialect.digits})
      each_part(text, ' ', [&](std::string_view words) {
        if (words != "-") f(limb_role(static_cast<LimbPart>(part), side), words, side);
        ++part;
      });
    std::array<JointRole, 2> more{JointRole::left_fore_toes, JointRole::left_ear};
    part = 0;
    each_part(dialect.animal, ' ', [&](std::string_view words) {
      if (words != "-") f(side == 0 ? more[part] : mirrored(more[part]), words, side);
      ++part;
    });
  }
}

/// Takes from a dialect what isn't known yet; a joint gets one role.
inline std::size_t add_roles(const JointDialect& dialect, const JointsByName& names, RoleTable& joints) {
  std::size_t added = 0;
  each_role(dialect, [&](JointRole role, std::string_view words, std::size_t side) {
    const std::size_t joint = names.find(words, side);
    if (joint == no_item || joints[index_of(role)] != no_item || std::ranges::find(joints, joint) != joints.end())
      return;
    joints[index_of(role)] = joint;
    ++added;
  });
  return added;
}

/// What a VRM file says itself. VRM 0 calls a thumb's joints as it calls a finger's.
inline std::size_t add_bones(const Motion& motion, RoleTable& joints) {
  const bool one = std::ranges::any_of(
      motion.joints, [](const MotionJoint& joint) { return joint.bone.ends_with("ThumbMetacarpal"); });
  std::size_t added = 0;
  for (std::size_t j = 0; j < motion.joints.size(); ++j) {
    std::string bone = motion.joints[j].bone;
    if (const std::size_t thumb = bone.find("Thumb"); thumb != std::string::npos && !one)
      bone = bone.ends_with("Proximal")       ? bone.substr(0, thumb) + "ThumbMetacarpal"
             : bone.ends_with("Intermediate") ? bone.substr(0, thumb) + "ThumbProximal"
                                              : bone;
    const JointRole role = role_named(bone);
    if (role == JointRole::none || index_of(role) >= limb_role_end || joints[index_of(role)] != no_item) continue;
    joints[index_of(role)] = j;
    ++added;
  }
  return added;
}

}  // namespace internal

/// As a VRM file says itself, or by the dialect that knows most joints, then by the next ones for what it leaves open.
/// Joints between hips and neck are left out: every tool counts them in its own way.
inline NamedRoles named_roles(const Motion& motion, SkeletonKind kind = SkeletonKind::person) {
  const internal::JointsByName names(motion);
  const bool person = kind == SkeletonKind::person;
  RoleTable nothing;
  nothing.fill(no_item);
  nothing.kind = kind;
  std::vector<std::pair<std::size_t, const JointDialect*>> order;
  for (const JointDialect& dialect : person ? std::span<const JointDialect>(joint_dialects) : animal_dialects) {
    RoleTable own = nothing;
    order.emplace_back(internal::add_roles(dialect, names, own), &dialect);
  }
  std::ranges::stable_sort(order, [](const auto& a, const auto& b) { return a.first > b.first; });
  NamedRoles roles{.joints = nothing};
  if (const std::size_t told = person ? internal::add_bones(motion, roles.joints) : 0; told > 0)
    roles.known = told, roles.dialect = "VRM's bones";
  for (const auto& [count, dialect] : order) roles.known += internal::add_roles(*dialect, names, roles.joints);
  if (roles.known > 0 && roles.dialect.empty()) roles.dialect = order.front().second->name;
  return roles;
}

}  // namespace npt::inline NPT_ABI
