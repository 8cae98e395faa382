/// The filters of EXT_meshopt_compression: what its mode ATTRIBUTES decoded, as the accessors understand it.
/// Numerics  float, rounded once: within one step of the integers, as the extension asks for
/// Source    Khronos, EXT_meshopt_compression, appendix B
#pragma once

#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>

namespace npt::inline NPT_ABI::internal {

/// An integer, its lowest byte first.
template <std::signed_integral T>
T meshopt_load(const std::string& bytes, std::size_t at) {
  std::make_unsigned_t<T> value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    value = static_cast<std::make_unsigned_t<T>>(
        value | static_cast<std::make_unsigned_t<T>>(static_cast<unsigned char>(bytes[at + i])) << (8 * i));
  return static_cast<T>(value);
}
template <std::unsigned_integral T>
void meshopt_store(std::string& bytes, std::size_t at, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes[at + i] = static_cast<char>(std::uint64_t{value} >> (8 * i) & 255U);
}

/// A part of 1 as a whole number. NaN: 0
template <std::signed_integral T>
std::make_unsigned_t<T> meshopt_round(float part) {
  const float value = std::round(part * static_cast<float>(std::numeric_limits<T>::max()));
  const bool good = std::abs(value) <= static_cast<float>(std::numeric_limits<T>::max());
  return static_cast<std::make_unsigned_t<T>>(good ? static_cast<T>(value) : T{0});
}

/// Unit vectors of which x and y stand on an unfolded octahedron; the third number says what 1 is, the fourth stays.
template <std::signed_integral T>
void meshopt_octahedral(std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size(); at += 4 * sizeof(T)) {
    const auto number = [&](std::size_t i) { return static_cast<float>(meshopt_load<T>(bytes, at + i * sizeof(T))); };
    float x = number(0), y = number(1);
    const float z = number(2) - std::abs(x) - std::abs(y), fold = std::min(z, 0.0F);
    x -= std::copysign(fold, x);
    y -= std::copysign(fold, y);
    const float size = std::sqrt(x * x + y * y + z * z);
    const std::array<float, 3> unit{x / size, y / size, z / size};
    for (std::size_t i = 0; i < 3; ++i) meshopt_store(bytes, at + i * sizeof(T), meshopt_round<T>(unit[i]));
  }
}

/// Quaternions without their greatest number, which is positive; the fourth says which it is and what 1 is.
inline void meshopt_quaternion(std::string& bytes) {
  using T = std::int16_t;
  for (std::size_t at = 0; at < bytes.size(); at += 4 * sizeof(T)) {
    const int last = meshopt_load<T>(bytes, at + 3 * sizeof(T));
    const float scale = 1 / (std::sqrt(2.0F) * static_cast<float>(last | 3));
    std::array<float, 3> small{};
    float rest = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      small[i] = static_cast<float>(meshopt_load<T>(bytes, at + i * sizeof(T))) * scale;
      rest -= small[i] * small[i];
    }
    const auto greatest = static_cast<std::size_t>(last & 3);
    meshopt_store(bytes, at + greatest * sizeof(T), meshopt_round<T>(std::sqrt(std::max(rest, 0.0F))));
    for (std::size_t i = 0; i < 3; ++i)
      meshopt_store(bytes, at + (greatest + 1 + i) % 4 * sizeof(T), meshopt_round<T>(small[i]));
  }
}

/// Floats as a whole number of 24 bits times a power of two, whose exponent is the highest byte.
inline void meshopt_exponential(std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size(); at += 4) {
    const auto both = meshopt_load<std::int32_t>(bytes, at);
    const std::int32_t exponent = both >> 24;
    const auto mantissa = static_cast<std::int32_t>(static_cast<std::uint32_t>(both) << 8) >> 8;
    meshopt_store(bytes, at, std::bit_cast<std::uint32_t>(std::ldexp(static_cast<float>(mantissa), exponent)));
  }
}

}  // namespace npt::inline NPT_ABI::internal
