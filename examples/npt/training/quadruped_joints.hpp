/// Which parts of a four-legged animal a rig's joints are: legs, neck, head, ears, tail, trunk. Names tell them
/// (quadruped_names.hpp); where they don't, the shape does: legs reach the ground, the head is the greater end.
///   const QuadrupedJoints found = quadruped_joints(make_rig(read_scene("horse.glb"), "horse.glb"));
/// Of animals that walk on two legs the forelegs are the arms; these are found by their names alone.
/// Sides are the body's own, whatever names say.
/// Errors    npt::Error for rigs without four legs or without a head
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/rotation.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_name.hpp>
#include <npt/config.hpp>
#include <npt/io/text.hpp>
#include <npt/io/words.hpp>
#include <npt/lab/rig/rig.hpp>
#include <npt/lab/rig/rig_axes.hpp>
#include <npt/scene/scene.hpp>
#include <training/quadruped_names.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

enum class QuadrupedPart { unknown, aside, body, trunk, neck, head, jaw, ear, tail, girdle, foreleg, hindleg };

/// Numbers of the rig's joints.
struct QuadrupedJoints {
  Matrix3 turn = Matrix3::identity();    ///< of the bind pose's axes: then y is up and it looks to +z
  Matrix3 facing = Matrix3::identity();  ///< of the scene's axes
  /// Left and right foreleg, left and right hind leg: downwards, from what ties them to the trunk.
  std::array<std::vector<std::size_t>, 4> legs;
  std::array<std::size_t, 4> girdles{};  ///< how many of each leg's first joints are above shoulder and hip
  std::vector<std::size_t> neck;         ///< upwards, without the head; empty: the head is attached to the trunk
  std::size_t head = no_item, jaw = no_item;
  std::array<std::vector<std::size_t>, 2> ears;  ///< left, right; outwards
  std::vector<std::size_t> skull;                ///< others that go with the head
  std::vector<std::size_t> tail;                 ///< outwards
  std::vector<std::size_t> back;                 ///< of the trunk those that stand along it
};

namespace rig::internal {

inline QuadrupedPart quadruped_part(std::string_view name) {
  using enum QuadrupedPart;
  static const std::map<std::string, QuadrupedPart, std::less<>> parts = [] {
    const std::map<std::string_view, QuadrupedPart> kinds{
        {"body", body}, {"trunk", trunk},   {"neck", neck},       {"head", head},       {"jaw", jaw},    {"ear", ear},
        {"tail", tail}, {"girdle", girdle}, {"foreleg", foreleg}, {"hindleg", hindleg}, {"aside", aside}};
    std::map<std::string, QuadrupedPart, std::less<>> result;
    TextLines lines(quadruped_names);
    for (std::string_view line; lines.next(line);) {
      const auto words = list_words(line);
      for (std::size_t w = 1; words && w < words->size(); ++w) result.emplace((*words)[w], kinds.at(words->front()));
    }
    return result;
  }();
  std::vector<std::string> words = parse_joint_name(name).words;
  std::string bare = words.front();
  std::erase_if(bare, [](char c) { return c >= '0' && c <= '9'; });
  words.push_back(bare);
  for (const std::string& word : words)
    if (const auto at = parts.find(word); at != parts.end()) return at->second;
  return unknown;
}

class QuadrupedFinder {
 public:
  QuadrupedFinder(const Rig& rig, bool forelegs_stand) : rig_(rig), forelegs_stand_(forelegs_stand) {
    const Matrix3 axes = rig_axes(rig).turn;
    found_.turn = axes;
    for (const Vec3f p : rig.positions) points_.push_back(axes * p.as<double>());
    for (std::size_t r = 0; r < rig.joint_count(); ++r) {
      places_.push_back(axes * rig.joint_place(r));
      parts_.push_back(quadruped_part(rig.joint_name(r)));
    }
    measure();
    if (!has_names()) find_shape();
    face_forwards();
    sort_legs();
    find_neck();
    find_ears_and_tail();
  }

  QuadrupedJoints take() { return std::move(found_); }

 private:
  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({rig_.name, {}, std::move(found), std::move(expected)});
  }
  using Joints = std::vector<std::size_t>;

  Joints of_part(QuadrupedPart part) const {
    Joints result;
    for (std::size_t r = 0; r < parts_.size(); ++r)
      if (parts_[r] == part) result.push_back(r);
    return result;
  }
  std::size_t depth(std::size_t r) const {
    std::size_t n = 0;
    for (; rig_.parents[r] != no_item; r = rig_.parents[r]) ++n;
    return n;
  }
  bool is_below(std::size_t r, std::size_t above) const {
    while (r != no_item && r != above) r = rig_.parents[r];
    return r == above;
  }
  Vec3d mean_of(const Joints& joints) const {
    Vec3d sum;
    for (const std::size_t r : joints) sum += places_[r];
    return sum / static_cast<double>(std::max<std::size_t>(joints.size(), 1));
  }

  /// What each joint moves most of: how much, how low it reaches, how far it spreads.
  void measure() {
    const std::size_t count = rig_.joint_count();
    mass_.assign(count, 0), lowest_.assign(count, 1e300), spread_.assign(count, 0);
    std::vector<Joints> own(count);
    for (std::size_t v = 0; v < points_.size(); ++v) {
      const auto values = rig_.weights.values_of(v);
      const auto most = static_cast<std::size_t>(std::ranges::max_element(values) - values.begin());
      most_.push_back(rig_.weights.columns_of(v)[most]);
      own[most_.back()].push_back(v);
    }
    floor_ = 1e300, top_ = -1e300;
    for (const Vec3d p : points_) floor_ = std::min(floor_, p.y), top_ = std::max(top_, p.y);
    for (std::size_t r = 0; r < count; ++r) {
      Vec3d mean;
      for (const std::size_t v : own[r]) mean += points_[v], lowest_[r] = std::min(lowest_[r], points_[v].y);
      mass_[r] = static_cast<double>(own[r].size());
      for (const std::size_t v : own[r]) spread_[r] += dot(points_[v] - mean / mass_[r], points_[v] - mean / mass_[r]);
      if (mass_[r] > 0) spread_[r] = std::sqrt(spread_[r] / mass_[r]);
    }
  }

  /// Whether names tell the head and two joints or more of each of four legs.
  bool has_names() const {
    return !of_part(QuadrupedPart::head).empty() && of_part(QuadrupedPart::foreleg).size() >= 4 &&
           of_part(QuadrupedPart::hindleg).size() >= 4;
  }

  /// Parts by the shape alone: legs are the branches that reach the ground; of the others' ends the one that spreads
  /// most is the head, and the farthest behind the hind legs the tail.
  void find_shape() {
    const std::size_t count = rig_.joint_count();
    parts_.assign(count, QuadrupedPart::unknown);
    std::vector<double> below(mass_);
    for (std::size_t r = count; r-- > 0;)
      if (rig_.parents[r] != no_item) below[rig_.parents[r]] += below[r];
    std::vector<std::size_t> children(count);
    for (std::size_t r = 0; r < count; ++r)
      if (below[r] > 0 && rig_.parents[r] != no_item) ++children[rig_.parents[r]];
    Joints feet, ends;
    for (std::size_t r = 0; r < count; ++r)
      if (below[r] > 0 && children[r] == 0) (lowest_[r] < floor_ + 0.08 * (top_ - floor_) ? feet : ends).push_back(r);
    const auto near = [&](std::size_t a, std::size_t b) {
      Vec3d off = places_[a] - places_[b];
      off.y = 0;
      return length(off) < 0.1 * (top_ - floor_);
    };
    // The top of a leg: above it there are others' feet, or ends.
    std::vector<std::pair<std::size_t, std::size_t>> legs;  // top, foot
    for (const std::size_t foot : feet) {
      std::size_t top = foot;
      const auto alone = [&](std::size_t r) {
        return std::ranges::none_of(ends, [&](std::size_t e) { return is_below(e, r); }) &&
               std::ranges::all_of(feet, [&](std::size_t f) { return !is_below(f, r) || near(f, foot); });
      };
      while (rig_.parents[top] != no_item && alone(rig_.parents[top])) top = rig_.parents[top];
      if (std::ranges::find(legs, top, &std::pair<std::size_t, std::size_t>::first) == legs.end())
        legs.emplace_back(top, foot);
    }
    if (legs.size() != 4 || ends.empty())
      fail(std::to_string(legs.size()) + " branches of joints that reach the ground, and names that tell no four legs",
           "a four-legged animal: four legs and a head");
    const std::size_t head = *std::ranges::max_element(ends, {}, [&](std::size_t r) { return spread_[r] * mass_[r]; });
    parts_[head] = QuadrupedPart::head;
    Vec3d centre;
    for (const auto& [top, foot] : legs) centre += places_[foot] / 4.0;
    Vec3d forwards = places_[head] - centre;
    forwards.y = 0;
    forwards = normalised(forwards);
    std::ranges::sort(legs, {}, [&](const auto& leg) { return dot(places_[leg.first], forwards); });
    for (std::size_t l = 0; l < 4; ++l)
      for (std::size_t r = legs[l].second;; r = rig_.parents[r]) {
        parts_[r] = l < 2 ? QuadrupedPart::hindleg : QuadrupedPart::foreleg;
        if (r == legs[l].first) break;
      }
    const double rear = std::min(dot(places_[legs[0].first], forwards), dot(places_[legs[1].first], forwards));
    const std::size_t last =
        *std::ranges::min_element(ends, {}, [&](std::size_t r) { return dot(places_[r], forwards); });
    for (std::size_t r = last; r != no_item && !is_below(head, r) && dot(places_[r], forwards) < rear;
         r = rig_.parents[r])
      parts_[r] = QuadrupedPart::tail;
  }

  /// From hind legs to forelegs is +z; nearly whole quarter turns are whole ones.
  void face_forwards() {
    Vec3d forwards = mean_of(of_part(QuadrupedPart::foreleg)) - mean_of(of_part(QuadrupedPart::hindleg));
    forwards.y = 0;
    if (!(length(forwards) > 0.05 * (top_ - floor_)))
      fail("forelegs where hind legs are", "a four-legged animal that stands");
    forwards = normalised(forwards);
    for (const Vec3d axis : {Vec3d{1, 0, 0}, Vec3d{-1, 0, 0}, Vec3d{0, 0, 1}, Vec3d{0, 0, -1}})
      if (dot(axis, forwards) > 0.996) forwards = axis;
    const Vec3d up{0, 1, 0};
    const Matrix3 yaw{{{cross(up, forwards), up, forwards}}};
    found_.facing = yaw;
    turn_by(yaw);
    if (forelegs_stand_) stand_level();
  }
  void turn_by(const Matrix3& turn) {
    found_.turn = turn * found_.turn;
    for (Vec3d& p : places_) p = turn * p;
    for (Vec3d& p : points_) p = turn * p;
  }

  /// Some are bound on a slope, one by 27 degrees: forefeet and hind feet stand on a level floor.
  void stand_level() {
    for (int round = 0; round < 4; ++round) {
      const auto lowest_of = [&](QuadrupedPart part) {
        Vec3d low{0, std::numeric_limits<double>::infinity(), 0};
        for (std::size_t v = 0; v < points_.size(); ++v)
          if (parts_[most_[v]] == part && points_[v].y < low.y) low = points_[v];
        return low;
      };
      const Vec3d way = lowest_of(QuadrupedPart::foreleg) - lowest_of(QuadrupedPart::hindleg);
      const double slope = std::atan2(way.y, way.z);
      if (!(std::abs(slope) > 5 * std::numbers::pi / 180) || !(way.z > 0)) break;
      turn_by(rotation_matrix(Vec3d{slope, 0, 0}));
    }
    floor_ = std::numeric_limits<double>::infinity(), top_ = -floor_;
    for (const Vec3d p : points_) floor_ = std::min(floor_, p.y), top_ = std::max(top_, p.y);
  }

  /// Each leg downwards. A foot that is no child of its leg, as inverse kinematics wants it, comes after it.
  void sort_legs() {
    Joints all = of_part(QuadrupedPart::foreleg);
    const Joints hind = of_part(QuadrupedPart::hindleg), girdles = of_part(QuadrupedPart::girdle);
    for (const std::size_t r : girdles)
      if (places_[r].z > mean_of(hind).z) all.push_back(r);
    const double middle = (mean_of(all).x + mean_of(hind).x) / 2;
    for (std::size_t leg = 0; leg < 4; ++leg) {
      Joints& own = found_.legs[leg];
      for (const std::size_t r : leg < 2 ? all : hind)
        if ((places_[r].x > middle) == (leg % 2 == 0)) own.push_back(r);
      // Each part of it that hangs together by its first joint; the highest part first.
      std::map<std::size_t, std::size_t> first;
      for (const std::size_t r : own) {
        const std::size_t above = rig_.parents[r];
        first[r] = above != no_item && first.contains(above) ? first[above] : r;
      }
      std::map<std::size_t, double> heights;
      for (const std::size_t r : own) heights[first[r]] = std::max(heights[first[r]], places_[r].y - floor_);
      std::ranges::sort(own, [&](std::size_t a, std::size_t b) {
        const std::size_t x = first[a], y = first[b];
        return x != y ? heights[x] > heights[y] : std::pair(depth(a), a) < std::pair(depth(b), b);
      });
      // Of branches, toes, the first; the others go with it.
      std::erase_if(own, [&](std::size_t r) {
        return std::ranges::any_of(
            own, [&](std::size_t o) { return o < r && first[o] == first[r] && depth(o) == depth(r); });
      });
      if (own.size() < 2)
        fail(std::to_string(own.size()) + " joints of the " + leg_name(leg), "two or more of each leg");
      check_reach(leg);
      // What leads sideways ties the leg to the trunk.
      std::size_t& girdle = found_.girdles[leg];
      while (girdle + 2 < own.size()) {
        const Vec3d bone = places_[own[girdle + 1]] - places_[own[girdle]];
        if (parts_[own[girdle]] != QuadrupedPart::girdle && std::abs(bone.x) < 0.7 * length(bone)) break;
        ++girdle;
      }
    }
  }

  static std::string leg_name(std::size_t leg) {
    return std::string(leg % 2 == 0 ? "left " : "right ") + (leg < 2 ? "foreleg" : "hind leg");
  }
  /// Arms and wings, which others have for forelegs, end high above the ground.
  void check_reach(std::size_t leg) const {
    double low = top_;
    for (std::size_t v = 0; v < points_.size(); ++v)
      if (std::ranges::find(found_.legs[leg], most_[v]) != found_.legs[leg].end()) low = std::min(low, points_[v].y);
    const double share = (low - floor_) / (top_ - floor_);
    const bool stands = leg >= 2 || forelegs_stand_;
    if ((share > 0.15) == stands)
      fail("a " + leg_name(leg) + " that ends " + std::to_string(std::lround(100 * share)) +
               " % of the height above the ground",
           stands ? "legs that stand" : "arms that end above it, of an animal that walks on two legs");
  }

  double leg_z(std::size_t leg) const {
    return (places_[found_.legs[leg][found_.girdles[leg]]].z +
            places_[found_.legs[leg + 1][found_.girdles[leg + 1]]].z) /
           2;
  }
  double leg_y(std::size_t leg) const { return places_[found_.legs[leg][found_.girdles[leg]]].y; }

  /// The neck begins about above the forelegs: what comes before it is the trunk's, whatever its name.
  void find_neck() {
    const Joints heads = of_part(QuadrupedPart::head);
    found_.head = *std::ranges::min_element(heads, {}, [&](std::size_t r) { return depth(r); });
    const double fore = leg_z(0), trunk = fore - leg_z(2);
    if (!(places_[found_.head].z > fore - 0.15 * trunk) || !(trunk > 0))
      fail("a head ('" + rig_.joint_name(found_.head) + "') behind the forelegs", "a four-legged animal");
    for (std::size_t r = rig_.parents[found_.head]; r != no_item; r = rig_.parents[r]) {
      const QuadrupedPart part = parts_[r];
      if (places_[r].z < fore - 0.15 * trunk || part == QuadrupedPart::body || part == QuadrupedPart::trunk ||
          part == QuadrupedPart::foreleg || part == QuadrupedPart::hindleg || part == QuadrupedPart::head)
        break;
      found_.neck.insert(found_.neck.begin(), r);
      parts_[r] = QuadrupedPart::neck;
    }
    // Along the back: between the legs, and not below where they begin.
    const double low = std::min({leg_y(0), leg_y(2)});
    for (std::size_t r = 0; r < parts_.size(); ++r)
      if ((parts_[r] == QuadrupedPart::unknown || parts_[r] == QuadrupedPart::trunk) &&
          places_[r].z > leg_z(2) - 0.25 * trunk && places_[r].z < fore + 0.1 * trunk && places_[r].y > low &&
          mass_[r] > 0 && !is_below(r, found_.head))
        found_.back.push_back(r);
    std::ranges::sort(found_.back, {}, [&](std::size_t r) { return places_[r].z; });
  }

  void find_ears_and_tail() {
    const double middle = places_[found_.head].x;
    for (const std::size_t r : of_part(QuadrupedPart::ear)) found_.ears[places_[r].x > middle ? 0 : 1].push_back(r);
    found_.tail = of_part(QuadrupedPart::tail);
    for (Joints* chain : {&found_.ears[0], &found_.ears[1], &found_.tail})
      std::ranges::sort(*chain, {}, [&](std::size_t r) { return std::pair(depth(r), r); });
    // Of three or more the first may move the skull about the ear: a horse's has two thirds of what the others have, a
    // fox's, which is part of the ear, a third.
    double inner = 0, outer = 0;
    for (const Joints& ear : found_.ears)
      for (std::size_t i = 0; i < ear.size(); ++i) (i == 0 ? inner : outer) += mass_[ear[i]];
    for (Joints& ear : found_.ears) {
      if (ear.size() < 3 || inner < 0.5 * outer) continue;
      found_.skull.push_back(ear.front());
      ear.erase(ear.begin());
    }
    if (const Joints jaws = of_part(QuadrupedPart::jaw); !jaws.empty()) found_.jaw = jaws.front();
  }

  const Rig& rig_;
  bool forelegs_stand_;
  QuadrupedJoints found_;
  std::vector<Vec3d> points_, places_;  ///< in the scene's axes, then looking to +z
  std::vector<QuadrupedPart> parts_;
  std::vector<std::size_t> most_;               ///< [V] the joint with the greatest weight
  std::vector<double> mass_, lowest_, spread_;  ///< [joints] of the vertices that it moves most
  double floor_ = 0, top_ = 0;
};

}  // namespace rig::internal

/// forelegs_stand: whether animals are looked for that walk on four legs, or on two
inline QuadrupedJoints quadruped_joints(const Rig& rig, bool forelegs_stand = true) {
  return rig::internal::QuadrupedFinder(rig, forelegs_stand).take();
}

}  // namespace npt::inline NPT_ABI
