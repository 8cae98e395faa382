/// Sorting, and the middle of values, in one place: every std::sort of another type or order costs g++ a tenth of a
/// second wherever its header is included. Headers of the umbrella prefer algorithms of std to those of std::ranges:
/// thirty calls of the latter took 5 % of g++'s instructions, also within templates, where it checks their constraints.
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// Ascending.
inline void sort_keys(std::span<std::uint64_t> keys) { std::sort(keys.data(), keys.data() + keys.size()); }

/// Ascending, each once.
inline void sort_keys_once(std::vector<std::uint64_t>& keys) {
  sort_keys(as_span(keys));
  const std::uint64_t* const end = std::unique(keys.data(), keys.data() + keys.size());
  keys.resize(static_cast<std::size_t>(end - keys.data()));
}

/// Ascending by key(value), equal ones in their order. A key is a function or a pointer to a member.
template <class Values, class Key>
void stable_sort_by(Values& values, const Key& key) {
  std::stable_sort(values.begin(), values.end(),
                   [&key](const auto& a, const auto& b) { return std::invoke(key, a) < std::invoke(key, b); });
}

/// The value in the middle, of an even number of them the upper one. Changes their order. Requires  at least one value
template <class T>
T median(std::span<T> values) {
  T* const middle = values.data() + values.size() / 2;
  std::nth_element(values.data(), middle, values.data() + values.size());
  return *middle;
}

/// A key that is sorted by `first`, then by `second`.
constexpr std::uint64_t pair_key(std::uint32_t first, std::uint32_t second) {
  return std::uint64_t{first} << 32 | second;
}
constexpr std::uint32_t first_of_key(std::uint64_t key) { return static_cast<std::uint32_t>(key >> 32); }
constexpr std::uint32_t second_of_key(std::uint64_t key) { return static_cast<std::uint32_t>(key); }

}  // namespace npt::inline NPT_ABI
