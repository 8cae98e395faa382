/// The frames of a motion that is being put on another skeleton: where the source's joints are, and the target's in
/// their parents. What corrects the motion reads the one and changes the other.
#pragma once

#include <npt/base/affine.hpp>
#include <npt/config.hpp>
#include <npt/scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// Within which corrections begin, end and are smoothed: 3 frames at 30 a second. In five captured clips on four bodies
/// feet that are held within 2 frames kink a knee by 52 degrees instead of 32; within 8 straight knees bend by 0.7
/// degrees more.
inline constexpr double smoothing_seconds = 0.1;

struct RetargetFrames {
  std::vector<float> times{};
  std::vector<std::vector<Affine>> sources{};    ///< [frames][joints of the source] in metres with y up
  std::vector<std::vector<NodePlace>> places{};  ///< [frames][joints of the target] in their parents
  std::vector<std::array<bool, 2>> moving{};     ///< [joints of the target] rotation, translation

  std::size_t count() const { return times.size(); }
  double time(std::size_t frame) const { return static_cast<double>(times[frame]); }

  /// After corrections: a joint also moves where its places differ.
  void find_moving() {
    for (const std::vector<NodePlace>& now : places)
      for (std::size_t j = 0; j < now.size(); ++j) {
        if (!(now[j].rotation == places.front()[j].rotation)) moving[j][0] = true;
        if (!(now[j].translation == places.front()[j].translation)) moving[j][1] = true;
      }
  }
};

/// 0 for 0 and below, 1 for 1 and above, with level ends.
inline double smooth_step(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// A weighted mean over time, by a bell that ends `reach` seconds away; ends count as if they went on.
template <class T>
std::vector<T> smoothed(const std::vector<T>& values, const RetargetFrames& frames, double reach) {
  std::vector<T> means(values.size());
  for (std::size_t f = 0; f < values.size(); ++f) {
    T sum = values[f];
    double weights = 1;
    for (const bool later : {false, true})
      for (std::size_t k = 1; k < values.size(); ++k) {
        const bool there = later ? f + k < values.size() : k <= f;
        const std::size_t other = later ? std::min(f + k, values.size() - 1) : f - std::min(k, f);
        // Behind an end time goes on in steps as the last one.
        const double step =
            values.size() < 2 ? 1
                              : frames.time(later ? values.size() - 1 : 1) - frames.time(later ? values.size() - 2 : 0);
        const double past = there ? 0 : step * static_cast<double>(later ? f + k + 1 - values.size() : k - f);
        const double off = (std::abs(frames.time(other) - frames.time(f)) + past) / reach;
        if (!(off < 1)) break;
        const double weight = (1 - off * off) * (1 - off * off);
        sum = sum + values[other] * weight;
        weights += weight;
      }
    means[f] = sum * (1 / weights);
  }
  return means;
}

}  // namespace internal

}  // namespace npt::inline NPT_ABI
