/// Animation clips: what moves over time, and its values between the keys.
/// Source    glTF 2.0 specification, section 3.11 and appendix C
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

enum class Interpolation { step, linear, cubic };
enum class ChannelPath { translation, rotation, scale, weights };

/// One moving quantity of one node.
/// Invariants  times: at least one, ascending, finite. values: `width` numbers a key; cubic: three times as many, each
///             key's in-tangents, values and out-tangents. width: 3, for rotations 4, for weights the mesh's targets
struct ClipChannel {
  std::size_t node = 0;
  ChannelPath path = ChannelPath::translation;
  Interpolation interpolation = Interpolation::linear;
  std::size_t width = 3;
  std::vector<float> times{};  ///< seconds
  std::vector<float> values{};

  /// The value at a time, before the first and behind the last key that key's. Rotations come with length 1.
  /// value: [width]
  void sample(double time, std::span<double> value) const {
    const auto behind =
        static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), time,
                                                  [](double t, float key) { return t < static_cast<double>(key); }) -
                                 times.begin());
    if (behind == 0 || behind == times.size()) {
      take(behind == 0 ? 0 : behind - 1, value);
      return;
    }
    const std::size_t k = behind - 1;
    const double from = static_cast<double>(times[k]), span = static_cast<double>(times[behind]) - from;
    const double t = span > 0 ? (time - from) / span : 0;
    if (interpolation == Interpolation::step || t == 0)
      take(k, value);
    else if (interpolation == Interpolation::cubic)
      hermite(k, t, span, value);
    else
      between(k, t, value);
  }

  /// Whether it has one value at all times.
  bool is_constant() const {
    const bool cubic = interpolation == Interpolation::cubic;
    const std::size_t row = width * (cubic ? 3 : 1);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const bool tangent = cubic && i % row / width != 1;
      if (tangent ? values[i] != 0 && times.size() > 1 : values[i] != values[i % row]) return false;
    }
    return true;
  }

 private:
  /// Number c of key k; part 0, 1, 2: in-tangent, value, out-tangent.
  double at(std::size_t k, std::size_t c, std::size_t part) const {
    return static_cast<double>(interpolation == Interpolation::cubic ? values[(3 * k + part) * width + c]
                                                                     : values[k * width + c]);
  }
  void take(std::size_t k, std::span<double> value) const {
    for (std::size_t c = 0; c < width; ++c) value[c] = at(k, c, 1);
    normalise(value);
  }
  void between(std::size_t k, double t, std::span<double> value) const {
    if (path == ChannelPath::rotation) {
      const auto key = [&](std::size_t i) {
        return normalised(Quaternion{at(i, 0, 1), at(i, 1, 1), at(i, 2, 1), at(i, 3, 1)});
      };
      const Quaternion q = slerp(key(k), key(k + 1), t);
      value[0] = q.x, value[1] = q.y, value[2] = q.z, value[3] = q.w;
      return;
    }
    for (std::size_t c = 0; c < width; ++c) value[c] = at(k, c, 1) + (at(k + 1, c, 1) - at(k, c, 1)) * t;
  }
  void hermite(std::size_t k, double t, double span, std::span<double> value) const {
    const double t2 = t * t, t3 = t2 * t;
    for (std::size_t c = 0; c < width; ++c)
      value[c] = (2 * t3 - 3 * t2 + 1) * at(k, c, 1) + span * (t3 - 2 * t2 + t) * at(k, c, 2) +
                 (3 * t2 - 2 * t3) * at(k + 1, c, 1) + span * (t3 - t2) * at(k + 1, c, 0);
    normalise(value);
  }
  void normalise(std::span<double> value) const {
    if (path != ChannelPath::rotation) return;
    const Quaternion q = normalised(Quaternion{value[0], value[1], value[2], value[3]});
    value[0] = q.x, value[1] = q.y, value[2] = q.z, value[3] = q.w;
  }
};

/// Of clips in files, in seconds: a few bytes can ask for any number of frames.
inline constexpr double longest_clip = 4 * 3600;

/// A named animation.
struct Clip {
  std::string name;
  std::vector<ClipChannel> channels;

  /// Seconds, to the last key.
  double length() const {
    double end = 0;
    for (const ClipChannel& channel : channels) end = std::max(end, static_cast<double>(channel.times.back()));
    return end;
  }
};

/// The times of a clip's frames at a rate: 0, 1 / rate, ... to its end.
inline std::vector<double> frame_times(const Clip& clip, double rate) {
  // A clip whose length is a whole number of frames has its last frame, however its float was rounded.
  const auto last = static_cast<std::size_t>(std::floor(clip.length() * rate + 1e-4));
  std::vector<double> times(last + 1);
  for (std::size_t i = 0; i <= last; ++i) times[i] = static_cast<double>(i) / rate;
  return times;
}

}  // namespace npt::inline NPT_ABI
