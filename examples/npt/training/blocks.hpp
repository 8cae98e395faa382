/// Bodies whose parts are boxes: robots, and figures made of cubes.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <training/surface_cloud.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace npt::inline NPT_ABI {

namespace data {

/// Moves a resting point to the box about its part: from round parts across their longest side, which is where tubes
/// lead on to the next part, from others to all sides. normal: of the box's face.
inline void put_on_block(const SurfaceCloud::Block& block, Vec3f& at, Vec3f& normal) {
  const Vec3f centre = (block.low + block.high) * 0.5F, half = (block.high - block.low) * 0.5F;
  std::array<float, 3> off{at.x - centre.x, at.y - centre.y, at.z - centre.z};
  const std::array<float, 3> size{half.x, half.y, half.z};
  const auto longest = static_cast<std::size_t>(std::ranges::max_element(size) - size.begin());
  const bool tube = size[longest] > 1.6F * std::max(size[(longest + 1) % 3], size[(longest + 2) % 3]);
  std::size_t face = 3;
  float most = 1e-6F;
  for (std::size_t k = 0; k < 3; ++k) {
    if ((tube && k == longest) || !(size[k] > 0)) continue;
    if (const float share = std::abs(off[k]) / size[k]; share > most) most = share, face = k;
  }
  if (face == 3) return;
  std::array<float, 3> out{};
  out[face] = off[face] < 0 ? -1.0F : 1.0F;
  for (std::size_t k = 0; k < 3; ++k)
    if (!tube || k != longest) off[k] /= most;
  at = centre + Vec3f{off[0], off[1], off[2]};
  normal = {out[0], out[1], out[2]};
}

}  // namespace data

}  // namespace npt::inline NPT_ABI
