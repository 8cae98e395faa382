/// Curves as glTF wants them: times that ascend, unit rotations, one key where the value stays the same.
/// Numerics  numbers stay the floats that they are, but for rotations whose length is off
/// Errors    npt::Error: times that descend or are negative, numbers that aren't finite or don't fit the times
/// Source    glTF 2.0 specification, section 3.11
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/config.hpp>
#include <npt/scene/clip.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI::internal {

inline void check_curve(const ClipChannel& c, const std::string& file, const std::string& place) {
  const auto fail = [&](const std::string& found, const std::string& expected) {
    throw Error({.file = file, .place = place, .found = found, .expected = expected});
  };
  if (c.width != (c.path == ChannelPath::rotation ? 4U : 3U) || c.path == ChannelPath::weights)
    fail("a curve that moves no joint", "translation, rotation or scale");
  const std::size_t numbers = c.times.size() * c.width * (c.interpolation == Interpolation::cubic ? 3 : 1);
  if (c.times.empty() || c.values.size() != numbers)
    fail(std::to_string(c.values.size()) + " numbers for " + std::to_string(c.times.size()) + " keys",
         std::to_string(std::max<std::size_t>(numbers, 1)));
  for (std::size_t k = 0; k < c.times.size(); ++k)
    if (!(std::isfinite(c.times[k]) && c.times[k] >= (k == 0 ? 0.0F : c.times[k - 1])))
      fail("key " + std::to_string(k) + " at " + std::to_string(c.times[k]) + " s", "times from 0 on that ascend");
  for (const float value : c.values)
    if (!std::isfinite(value)) fail("a number that isn't finite", "finite numbers");
}

/// Keys at one time are a jump there: glTF wants times that ascend, so the first stands a float earlier, others but the
/// last go.
inline ClipChannel with_ascending_times(const ClipChannel& c) {
  ClipChannel result = c;
  result.times.clear(), result.values.clear();
  const std::size_t row = c.values.size() / c.times.size();
  const auto add = [&](std::size_t key, float time) {
    result.times.push_back(time);
    const auto from = c.values.begin() + static_cast<std::ptrdiff_t>(key * row);
    result.values.insert(result.values.end(), from, from + static_cast<std::ptrdiff_t>(row));
  };
  for (std::size_t k = 0; k < c.times.size();) {
    std::size_t last = k;
    while (last + 1 < c.times.size() && c.times[last + 1] == c.times[k]) ++last;
    const float before = std::nextafter(c.times[k], -std::numeric_limits<float>::infinity());
    if (last > k && before >= 0 && (result.times.empty() || before > result.times.back())) add(k, before);
    add(last, c.times[k]);
    k = last + 1;
  }
  return result;
}

/// Requires a curve that check_curve passed.
inline ClipChannel written_curve(const ClipChannel& curve) {
  ClipChannel c = with_ascending_times(curve);
  if (c.is_constant()) {
    const auto first = c.values.begin() + (c.interpolation == Interpolation::cubic ? std::ptrdiff_t(c.width) : 0);
    c.values = std::vector<float>(first, first + static_cast<std::ptrdiff_t>(c.width));
    c.times.resize(1);
    c.interpolation = Interpolation::linear;
  }
  if (c.path != ChannelPath::rotation) return c;
  const bool cubic = c.interpolation == Interpolation::cubic;
  for (std::size_t i = cubic ? 4 : 0; i + 4 <= c.values.size(); i += cubic ? 12 : 4) {
    const auto v = [&](std::size_t n) { return static_cast<double>(c.values[i + n]); };
    const Quaternion q{v(0), v(1), v(2), v(3)};
    if (std::abs(dot(q, q) - 1) < 1e-5) continue;
    const Quaternion unit = normalised(q);
    c.values[i] = static_cast<float>(unit.x), c.values[i + 1] = static_cast<float>(unit.y);
    c.values[i + 2] = static_cast<float>(unit.z), c.values[i + 3] = static_cast<float>(unit.w);
  }
  return c;
}

}  // namespace npt::inline NPT_ABI::internal
