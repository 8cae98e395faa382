/// Arms kept out of a trunk that is in their way, and hands that touch what they touch in the source: the trunk, and
/// each other.
///   ArmClearance(retargeter, shapes, options, pose, frames).apply();
/// An arm that is in the way turns about its shoulder, so that its skin moves little. Points that are inside where the
/// skin was bound may stay as deep. Turns are smooth in time.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/matrix3.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/body/roles/joint_roles.hpp>
#include <npt/config.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/body_shape.hpp>
#include <npt/transfer/motion/joint_retargeter.hpp>
#include <npt/transfer/motion/limb_reach.hpp>
#include <npt/transfer/motion/posed_joints.hpp>
#include <npt/transfer/motion/posed_trunk.hpp>
#include <npt/transfer/motion/retarget_frames.hpp>
#include <npt/transfer/motion/retarget_side.hpp>
#include <npt/transfer/retarget_options.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

class ArmClearance {
 public:
  /// Keeps references.
  ArmClearance(const JointRetargeter& retargeter, const RetargetShapes& shapes, const RetargetOptions& options,
               PosedJoints& pose, RetargetFrames& frames)
      : from_(retargeter.source()),
        to_(retargeter.target()),
        across_(retargeter.across()),
        scale_(retargeter.scale()),
        shapes_(shapes),
        options_(options),
        pose_(pose),
        frames_(frames),
        source_trunk_(shapes.source, from_.worlds),
        trunk_(shapes.target, to_.worlds) {
    for (std::size_t side = 0; side < 2; ++side) {
      arms_[side].limb = limb(to_, side);
      trunk_.set(to_.worlds), source_trunk_.set(from_.worlds);
      if (!shapes.target.empty()) arms_[side].points = points(to_, shapes.target, trunk_, side);
      if (!shapes.source.empty()) arms_[side].source = points(from_, shapes.source, source_trunk_, side);
    }
  }

  void apply() {
    if (options_.touch && (hands_known() || !(shapes_.source.empty() || shapes_.target.empty())))
      pass([this](std::size_t f) { touch(f); });
    if (shapes_.target.empty() || !(options_.clearance > 0)) return;
    // Smoothing takes some of a correction away from its peak; what is left is found again. Arms are inside by 0.16 mm
    // in the mean after one pass, 0.085 after two and 0.082 after three (16 clips, 124 pairs with characters).
    for (int round = 0; round < 2; ++round)
      if (!pass([this](std::size_t f) { clear(f); })) return;
  }

 private:
  struct Point {
    std::size_t joint;
    Vec3d inside;    ///< in the joint's coordinates
    double allowed;  ///< how far out of the trunk it must be: negative: so deep it may be inside
    bool upper;      ///< above the elbow
  };
  struct Arm {
    LimbJoints limb;
    std::vector<Point> points, source;
  };
  struct Turns {
    Vec3d shoulder{}, elbow{}, hand{};
    friend Turns operator+(const Turns& a, const Turns& b) {
      return {a.shoulder + b.shoulder, a.elbow + b.elbow, a.hand + b.hand};
    }
    friend Turns operator*(const Turns& a, double s) { return {a.shoulder * s, a.elbow * s, a.hand * s}; }
    bool none() const { return std::max({length(shoulder), length(elbow), length(hand)}) < negligible; }
  };

  /// Where a rig has no hand, the finger that begins at its place.
  static LimbJoints limb(const RetargetSide& side_of_two, std::size_t side) {
    LimbJoints limb{side_of_two.roles.joint(LimbPart::upper_arm, side),
                    side_of_two.roles.joint(LimbPart::lower_arm, side),
                    side_of_two.roles.joint(LimbPart::hand, side),
                    {}};
    for (const std::size_t digit : {std::size_t{2}, std::size_t{1}, std::size_t{3}})
      if (limb.last == no_item) limb.last = side_of_two.roles.joint(digit_part(digit, 0), side);
    if (!limb.whole()) return limb;
    const auto [left, up, forward] = side_of_two.frame.columns();
    const Vec3d arm = side_of_two.worlds[limb.last].shift - side_of_two.worlds[limb.first].shift;
    limb.hinge = inverse(side_of_two.rotations[limb.first])(normalised(cross(arm, forward)));  // elbows bend forwards
    return limb;
  }

  static std::vector<Point> points(const RetargetSide& who, const BodyShape& shape, const PosedTrunk& trunk,
                                   std::size_t side) {
    std::vector<Point> made;
    for (const ArmPoint& point : shape.arms[side]) {
      const std::optional<TrunkPlace> place = trunk.find(point.place);
      const bool upper = who.roles.role_of(point.joint) == limb_role(LimbPart::upper_arm, side);
      made.push_back({point.joint, inverse(who.worlds[point.joint])(point.place),
                      std::min(place ? place->outside : 0.0, -point.slack), upper});
    }
    return made;
  }

  /// Runs `solve` on each frame, and takes the turns of shoulders, elbows and hands that it made, smoothed. False where
  /// it made none.
  template <class Solve>
  bool pass(const Solve& solve) {
    std::array<std::vector<Turns>, 2> turns;
    bool any = false;
    for (std::size_t f = 0; f < frames_.count(); ++f) {
      pose_.set(frames_.places[f]);
      solve(f);
      for (std::size_t side = 0; side < 2; ++side) {
        turns[side].push_back(arms_[side].limb.whole() ? turns_since(frames_.places[f], arms_[side].limb) : Turns{});
        any = any || !turns[side].back().none();
      }
    }
    if (!any) return false;
    for (std::vector<Turns>& own : turns) own = smoothed(own, frames_, smoothing_seconds);
    for (std::size_t f = 0; f < frames_.count(); ++f)
      for (std::size_t side = 0; side < 2; ++side) {
        const LimbJoints& limb = arms_[side].limb;
        const Turns& own = turns[side][f];
        if (!limb.whole() || own.none()) continue;
        std::vector<NodePlace>& places = frames_.places[f];
        places[limb.first].rotation = places[limb.first].rotation.turned(own.shoulder);
        places[limb.middle].rotation = places[limb.middle].rotation.turned(own.elbow);
        places[limb.last].rotation = places[limb.last].rotation.turned(own.hand);
      }
    return true;
  }
  Turns turns_since(const std::vector<NodePlace>& before, const LimbJoints& limb) const {
    const auto turn = [&](std::size_t joint) {
      const Quaternion &now = pose_.places()[joint].rotation, &then = before[joint].rotation;
      return now == then ? Vec3d{} : axis_angle(now * inverse(then));
    };
    return {turn(limb.first), turn(limb.middle), turn(limb.last)};
  }

  void clear(std::size_t frame) {
    trunk_.set(pose_.worlds());
    if (!shapes_.source.empty()) source_trunk_.set(frames_.sources[frame]);
    for (const Arm& arm : arms_) {
      if (!arm.limb.whole() || arm.points.empty()) continue;
      std::array<double, 2> theirs{};
      for (const bool upper : {false, true})
        if (const Deepest own = deepest(arm.source, source_trunk_, frames_.sources[frame], upper); own.depth > 0)
          theirs[upper ? 1 : 0] = own.depth * scale_;
      // 0.098 mm inside with one round, 0.082 with two and with six.
      for (int round = 0; round < 2; ++round) {
        bool moved = push(arm, true, theirs[1]);
        moved = push(arm, false, theirs[0]) || moved;
        if (!moved) break;
      }
    }
  }

  /// The point of an arm, above or below the elbow, that is deepest in the trunk.
  struct Deepest {
    double depth = 0;
    Vec3d place{}, out{};
  };
  static Deepest deepest(const std::vector<Point>& points, const PosedTrunk& trunk, const std::vector<Affine>& worlds,
                         bool upper) {
    Deepest most;
    for (const Point& point : points) {
      if (point.upper != upper) continue;
      const Vec3d p = worlds[point.joint](point.inside);
      const std::optional<TrunkPlace> place = trunk.find(p);
      if (place && point.allowed - place->outside > most.depth)
        most = {point.allowed - place->outside, p, place->normal};
    }
    return most;
  }

  /// Takes an arm's deepest point out of the trunk, but for as much as the source's arm is inside its own: the bone
  /// beneath it moves out, by the turn about the shoulder that moves the arm's skin least. A bent arm lifts its elbow
  /// and keeps its hand. Bones, since to move the skin's point would only roll thick arms.
  bool push(const Arm& arm, bool upper, double theirs) {
    const Deepest own = deepest(arm.points, trunk_, pose_.worlds(), upper);
    const double depth = std::min((own.depth - theirs) * options_.clearance, 0.5 * to_.leg());
    if (!(depth > negligible * to_.leg())) return false;
    const Vec3d shoulder = pose_.position(arm.limb.first), elbow = pose_.position(arm.limb.middle);
    const Vec3d begin = upper ? shoulder : elbow, end = upper ? elbow : pose_.position(arm.limb.last);
    const Vec3d lever = begin + (end - begin) * closest_on_segment(own.place, begin, end) - shoulder;
    const Vec3d axis = cross(lever, own.out);
    if (!(length(axis) > negligible * length(lever))) return true;
    Matrix3 inertia{};  // of the skin about the shoulder; a thousandth more: points on a bone have none about it
    for (const Point& point : arm.points) {
      const Vec3d p = pose_.world(point.joint)(point.inside) - shoulder;
      inertia += Matrix3::identity() * (1.001 * dot(p, p)) - outer(p, p);
    }
    const Vec3d turn = cofactors(inertia) * axis;  // but for its length
    const double angle = depth * length(turn) / dot(turn, axis);
    pose_.turn(arm.limb.first, Quaternion{}.turned(normalised(turn) * std::min(angle, 0.5)));
    return true;
  }

  /// A hand's ball in a pose; of a rig without skin about as large as people's.
  struct Hand {
    Vec3d centre{};
    double radius = 0;
  };
  Hand hand(const RetargetSide& who, const BodyShape& shape, std::size_t side,
            const std::vector<Affine>& worlds) const {
    const BodyHand& known = shape.hands[side];
    if (known.radius > 0) return {worlds[known.joint](inverse(who.worlds[known.joint])(known.centre)), known.radius};
    const std::size_t joint = who.roles.joint(LimbPart::hand, side);
    if (joint == no_item) return {};
    const std::size_t finger = who.roles.joint(digit_part(2, 0), side),
                      elbow = who.roles.joint(LimbPart::lower_arm, side);
    const Vec3d along = finger != no_item  ? worlds[finger].shift - worlds[joint].shift
                        : elbow != no_item ? (worlds[joint].shift - worlds[elbow].shift) * 0.5
                                           : Vec3d{};
    return {worlds[joint].shift + along, 0.05 * who.leg()};
  }
  bool hands_known() const {
    for (std::size_t side = 0; side < 2; ++side)
      if (hand(from_, shapes_.source, side, from_.worlds).radius == 0 ||
          hand(to_, shapes_.target, side, to_.worlds).radius == 0)
        return false;
    return true;
  }

  void touch(std::size_t frame) {
    const std::vector<Affine>& source = frames_.sources[frame];
    std::array<Hand, 2> theirs, own;
    for (std::size_t side = 0; side < 2; ++side) {
      theirs[side] = hand(from_, shapes_.source, side, source);
      own[side] = hand(to_, shapes_.target, side, pose_.worlds());
    }
    std::array<Vec3d, 2> ways{};
    if (!shapes_.source.empty() && !shapes_.target.empty()) {
      source_trunk_.set(source);
      trunk_.set(pose_.worlds());
      for (std::size_t side = 0; side < 2; ++side) ways[side] = to_trunk(theirs[side], own[side]);
    }
    if (theirs[0].radius > 0 && theirs[1].radius > 0 && own[0].radius > 0 && own[1].radius > 0) {
      const Vec3d way = to_other_hand(theirs, own, ways[1] - ways[0]);
      ways[0] = ways[0] - way * 0.5;
      ways[1] += way * 0.5;
    }
    for (std::size_t side = 0; side < 2; ++side)
      if (arms_[side].limb.whole() && length(ways[side]) > negligible)
        reach(pose_, arms_[side].limb, pose_.position(arms_[side].limb.last) + ways[side]);
  }

  /// How far from a touch counts as one in part: 6 cm of a person. Not tuned.
  double margin() const { return 0.075 * from_.leg(); }

  Vec3d to_trunk(const Hand& theirs, const Hand& own) const {
    if (theirs.radius == 0 || own.radius == 0) return {};
    const std::optional<TrunkPlace> place = source_trunk_.find(theirs.centre);
    if (!place) return {};
    // Near the ends of the trunk and near its axis places are not sure.
    const double ends = smooth_step(20 * std::min(place->along, 1 - place->along)),
                 gap = place->outside - theirs.radius;
    const double weight = smooth_step(1 - gap / margin()) * ends * smooth_step(2 * place->share);
    if (weight == 0) return {};
    const double outside = std::max(own.radius * std::min(1.0, place->outside / theirs.radius), 0.0);
    return (trunk_.point(*place, gap > 0 ? own.radius + gap * scale_ : outside) - own.centre) * weight;
  }
  /// By how much the right hand must come nearer than the left one. moved: what it does already
  Vec3d to_other_hand(const std::array<Hand, 2>& theirs, const std::array<Hand, 2>& own, Vec3d moved) const {
    const Vec3d between = across_(theirs[1].centre - theirs[0].centre);
    const double sum = theirs[0].radius + theirs[1].radius,
                 weight = smooth_step(1 - (length(between) - sum) / margin());
    const Vec3d wanted = between * ((own[0].radius + own[1].radius) / sum);
    return (wanted - (own[1].centre - own[0].centre + moved)) * weight;
  }

  const RetargetSide &from_, &to_;
  Quaternion across_;
  double scale_;
  const RetargetShapes& shapes_;
  const RetargetOptions& options_;
  PosedJoints& pose_;
  RetargetFrames& frames_;
  PosedTrunk source_trunk_, trunk_;
  std::array<Arm, 2> arms_{};
};

}  // namespace internal

}  // namespace npt::inline NPT_ABI
