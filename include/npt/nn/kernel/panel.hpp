/// How activations lie in memory.
///
/// A tile holds C channels of one group of vertices as [panel][C][panel_width]: SIMD runs over vertices, so that odd
/// channel counts (1027, 513) cost no lanes, norms and modulation are lane-wise, and one stage's output is the next
/// one's operand. A panel is two registers wide. A group is what one task carries through a stage: its tile of 1027
/// channels (394 KB in fp32) stays in the second-level cache while all weights pass by once.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/simd/batch.hpp>

#include <cstddef>
#include <type_traits>

namespace npt::inline NPT_ABI::kernel {

/// Registers side by side in a panel, and so in a register tile of the micro-kernel.
inline constexpr int panel_registers = 2;

/// Vertices in a panel: 32 with AVX-512, 16 with AVX2, 8 with SSE (fp32).
template <class T>
inline constexpr int panel_width = panel_registers* simd::lanes<T>;

/// Vertices in a group, a multiple of every panel width.
inline constexpr int group_width = 96;

template <class T>
inline constexpr int group_panels = group_width / panel_width<T>;

/// Groups that V vertices need.
constexpr int group_count(int vertices) { return (vertices + group_width - 1) / group_width; }

/// Panels of a group that hold at least one of its `valid` vertices.
template <class T>
constexpr int used_panels(int valid) {
  return (valid + panel_width<T> - 1) / panel_width<T>;
}

/// Elements of a tile of C channels.
constexpr std::size_t tile_size(int channels) { return static_cast<std::size_t>(channels) * group_width; }

/// Elements from one panel of a tile to the next.
template <class T>
constexpr std::size_t panel_stride(int channels) {
  return static_cast<std::size_t>(channels) * panel_width<T>;
}

/// Elements from the start of a row to its register `half` in panel p of a tile.
template <class T>
NPT_ALWAYS_INLINE std::size_t register_offset(std::size_t stride, int p, int half) {
  return stride * static_cast<std::size_t>(p) + static_cast<std::size_t>(half * simd::lanes<T>);
}

/// Copies `valid` vertices of interleaved [V, channels] values into a tile; the rest becomes zero. Three channels, as
/// nearly all inputs have, are a loop of their own, which saves a small network (bottleneck 64) 0.3 % of its
/// instructions.
template <class T>
void split_vertices(const T* values, int channels, int valid, T* tile) {
  const auto split = [&](auto count) {
    constexpr int width = panel_width<T>;
    for (int v = 0; v < group_width; ++v) {
      T* out = tile + panel_stride<T>(count) * static_cast<std::size_t>(v / width) + v % width;
      for (int c = 0; c < count; ++c) out[c * width] = v < valid ? values[count * v + c] : T(0);
    }
  };
  channels == 3 ? split(std::integral_constant<int, 3>()) : split(channels);
}

/// The inverse: a tile to `valid` interleaved vertices.
template <class T>
void join_vertices(const T* tile, int channels, int valid, T* values) {
  const auto join = [&](auto count) {
    constexpr int width = panel_width<T>;
    for (int v = 0; v < valid; ++v) {
      const T* in = tile + panel_stride<T>(count) * static_cast<std::size_t>(v / width) + v % width;
      for (int c = 0; c < count; ++c) values[count * v + c] = in[c * width];
    }
  };
  channels == 3 ? join(std::integral_constant<int, 3>()) : join(channels);
}

}  // namespace npt::inline NPT_ABI::kernel
