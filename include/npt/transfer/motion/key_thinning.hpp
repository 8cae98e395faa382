/// Keys that linear interpolation brings back are left out.
///   thin_keys(channel, tolerance);   of rotations: radians; of translations: their own unit
/// Keys that stay keep their times and values; the first and the last always do.
/// Source    Ramer 1972, Douglas and Peucker 1973: the key farthest off stays, and both halves go on
#pragma once

#include <npt/base/quaternion.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

class KeyThinner {
 public:
  KeyThinner(const ClipChannel& channel, double tolerance) : channel_(channel), tolerance_(tolerance) {}

  ClipChannel thinned() const {
    const std::size_t count = channel_.times.size();
    std::vector<bool> kept(count);
    kept.front() = kept.back() = true;
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, count - 1}};
    while (!open.empty()) {
      const auto [first, last] = open.back();
      open.pop_back();
      double most = tolerance_;
      std::size_t worst = 0;
      for (std::size_t k = first + 1; k < last; ++k)
        if (const double off = distance(first, k, last); off > most) most = off, worst = k;
      if (worst == 0) continue;
      kept[worst] = true;
      open.emplace_back(first, worst);
      open.emplace_back(worst, last);
    }
    // A curve that stays where it is needs one key.
    if (std::count(kept.begin(), kept.end(), true) == 2 && distance(0, count - 1, 0) <= tolerance_) kept.back() = false;
    return with(kept);
  }

 private:
  ClipChannel with(const std::vector<bool>& kept) const {
    ClipChannel thin{channel_.node, channel_.path, channel_.interpolation, channel_.width, {}, {}};
    for (std::size_t k = 0; k < kept.size(); ++k) {
      if (!kept[k]) continue;
      thin.times.push_back(channel_.times[k]);
      for (std::size_t c = 0; c < channel_.width; ++c) thin.values.push_back(channel_.values[k * channel_.width + c]);
    }
    return thin;
  }

  double at(std::size_t k, std::size_t c) const { return static_cast<double>(channel_.values[k * channel_.width + c]); }
  Quaternion rotation(std::size_t k) const { return normalised(Quaternion{at(k, 0), at(k, 1), at(k, 2), at(k, 3)}); }

  /// Of key k from what is between two others at its time.
  double distance(std::size_t first, std::size_t k, std::size_t last) const {
    const double from = static_cast<double>(channel_.times[first]),
                 span = static_cast<double>(channel_.times[last]) - from;
    const double t = span > 0 ? (static_cast<double>(channel_.times[k]) - from) / span : 0;
    if (channel_.path == ChannelPath::rotation)
      return length(axis_angle(inverse(slerp(rotation(first), rotation(last), t)) * rotation(k)));
    double sum = 0;
    for (std::size_t c = 0; c < channel_.width; ++c) {
      const double off = at(first, c) + (at(last, c) - at(first, c)) * t - at(k, c);
      sum += off * off;
    }
    return std::sqrt(sum);
  }

  const ClipChannel& channel_;
  double tolerance_;
};

}  // namespace internal

/// Requires  a linear channel, of rotations with neighbours on one side (no negative product)
inline void thin_keys(ClipChannel& channel, double tolerance) {
  if (channel.times.size() > 1) channel = internal::KeyThinner(channel, tolerance).thinned();
}

}  // namespace npt::inline NPT_ABI
