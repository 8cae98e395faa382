/// Numbers as a page holds them: differences folded to be small, their bytes in planes, deflated, as base64. page.js
/// decodes them.
#pragma once

#include <npt/base/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace view {

using npt::Vec3f;

/// A box around points; of none, from 0 to 0.
struct Box {
  Vec3f low, high;
};
Box box_of(std::span<const std::vector<Vec3f>> frames);

/// Positions in 65536 steps a side of `box`: of the first frame the differences from vertex to vertex, of the others
/// from frame to frame, modulo 2^16. [frames][2 planes][V][3] bytes
std::string encode_positions(std::span<const std::vector<Vec3f>> frames, const Box& box);

/// Differences from index to index in `planes` bytes each, as many as the largest one needs: 1 .. 5. [planes][N] bytes
struct EncodedIndices {
  std::string bytes;
  int planes = 1;
};
EncodedIndices encode_indices(std::span<const std::uint32_t> indices);

/// Values from 0 to `high` in 65536 steps; what isn't finite is `high`. [frames][2 planes][N] bytes
std::string encode_values(std::span<const std::vector<double>> frames, double high);

/// RFC 4648, section 4: with padding, without line ends.
std::string base64(std::string_view bytes);

}  // namespace view
