/// When a foot stands: its ankle and its toes, each alone, since a heel lifts before its toes do.
///   std::vector<Contact> contacts = foot_contacts(frames, ankle, leg);
/// A point stands while it is low and slow, by thresholds in lengths of the leg; it must be lower and slower to begin
/// than to go on.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/transfer/motion/limb_reach.hpp>
#include <npt/transfer/motion/retarget_frames.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// Frames first .. last.
struct Contact {
  std::size_t first = 0, last = 0;
  bool joins = false;  ///< begins while the foot's other point stands
};

/// Lengths of the leg a second: the slower of the ways to the frames before and behind, so that a contact has its first
/// and last frames; without them feet of wide bodies slide 1.4 to 2.5 times as fast as the source's instead of 1 to 1.4.
/// These frames are at least a thirtieth of a second away, or else keys of fast capture would be judged by their noise.
inline std::vector<double> joint_speeds(const RetargetFrames& frames, std::size_t joint, double leg) {
  constexpr double least_time = 0.032;
  std::vector<double> speeds(frames.count());
  for (std::size_t f = 0; f < speeds.size(); ++f) {
    std::size_t before = f, behind = f;
    while (before > 0 && frames.time(f) - frames.time(before) < least_time) --before;
    while (behind + 1 < speeds.size() && frames.time(behind) - frames.time(f) < least_time) ++behind;
    double slower = std::numeric_limits<double>::infinity();
    for (const std::size_t other : {before, behind})
      if (const double time = std::abs(frames.time(other) - frames.time(f)); time > 0)
        slower = std::min(slower,
                          length(frames.sources[other][joint].shift - frames.sources[f][joint].shift) / (time * leg));
    speeds[f] = std::isfinite(slower) ? slower : 0;
  }
  return speeds;
}

/// limb: the leg's joints; bound: [joints] at rest. A foot doesn't stand while makers of cartoons draw its leg out to
/// the ground: one that keeps its length would pull the hips down, by 5 % of the height between monsters in a jump.
inline std::vector<Contact> foot_contacts(const RetargetFrames& frames, std::size_t joint, double leg,
                                          const LimbJoints& limb, const std::vector<Affine>& bound) {
  // In lengths of the leg: 0.25 a second are 20 cm/s of a person. In five captured clips on four bodies feet slide
  // 4.0 cm/s (the source's 2.6); with half of the speeds 4.9, with twice of them 3.5, but the sharpest kink of a knee
  // is 41 degrees instead of 32 then. Heights aren't tuned.
  constexpr double slow = 0.25, low = 0.05;
  std::vector<Contact> contacts;
  const std::vector<double> speeds = joint_speeds(frames, joint, leg);
  std::vector<double> heights;
  for (const std::vector<Affine>& worlds : frames.sources) heights.push_back(worlds[joint].shift.y / leg);
  std::vector<double> sorted = heights;
  // The lowest but a twentieth: a foot that is drawn under the ground once is no floor.
  const auto twentieth = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 20);
  std::nth_element(sorted.begin(), twentieth, sorted.end());
  const double floor = *twentieth;
  bool stands = false;
  for (std::size_t f = 0; f < frames.count(); ++f) {
    const double height = heights[f] - floor;
    const bool before = stands;
    const bool drawn = limb.whole() && limb_reached(frames.sources[f], limb) > 1.01 * limb_length(bound, limb);
    stands = !drawn && (stands ? speeds[f] < 2 * slow && height < 2 * low : speeds[f] < slow && height < low);
    if (stands && !before) contacts.push_back({f, f, false});
    if (stands) contacts.back().last = f;
  }
  return contacts;
}

}  // namespace internal

}  // namespace npt::inline NPT_ABI
