/// Feet that stand in the source move on the target as they do there, times the ratio of the legs: those that stand
/// still stand still, and what slides on purpose slides as far. No foot sinks below the ground that the source's don't
/// sink below.
///   FootLock(retargeter, pose, frames).apply();
/// A contact begins and ends over some frames. Hips rise and sink a little, so that legs keep their stretch.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/roles/joint_role.hpp>
#include <npt/config.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/motion/foot_contacts.hpp>
#include <npt/transfer/motion/joint_retargeter.hpp>
#include <npt/transfer/motion/limb_reach.hpp>
#include <npt/transfer/motion/posed_joints.hpp>
#include <npt/transfer/motion/retarget_frames.hpp>
#include <npt/transfer/motion/retarget_side.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

class FootLock {
 public:
  /// Keeps references.
  FootLock(const JointRetargeter& retargeter, PosedJoints& pose, RetargetFrames& frames)
      : from_(retargeter.source()),
        to_(retargeter.target()),
        across_(retargeter.across()),
        scale_(retargeter.scale()),
        pose_(pose),
        frames_(frames) {
    for (std::size_t side = 0; side < 2; ++side) {
      legs_[side].limb = leg_of(to_, side);
      if (!legs_[side].limb.whole() || from_.leg() == 0) continue;
      legs_[side].limb.hinge = inverse(to_.rotations[legs_[side].limb.first])(
          to_.frame.columns()[0]);  // the body's left: knees bend forwards
      for (const LimbPart part : {LimbPart::foot, LimbPart::toes}) {
        const std::size_t own = from_.roles.joint(part, side), other = to_.roles.joint(part, side);
        if (own != no_item && other != no_item) legs_[side].points.push_back({own, other, floor(own), {}, {}, {}});
      }
    }
  }

  void apply() {
    for (std::size_t side = 0; side < 2; ++side)
      for (Point& point : legs_[side].points)
        point.contacts = foot_contacts(frames_, point.source, from_.leg(), leg_of(from_, side), from_.worlds);
    find_feet();
    for (Leg& leg : legs_)
      if (!leg.points.empty()) plan(leg);
    place_hips();
    for (std::size_t f = 0; f < frames_.count(); ++f) correct(f);
  }

 private:
  static constexpr double most_shift = 0.1;  ///< of hips, in lengths of the leg

  static LimbJoints leg_of(const RetargetSide& who, std::size_t side) {
    return {who.roles.joint(LimbPart::upper_leg, side),
            who.roles.joint(LimbPart::lower_leg, side),
            who.roles.joint(LimbPart::foot, side),
            {}};
  }

  struct Point {
    std::size_t source, target;
    double floor;  ///< of the source: where it stands at rest, or in the clip
    std::vector<Contact> contacts;
    std::vector<Vec3d> plain;       ///< [frames] where the plain motion has it
    std::vector<Vec3d> ways;        ///< [frames] where it belongs, minus that
    std::vector<double> weights{};  ///< [frames] 1: stands
  };
  struct Leg {
    LimbJoints limb;
    std::vector<Point> points;  ///< the ankle first
    std::vector<Vec3d> ways;    ///< [frames] of the ankle
  };

  void find_feet() {
    for (std::size_t f = 0; f < frames_.count(); ++f) {
      pose_.set(frames_.places[f]);
      for (Leg& leg : legs_)
        for (Point& point : leg.points) point.plain.push_back(pose_.position(point.target));
    }
  }

  /// Where a point goes by the source's alone.
  Vec3d scaled(const Point& point, std::size_t frame) const {
    return across_(frames_.sources[frame][point.source].shift) * scale_;
  }
  /// The height at which it belongs: as far above where it is at rest as the source's, by the ratio of legs.
  double height(const Point& point, std::size_t frame) const {
    return to_.worlds[point.target].shift.y + scale_ * (frames_.sources[frame][point.source].shift.y - point.floor);
  }
  /// Where the rest hangs elsewhere, each point has a floor of its own: the lowest but a twentieth around the clip's
  /// ground. A captured walk has one foot's toes 4 cm lower than the other's.
  double floor(std::size_t joint) const {
    const double ground = from_.worlds[joint].shift.y + from_.ground;
    std::vector<double> heights;
    for (const std::vector<Affine>& worlds : frames_.sources)
      if (std::abs(worlds[joint].shift.y - ground) < from_.leg() / 4) heights.push_back(worlds[joint].shift.y);
    if (from_.ground == 0 || heights.empty()) return ground;
    const auto twentieth = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 20);
    std::nth_element(heights.begin(), twentieth, heights.end());
    return *twentieth;
  }

  void plan(Leg& leg) {
    hold(leg);
    for (Point& point : leg.points) blend(point);
    leg.ways.assign(frames_.count(), {});
    for (std::size_t f = 0; f < frames_.count(); ++f) {
      const Point& ankle = leg.points.front();
      Vec3d way = ankle.ways[f] * ankle.weights[f];
      if (leg.points.size() > 1) {
        const Point& toes = leg.points.back();
        way = way * (1 - toes.weights[f]) + toes.ways[f] * toes.weights[f];
      }
      leg.ways[f] = way + Vec3d{0, sunk(leg, f, way.y), 0};
    }
  }

  /// Contacts of ankle and toes that overlap are one stand: the later one begins where the earlier one has brought the
  /// foot, and together they move it as little as they can.
  void hold(Leg& leg) {
    struct Stand {
      std::size_t point;
      Contact* contact;
    };
    std::vector<Stand> stands;
    for (std::size_t p = 0; p < leg.points.size(); ++p) {
      leg.points[p].ways.assign(frames_.count(), {});
      leg.points[p].weights.assign(frames_.count(), 0);
      for (Contact& contact : leg.points[p].contacts) stands.push_back({p, &contact});
    }
    std::sort(stands.begin(), stands.end(), [](const Stand& a, const Stand& b) {
      return a.contact->first != b.contact->first ? a.contact->first < b.contact->first : a.point < b.point;
    });
    for (std::size_t begin = 0; begin < stands.size();) {
      std::size_t end = begin, last = stands[begin].contact->last;
      while (end < stands.size() && stands[end].contact->first <= last + 1)
        last = std::max(last, stands[end].contact->last), ++end;
      Vec3d sum{};
      std::size_t count = 0;
      for (std::size_t s = begin; s < end; ++s) {
        Point& point = leg.points[stands[s].point];
        const Point& other = leg.points[leg.points.size() - 1 - stands[s].point];
        auto& [first, behind, joins] = *stands[s].contact;
        joins = s > begin && other.weights[first] > 0;
        const Vec3d offset = point.plain[first] - scaled(point, first) + (joins ? other.ways[first] : Vec3d{});
        for (std::size_t f = first; f <= behind; ++f, ++count) {
          point.ways[f] = scaled(point, f) + offset - point.plain[f];
          point.ways[f].y = height(point, f) - point.plain[f].y;
          point.weights[f] = 1;
          sum += point.ways[f];
        }
      }
      const Vec3d mean = sum / static_cast<double>(count);
      for (std::size_t s = begin; s < end; ++s)
        for (std::size_t f = stands[s].contact->first; f <= stands[s].contact->last; ++f)
          leg.points[stands[s].point].ways[f] += Vec3d{-mean.x, 0, -mean.z};
      begin = end;
    }
  }

  /// Weights beside the contacts; there the way is that of the contact's end. One that joins needs none before it.
  void blend(Point& point) const {
    const std::vector<Contact> contacts = point.contacts;
    const auto at = [&](std::size_t f, std::size_t end) {
      return smooth_step(1 - std::abs(frames_.time(f) - frames_.time(end)) / smoothing_seconds);
    };
    for (std::size_t f = 0; f < frames_.count(); ++f) {
      if (point.weights[f] == 1) continue;
      Vec3d sum{};
      double weights = 0, most = 0;
      for (const Contact& c : contacts)
        for (const std::size_t end : {c.first, c.last}) {
          const bool beside = end == c.first ? f < c.first : f > c.last;
          const double weight = beside && !(c.joins && end == c.first) ? at(f, end) : 0;
          sum += point.ways[end] * weight;
          weights += weight;
          most = std::max(most, weight);
        }
      if (weights == 0) continue;
      point.ways[f] = sum / weights;
      point.weights[f] = most;
    }
  }

  /// How much higher a foot must be so that none of its points is lower than the source's, and below where it stands.
  double sunk(const Leg& leg, std::size_t frame, double up) const {
    double most = 0;
    for (const Point& point : leg.points) {
      const double floor = std::min(to_.worlds[point.target].shift.y, height(point, frame));
      most = std::max(most, floor - (point.plain[frame].y + up));
    }
    return most;
  }

  /// Of the points of a foot, how much it stands.
  static double standing(const Leg& leg, std::size_t frame) {
    double most = 0;
    for (const Point& point : leg.points) most = std::max(most, point.weights[frame]);
    return most;
  }

  /// How much higher hips must be so that a foot at its place is so far from them.
  struct Span {
    double aside = 0, above = 0;  ///< of the hip joint, from where the foot belongs
    double rise(double distance) const {
      return aside < distance ? std::sqrt(distance * distance - aside * aside) - above : -above;
    }
  };
  Span span(const Leg& leg, std::size_t frame) const {
    const Vec3d hip = pose_.position(leg.limb.first), goal = pose_.position(leg.limb.last) + leg.ways[frame];
    return {std::hypot(goal.x - hip.x, goal.z - hip.z), hip.y + raised_[frame] - goal.y};
  }

  /// Legs that stand keep their stretch as far as hips can see to it for both: 3 mm of a leg's length bend its knee by
  /// 10 degrees. Straight knees of five captured clips are bent by 8.0 degrees in the mean on bodies with wide hips and
  /// short legs; by 8.8 without this. And where a leg can't reach, hips sink.
  void place_hips() {
    raised_.assign(frames_.count(), 0);
    if (to_.roles.joint(JointRole::hips) == no_item) return;
    std::vector<double> shifts(frames_.count()), sinks(frames_.count());
    for_legs([&](std::size_t f, const Leg& leg, double whole, double stretch) {
      const Span own = span(leg, f);
      const double other = standing(legs_[&leg == &legs_[0] ? 1 : 0], f), weight = standing(leg, f);
      if (weight > 0 && own.above > 0.3 * whole && own.aside < stretch)
        shifts[f] += std::clamp(own.rise(stretch), -most_shift * whole, most_shift * whole) * weight /
                     std::max(1.0, weight + other);
    });
    raised_ = smoothed(shifts, frames_, smoothing_seconds);
    for_legs([&](std::size_t f, const Leg& leg, double whole, double stretch) {
      const Span own = span(leg, f);
      const double most = std::max((1 - soft_share) * whole, stretch);
      if (own.aside < most && own.above * own.above + own.aside * own.aside > most * most && own.above > 0)
        sinks[f] = std::max(sinks[f], standing(leg, f) * std::min(most_shift * whole, -own.rise(most)));
    });
    sinks = smoothed(widened(sinks), frames_, smoothing_seconds);
    for (std::size_t f = 0; f < sinks.size(); ++f) raised_[f] -= sinks[f];
  }
  template <class Use>
  void for_legs(const Use& use) {
    for (std::size_t f = 0; f < frames_.count(); ++f) {
      pose_.set(frames_.places[f]);
      for (const Leg& leg : legs_)
        if (!leg.points.empty())
          use(f, leg, limb_length(pose_.worlds(), leg.limb), limb_reached(pose_.worlds(), leg.limb));
    }
  }
  /// The largest of the frames around each.
  std::vector<double> widened(const std::vector<double>& values) const {
    std::vector<double> most = values;
    for (std::size_t f = 0; f < values.size(); ++f)
      for (std::size_t k = f; k < values.size() && frames_.time(k) - frames_.time(f) < smoothing_seconds; ++k) {
        most[f] = std::max(most[f], values[k]);
        most[k] = std::max(most[k], values[f]);
      }
    return most;
  }

  void correct(std::size_t frame) {
    pose_.set(frames_.places[frame]);
    const std::size_t hips = to_.roles.joint(JointRole::hips);
    std::array<Vec3d, 2> goals{};
    for (std::size_t side = 0; side < 2; ++side)
      if (!legs_[side].points.empty()) goals[side] = pose_.position(legs_[side].limb.last) + legs_[side].ways[frame];
    if (hips != no_item && raised_[frame] != 0) pose_.move(hips, {0, raised_[frame], 0});
    for (std::size_t side = 0; side < 2; ++side)
      if (!legs_[side].points.empty() && length(goals[side] - pose_.position(legs_[side].limb.last)) > negligible)
        reach(pose_, legs_[side].limb, goals[side]);
    frames_.places[frame] = pose_.places();
  }

  const RetargetSide &from_, &to_;
  Quaternion across_;
  double scale_;
  PosedJoints& pose_;
  RetargetFrames& frames_;
  std::array<Leg, 2> legs_{};
  std::vector<double> raised_;  ///< [frames] the hips, in metres
};

}  // namespace internal

}  // namespace npt::inline NPT_ABI
