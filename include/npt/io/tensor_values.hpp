/// The numbers of a file's tensor.
/// Numerics  each value exactly, or rounded once
/// Errors    npt::Error that names file, tensor and element: a value that the type can't hold; unless allowed, NaN and
///           infinity
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/file_tensor.hpp>
#include <npt/io/text.hpp>

#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Whether a conversion accepts NaN and infinity.
enum class NonFinite { refuse, keep };

namespace internal {

/// IEEE binary16 to binary32, exact.
inline float half_to_float(std::uint16_t h) {
  const std::uint32_t sign = (h & 0x8000U) << 16, exponent = (h >> 10) & 31U, mantissa = h & 0x3FFU;
  if (exponent == 31) return std::bit_cast<float>(sign | 0x7F800000U | mantissa << 13);
  if (exponent != 0) return std::bit_cast<float>(sign | (exponent + 112) << 23 | mantissa << 13);
  const float magnitude = static_cast<float>(mantissa) * 0x1p-24F;
  return sign != 0 ? -magnitude : magnitude;
}

/// bfloat16 is the upper half of binary32.
inline float bfloat16_to_float(std::uint16_t b) { return std::bit_cast<float>(std::uint32_t{b} << 16); }

[[noreturn]] inline void bad_value(const FileTensor& tensor, std::size_t i, std::string found, std::string expected) {
  throw Error({.file = tensor.file,
               .place = "tensor " + in_quotes(tensor.name) + ", element " + std::to_string(i),
               .found = std::move(found),
               .expected = std::move(expected)});
}

/// One stored value as To. Floating to whole numbers is refused by to_values.
template <class To, class From>
To convert_value(From value, const FileTensor& tensor, std::size_t i, NonFinite policy) {
  if constexpr (std::floating_point<From>) {
    if (policy == NonFinite::refuse && !std::isfinite(value))
      bad_value(tensor, i, std::isnan(value) ? "NaN" : "infinity", "a finite number");
    if constexpr (sizeof(To) < sizeof(From))
      if (std::isfinite(value) && !fits_float(value))
        bad_value(tensor, i, std::to_string(value), "a number that fits into 32-bit floating point");
  } else if constexpr (std::integral<To>) {
    if (!std::in_range<To>(value)) bad_value(tensor, i, std::to_string(value), "at most 2^63 - 1");
  }
  return static_cast<To>(value);
}

/// The whole tensor, its stored values read as Stored and decoded.
template <class To, class Stored, class Decode>
std::vector<To> convert_tensor(const FileTensor& tensor, NonFinite policy, Decode decode) {
  std::vector<To> values(tensor.count());
  for (std::size_t i = 0; i < values.size(); ++i) {
    Stored stored;
    std::memcpy(&stored, tensor.bytes.data() + i * sizeof(Stored), sizeof(Stored));
    values[i] = convert_value<To>(decode(stored), tensor, i, policy);
  }
  return values;
}

}  // namespace internal

/// The tensor's values as To (float, double or std::int64_t), row major, converted from whatever type is stored.
/// Errors    npt::Error: a value that To can't hold; floating point as whole numbers; NaN and infinity, unless kept
template <class To>
std::vector<To> to_values(const FileTensor& tensor, NonFinite policy) {
  const auto as_is = [](auto value) { return value; };
  if constexpr (std::floating_point<To>) {
    switch (tensor.dtype) {
      case Dtype::f64:
        return internal::convert_tensor<To, double>(tensor, policy, as_is);
      case Dtype::f32:
        return internal::convert_tensor<To, float>(tensor, policy, as_is);
      case Dtype::f16:
        return internal::convert_tensor<To, std::uint16_t>(tensor, policy, internal::half_to_float);
      case Dtype::bf16:
        return internal::convert_tensor<To, std::uint16_t>(tensor, policy, internal::bfloat16_to_float);
      default:
        break;
    }
  }
  switch (tensor.dtype) {
    case Dtype::i64:
      return internal::convert_tensor<To, std::int64_t>(tensor, policy, as_is);
    case Dtype::i32:
      return internal::convert_tensor<To, std::int32_t>(tensor, policy, as_is);
    case Dtype::i16:
      return internal::convert_tensor<To, std::int16_t>(tensor, policy, as_is);
    case Dtype::i8:
      return internal::convert_tensor<To, std::int8_t>(tensor, policy, as_is);
    case Dtype::u64:
      return internal::convert_tensor<To, std::uint64_t>(tensor, policy, as_is);
    case Dtype::u32:
      return internal::convert_tensor<To, std::uint32_t>(tensor, policy, as_is);
    case Dtype::u16:
      return internal::convert_tensor<To, std::uint16_t>(tensor, policy, as_is);
    case Dtype::u8:
      return internal::convert_tensor<To, std::uint8_t>(tensor, policy, as_is);
    case Dtype::boolean:
      return internal::convert_tensor<To, std::uint8_t>(tensor, policy,
                                                        [](std::uint8_t b) { return std::uint8_t{b != 0}; });
    default:
      invalid_tensor(tensor.file, tensor.name, to_string(tensor.dtype), "a type of whole numbers");
  }
}

/// to_values for the usual types; templates, so that only units that convert compile the conversions.
NPT_INLINE std::vector<float> to_float(const FileTensor& tensor, NonFinite policy = NonFinite::refuse) {
  return to_values<float>(tensor, policy);
}
NPT_INLINE std::vector<double> to_double(const FileTensor& tensor, NonFinite policy = NonFinite::refuse) {
  return to_values<double>(tensor, policy);
}
NPT_INLINE std::vector<std::int64_t> to_int64(const FileTensor& tensor) {
  return to_values<std::int64_t>(tensor, NonFinite::refuse);
}

}  // namespace npt::inline NPT_ABI
