/// A vector's elements as a span, as the implicit conversion gives them. That conversion checks concepts of ranges: it
/// costs g++ 12 72 million instructions for each type of elements, this none: 9 % of npt.hpp in all.
#pragma once

#include <npt/config.hpp>

#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

template <class T>
constexpr std::span<const T> as_span(const std::vector<T>& values) noexcept {
  return {values.data(), values.size()};
}
template <class T>
constexpr std::span<T> as_span(std::vector<T>& values) noexcept {
  return {values.data(), values.size()};
}

}  // namespace npt::inline NPT_ABI
