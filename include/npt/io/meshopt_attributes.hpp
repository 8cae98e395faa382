/// The mode ATTRIBUTES of EXT_meshopt_compression: rows of bytes as differences from the row before, column by column.
/// Errors    npt::Error for bytes that end early or are too many
/// Source    Khronos, EXT_meshopt_compression, appendix A, mode 0
#pragma once

#include <npt/config.hpp>
#include <npt/io/meshopt_input.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace npt::inline NPT_ABI::internal {

inline constexpr std::size_t meshopt_group = 16;

/// 16 differences, of 0, 2, 4 or 8 bits each. What doesn't fit into 2 or 4 bits has all of them set and stands behind.
inline std::array<std::uint8_t, meshopt_group> meshopt_differences(MeshoptInput& input, unsigned mode) {
  std::array<std::uint8_t, meshopt_group> result{};
  if (mode == 0) return result;
  const unsigned bits = 1U << mode, most = (1U << bits) - 1, per_byte = 8 / bits;
  const std::string_view packed = input.take(meshopt_group / per_byte);
  for (unsigned i = 0; i < meshopt_group; ++i) {
    const auto byte = static_cast<unsigned char>(packed[i / per_byte]);
    result[i] = static_cast<std::uint8_t>((byte >> (8 - bits - bits * (i % per_byte))) & most);
    if (mode != 3 && result[i] == most) result[i] = input.byte();
  }
  return result;
}

/// Requires count and stride > 0.
inline std::string decode_meshopt_attributes(MeshoptInput input, std::size_t count, std::size_t stride) {
  constexpr std::size_t least_tail = 32, most_bytes = 8192, most_rows = 256;
  const std::string_view tail = input.take_tail(std::max(least_tail, stride));
  std::string last(tail.substr(tail.size() - stride));
  std::string result(count * stride, '\0');
  const std::size_t block_rows = std::min(most_bytes / stride & ~(meshopt_group - 1), most_rows);
  for (std::size_t row = 0; row < count; row += block_rows) {
    const std::size_t rows = std::min(block_rows, count - row), groups = (rows + meshopt_group - 1) / meshopt_group;
    for (std::size_t column = 0; column < stride; ++column) {
      const std::string_view modes = input.take((groups + 3) / 4);
      auto value = static_cast<std::uint8_t>(last[column]);
      for (std::size_t g = 0; g < groups; ++g) {
        const unsigned four_modes = static_cast<unsigned char>(modes[g / 4]);
        const auto differences = meshopt_differences(input, four_modes >> (2 * (g % 4)) & 3U);
        const std::size_t first = g * meshopt_group, used = std::min(meshopt_group, rows - first);
        for (std::size_t i = 0; i < used; ++i) {
          const unsigned d = differences[i];
          value = static_cast<std::uint8_t>(value + ((d & 1U) != 0 ? ~(d >> 1) : d >> 1));
          result[(row + first + i) * stride + column] = static_cast<char>(value);
        }
      }
      last[column] = static_cast<char>(value);
    }
  }
  input.expect_end();
  return result;
}

}  // namespace npt::inline NPT_ABI::internal
