/// Numbers as text of base 64, which is how tables stand in headers: a string of 60 KB compiles in milliseconds, a list
/// of as many numbers in a second.
#pragma once

#include <npt/config.hpp>

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI::digits {

/// The digits 0 to 63: 0-9, A-Z, a-z, + and -.
constexpr std::uint32_t digit_of(char c) {
  if (c >= 'a') return static_cast<std::uint32_t>(c - 'a' + 36);
  if (c >= 'A') return static_cast<std::uint32_t>(c - 'A' + 10);
  if (c >= '0') return static_cast<std::uint32_t>(c - '0');
  return c == '+' ? 62 : 63;
}

/// Numbers of `width` digits each, the most significant first.
inline std::vector<std::uint32_t> numbers_of(std::string_view text, std::size_t width) {
  std::vector<std::uint32_t> numbers(text.size() / width);
  for (std::size_t i = 0; i < numbers.size() * width; ++i)
    numbers[i / width] = numbers[i / width] << 6 | digit_of(text[i]);
  return numbers;
}

}  // namespace npt::inline NPT_ABI::digits
