/// Orders of vertices: undoing one, and an order derived from the coordinates alone. permute.hpp applies one to a mesh.
/// An order is read as order[new position] = old vertex.
/// Shapes    xyz: [V, 3] floats, row major
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/base/sort.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace npt::inline NPT_ABI {

/// The order that undoes `order`: inverse[old vertex] = new position. Throws npt::Error unless `order` holds each of
/// 0 .. V - 1 once.
NPT_INLINE std::vector<std::uint32_t> inverse_order(std::span<const std::uint32_t> order) {
  std::vector<std::uint32_t> inverse(order.size(), no_index);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::uint32_t old = order[i];
    if (old >= order.size() || inverse[old] != no_index)
      throw Error({.file = "vertex order",
                   .place = "entry " + std::to_string(i),
                   .found = std::to_string(old) + (old < order.size() ? " for the second time" : ""),
                   .expected = "each number below " + std::to_string(order.size()) + " once"});
    inverse[old] = static_cast<std::uint32_t>(i);
  }
  return inverse;
}

namespace internal {

/// A number whose unsigned order is the order of the float's values; NaN beyond the infinities, so the order is total.
NPT_INLINE std::uint32_t order_key(float x) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
  return bits & 0x80000000U ? ~bits : bits | 0x80000000U;
}

/// Point v by value: -0 is 0.
NPT_INLINE std::array<std::uint32_t, 3> value_key(std::span<const float> xyz, std::size_t v) {
  return {order_key(xyz[3 * v] + 0.0F), order_key(xyz[3 * v + 1] + 0.0F), order_key(xyz[3 * v + 2] + 0.0F)};
}

/// Sorts `vertices`, keys whose second half is a vertex, by criterion number `level` and those behind it: x, y and z by
/// value, then by their bits (-0 stands before 0), then the vertex.
NPT_INLINE void sort_by_place(std::span<const float> xyz, std::span<std::uint64_t> vertices, std::size_t level) {
  for (std::uint64_t& key : vertices) {
    const std::uint32_t v = second_of_key(key);
    const float x = xyz[3 * std::size_t{v} + level % 3];
    key = pair_key(order_key(level < 3 ? x + 0.0F : x), v);
  }
  sort_keys(vertices);
  if (level == 5) return;
  for (std::size_t first = 0, end = 0; first < vertices.size(); first = end) {
    while (end < vertices.size() && first_of_key(vertices[end]) == first_of_key(vertices[first])) ++end;
    if (end - first > 1) sort_by_place(xyz, vertices.subspan(first, end - first), level + 1);
  }
}

}  // namespace internal

/// The vertices in lexicographic order of (x, y, z), -0 equal to 0, into memory that is used again. `keys`: scratch.
NPT_INLINE void canonical_order(std::span<const float> xyz, std::vector<std::uint64_t>& keys,
                                std::vector<std::uint32_t>& order) {
  keys.resize(xyz.size() / 3);
  for (std::size_t v = 0; v < keys.size(); ++v) keys[v] = v;
  internal::sort_by_place(xyz, as_span(keys), 0);
  order.resize(keys.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = second_of_key(keys[i]);
}

/// The vertices in lexicographic order of (x, y, z), -0 equal to 0. A permutation of the vertices changes only which of
/// bitwise equal points comes first: the sequence of coordinates stays the same bit for bit.
NPT_INLINE std::vector<std::uint32_t> canonical_order(std::span<const float> xyz) {
  std::vector<std::uint64_t> keys;
  std::vector<std::uint32_t> order;
  canonical_order(xyz, keys, order);
  return order;
}

/// representative[v]: the vertex that comes first in canonical_order among those at the same point as v (v itself where
/// it is alone), into memory that is used again.
NPT_INLINE void coincident_representatives(std::span<const float> xyz, std::span<const std::uint32_t> canonical,
                                           std::vector<std::uint32_t>& representative) {
  representative.resize(canonical.size());
  for (std::size_t i = 0; i < canonical.size(); ++i) {
    const std::uint32_t v = canonical[i];
    const bool same = i > 0 && internal::value_key(xyz, v) == internal::value_key(xyz, canonical[i - 1]);
    representative[v] = same ? representative[canonical[i - 1]] : v;
  }
}

/// representative[v]: the vertex that comes first in canonical_order among those at the same point as v (v itself where
/// it is alone). Coincident vertices have equal coordinates: giving each the result of its
/// representative makes a result independent of the vertex order.
NPT_INLINE std::vector<std::uint32_t> coincident_representatives(std::span<const float> xyz,
                                                                 std::span<const std::uint32_t> canonical) {
  std::vector<std::uint32_t> representative;
  coincident_representatives(xyz, canonical, representative);
  return representative;
}

NPT_INLINE std::vector<std::uint32_t> coincident_representatives(std::span<const float> xyz) {
  return coincident_representatives(xyz, as_span(canonical_order(xyz)));
}

}  // namespace npt::inline NPT_ABI
