/// What is known of a kind of body beside its mesh: its joints, which of them make a limb, how they bend, and which
/// proportions vary. People's is people_plan(); another kind's stands in its weights file.
/// Format    lines of words; # begins a comment
///   plan NAME [PLURAL]
///   joint NAME PARENT MIRRORED LIMB KIND TOWARD STIFFNESS DENSITY [HINGE_X HINGE_Y HINGE_Z]
///   proportion NAME DEVIATION LOW HIGH
///   grows PROPORTION all|length|girth|x|y|z|across_y JOINT...
/// PARENT is - for the root, MIRRORED the joint of the other side or the joint itself, TOWARD the joint to which its
/// bone leads or the joint itself. Joints stand after their parents.
/// Axes      a body at rest stands along +y and looks along +z; its left is at x > 0
/// Errors    npt::Error that names the text, the line and what was expected
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/kind_words.hpp>
#include <npt/config.hpp>
#include <npt/io/text.hpp>
#include <npt/io/words.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// What the part of a body is that a joint moves.
enum class JointKind {
  root,       ///< the hips, from which all else hangs
  spine,      ///< of the trunk
  girdle,     ///< a collar or a shoulder blade: what ties a limb to the trunk
  neck,       ///< between trunk and head
  head,       ///< round, without a direction of its own
  bone,       ///< of a limb
  end,        ///< what a limb ends in: hand, foot, paw
  tip,        ///< the end of that
  appendage,  ///< ear, jaw: small, and of no use to find the rest
};

/// How a part grows with a proportion.
enum class PartGrowth {
  all,
  length,  ///< along its bone
  girth,   ///< across it
  x,
  y,
  z,
  across_y,  ///< along x and z
};

struct JointPlan {
  std::string name;
  int parent = -1;
  std::size_t mirrored = 0;
  std::size_t limb = 0;
  JointKind kind = JointKind::bone;
  std::size_t toward = 0;
  double stiffness = 1;  ///< of its angles in a prior of poses, each joint by itself
  double density = 1;    ///< points that are drawn for it, relative to the trunk's
  Vec3d hinge;           ///< where not zero: the axis about which it bends, to the negative side
};

struct ProportionPlan {
  std::string name;
  double deviation = 0;      ///< relative, of the kind; for a fit's prior
  double low = 1, high = 1;  ///< the factors that are drawn for training
  std::vector<std::pair<std::size_t, PartGrowth>> grows;
};

/// A limb of the left side and its mirror image on the right.
struct LimbPair {
  /// Left and right: joints in a row, from the girdle's, if any, to the tip.
  std::array<std::vector<std::size_t>, 2> joints;
  std::size_t first = 0;  ///< place in them of the limb's first bone: 1 behind a girdle, else 0

  /// Where elbow and knee stand in them; the next joint is where the limb's end begins.
  std::size_t middle() const noexcept { return first + 1; }
};

struct BodyPlan {
  std::string name;    ///< of one body: "person"
  std::string plural;  ///< "people"
  std::vector<JointPlan> joints;
  std::vector<std::string> limbs;  ///< names; JointPlan::limb counts in them
  std::vector<ProportionPlan> proportions;

  std::size_t joint_count() const noexcept { return joints.size(); }
  std::vector<int> parents() const {
    std::vector<int> all;
    for (const JointPlan& joint : joints) all.push_back(joint.parent);
    return all;
  }

  /// no_joint where it has none of this name.
  static constexpr std::size_t no_joint = std::numeric_limits<std::size_t>::max();
  std::size_t joint(std::string_view name_of) const {
    const auto at = std::ranges::find(joints, name_of, &JointPlan::name);
    return at == joints.end() ? no_joint : static_cast<std::size_t>(at - joints.begin());
  }
  bool in_trunk(std::size_t j) const {
    const JointKind k = joints[j].kind;
    return k == JointKind::root || k == JointKind::spine || k == JointKind::girdle;
  }
  /// -1 of the right side, 1 of the left one, 0 of the middle. A left joint stands before its right one.
  int side(std::size_t j) const { return joints[j].mirrored > j ? 1 : joints[j].mirrored < j ? -1 : 0; }

  /// Limbs of both sides with at least three joints, in the order of their first ones.
  std::vector<LimbPair> limb_pairs() const {
    std::vector<LimbPair> pairs;
    for (std::size_t l = 0; l < limbs.size(); ++l) {
      const auto start = std::ranges::find(joints, l, &JointPlan::limb);
      auto j = static_cast<std::size_t>(start - joints.begin());
      if (start == joints.end() || side(j) != 1) continue;
      LimbPair pair;
      const auto add = [&](std::size_t left) {
        pair.joints[0].push_back(left);
        pair.joints[1].push_back(joints[left].mirrored);
      };
      const int parent = joints[j].parent;
      if (parent >= 0 && joints[static_cast<std::size_t>(parent)].kind == JointKind::girdle)
        add(static_cast<std::size_t>(parent)), pair.first = 1;
      add(j);
      for (std::size_t next = j + 1; next < joints.size(); ++next)
        if (joints[next].limb == l && joints[next].parent == static_cast<int>(j) &&
            joints[next].kind != JointKind::appendage)
          add(j = next);
      if (pair.joints[0].size() > pair.middle() + 1) pairs.push_back(std::move(pair));
    }
    return pairs;
  }

  /// Names for messages. A limb's is that of its left one in the plan: "left_foreleg" is "foreleg".
  const KindWords& words() const {
    KindWords all{.one = name, .many = plural};
    for (const LimbPair& pair : limb_pairs()) {
      std::string limb = limbs[joints[pair.joints[0][pair.first]].limb];
      if (limb.starts_with("left_")) limb.erase(0, 5);
      (pair.first > 0 ? all.upper_limb : all.lower_limb) = std::move(limb);
    }
    return kept_words(std::move(all));
  }
};

namespace body::internal {

class BodyPlanReader {
 public:
  BodyPlanReader(std::string_view text, const std::string& source) : source_(source) {
    TextLines lines(text);
    for (std::string_view line; lines.next(line);) {
      place_ = "line " + std::to_string(lines.number());
      const auto words = list_words(line);
      if (!words) fail(found_words(words), "words of a body plan");
      if (words->empty()) continue;
      take(*words);
    }
    place_.clear();
    if (plan_.joints.empty()) fail("no joints", "lines of: joint NAME PARENT ...");
    for (std::size_t j = 0; j < plan_.joints.size(); ++j) {
      plan_.joints[j].mirrored = known(links_[j].first);
      plan_.joints[j].toward = known(links_[j].second);
    }
    for (const JointPlan& joint : plan_.joints)
      if (plan_.joints[plan_.joints[joint.mirrored].mirrored].name != joint.name)
        fail("joint '" + joint.name + "' mirrored to '" + plan_.joints[joint.mirrored].name + "'", "pairs");
  }

  BodyPlan take_plan() { return std::move(plan_); }

 private:
  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({source_, place_, std::move(found), std::move(expected)});
  }
  std::size_t known(const std::string& name) const {
    const std::size_t j = plan_.joint(name);
    if (j == BodyPlan::no_joint) fail("joint '" + name + "'", "a joint that a line names");
    return j;
  }
  double number(const std::string& word) const {
    const std::optional<double> value = parse_number<double>(word);
    if (!value || !std::isfinite(*value)) fail("'" + word + "'", "a number");
    return *value;
  }
  template <class Value, std::size_t N>
  Value named(const std::string& word, const std::array<std::pair<const char*, Value>, N>& values) const {
    std::string all;
    for (const auto& [name, value] : values) {
      if (word == name) return value;
      all += (all.empty() ? "" : ", ") + std::string(name);
    }
    fail("'" + word + "'", "one of " + all);
  }

  void take(const std::vector<std::string>& words) {
    if (words[0] == "plan" && (words.size() == 2 || words.size() == 3))
      plan_.name = words[1], plan_.plural = words.size() == 3 ? words[2] : words[1] + "s";
    else if (words[0] == "joint" && (words.size() == 9 || words.size() == 12))
      add_joint(words);
    else if (words[0] == "proportion" && words.size() == 5)
      plan_.proportions.push_back({words[1], number(words[2]), number(words[3]), number(words[4]), {}});
    else if (words[0] == "grows" && words.size() >= 4)
      add_growth(words);
    else
      fail("'" + words[0] + "' and " + std::to_string(words.size() - 1) + " words",
           "plan, joint, proportion or grows with what belongs to it");
  }
  void add_joint(const std::vector<std::string>& words) {
    using K = JointKind;
    static constexpr std::array<std::pair<const char*, K>, 9> kinds{{{"root", K::root},
                                                                     {"spine", K::spine},
                                                                     {"girdle", K::girdle},
                                                                     {"neck", K::neck},
                                                                     {"head", K::head},
                                                                     {"bone", K::bone},
                                                                     {"end", K::end},
                                                                     {"tip", K::tip},
                                                                     {"appendage", K::appendage}}};
    JointPlan joint;
    joint.name = words[1];
    if (words[2] != "-") joint.parent = static_cast<int>(known(words[2]));
    if ((joint.parent < 0) != plan_.joints.empty()) fail("parent '" + words[2] + "'", "- for the first joint alone");
    links_.emplace_back(words[3], words[6]);
    const auto limb = std::ranges::find(plan_.limbs, words[4]);
    joint.limb = static_cast<std::size_t>(limb - plan_.limbs.begin());
    if (limb == plan_.limbs.end()) plan_.limbs.push_back(words[4]);
    joint.kind = named(words[5], kinds);
    joint.stiffness = number(words[7]);
    joint.density = number(words[8]);
    if (words.size() == 12) joint.hinge = {number(words[9]), number(words[10]), number(words[11])};
    plan_.joints.push_back(std::move(joint));
  }
  void add_growth(const std::vector<std::string>& words) {
    using G = PartGrowth;
    static constexpr std::array<std::pair<const char*, G>, 7> ways{{{"all", G::all},
                                                                    {"length", G::length},
                                                                    {"girth", G::girth},
                                                                    {"x", G::x},
                                                                    {"y", G::y},
                                                                    {"z", G::z},
                                                                    {"across_y", G::across_y}}};
    const auto proportion = std::ranges::find(plan_.proportions, words[1], &ProportionPlan::name);
    if (proportion == plan_.proportions.end()) fail("'" + words[1] + "'", "a proportion that a line above names");
    const PartGrowth way = named(words[2], ways);
    for (std::size_t w = 3; w < words.size(); ++w) proportion->grows.emplace_back(known(words[w]), way);
  }

  std::string source_, place_;
  BodyPlan plan_;
  std::vector<std::pair<std::string, std::string>> links_;  ///< names of mirrored and toward
};

}  // namespace body::internal

/// source: names the text in errors.
inline BodyPlan read_body_plan(std::string_view text, const std::string& source) {
  return body::internal::BodyPlanReader(text, source).take_plan();
}

}  // namespace npt::inline NPT_ABI
