/// std::from_chars, also for floating-point numbers where the standard library has it for integers only (libc++ before
/// version 20: macOS, emscripten).
#pragma once

#include <npt/config.hpp>

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <locale>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

namespace npt::inline NPT_ABI {

namespace internal::decimal {

/// A word of the form that std::from_chars takes: its end, and what its digits say.
struct Scanned {
  const char* end = nullptr;  ///< nullptr: no number
  std::uint64_t digits = 0;   ///< the first 19 significant ones
  int count = 0;              ///< of significant digits, as far as they are in `digits`
  int exponent = 0;           ///< the value is digits * 10^exponent, where nothing was cut off
  bool cut = false;           ///< digits other than 0 were cut off
  bool negative = false;
};

inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

inline Scanned scan(const char* first, const char* last) {
  Scanned s;
  const char* at = first;
  if (at != last && *at == '-') {
    s.negative = true;
    ++at;
  }
  bool any = false, point = false;
  for (; at != last && (is_digit(*at) || (*at == '.' && !point)); ++at) {
    if (*at == '.') {
      point = true;
      continue;
    }
    any = true;
    const int digit = *at - '0';
    constexpr int most_digits = 19;  // of a 64-bit number
    if (s.count < most_digits) {
      s.digits = 10 * s.digits + static_cast<std::uint64_t>(digit);
      s.count += s.digits != 0 ? 1 : 0;
      s.exponent -= point ? 1 : 0;
    } else {
      s.cut = s.cut || digit != 0;
      s.exponent += point ? 0 : 1;
    }
  }
  if (!any) return s;
  s.end = at;
  if (at == last || (*at != 'e' && *at != 'E')) return s;
  ++at;
  const bool down = at != last && *at == '-';
  if (at != last && (*at == '-' || *at == '+')) ++at;
  if (at == last || !is_digit(*at)) return s;  // the number ends before the e
  int exponent = 0;
  for (; at != last && is_digit(*at); ++at)
    if (exponent < 100000) exponent = 10 * exponent + (*at - '0');
  s.exponent += down ? -exponent : exponent;
  s.end = at;
  return s;
}

/// The end of "inf", "infinity", "nan" or "nan(...)" in any case of letters; nullptr where it is none.
template <class Number>
const char* scan_name(const char* first, const char* last, Number& value) {
  const char* at = first;
  const bool negative = at != last && *at == '-';
  at += negative ? 1 : 0;
  const auto starts = [&](std::string_view name) {
    if (static_cast<std::size_t>(last - at) < name.size()) return false;
    for (std::size_t i = 0; i < name.size(); ++i)
      if ((at[i] | 0x20) != name[i]) return false;
    return true;
  };
  if (starts("inf")) {
    value = negative ? -std::numeric_limits<Number>::infinity() : std::numeric_limits<Number>::infinity();
    return at + (starts("infinity") ? 8 : 3);
  }
  if (!starts("nan")) return nullptr;
  value = std::copysign(std::numeric_limits<Number>::quiet_NaN(), negative ? Number(-1) : Number(1));
  at += 3;
  if (at == last || *at != '(') return at;
  for (const char* end = at + 1; end != last; ++end) {
    if (*end == ')') return end + 1;
    const char letter = static_cast<char>(*end | 0x20);
    if (!is_digit(*end) && *end != '_' && !(letter >= 'a' && letter <= 'z')) break;
  }
  return at;
}

/// The nearest number to a scanned one: numbers and powers of ten that the type holds exactly need one rounding,
/// others go through a stream, which is right for all of them and slow.
template <class Number>
std::errc round(const char* first, const Scanned& s, Number& value) {
  constexpr bool wide = sizeof(Number) == 8;
  constexpr std::uint64_t most = wide ? std::uint64_t{1} << 53 : std::uint64_t{1} << 24;
  constexpr int most_exponent = wide ? 22 : 10;  // 10^22 = 2^22 5^22 and 5^22 < 2^53
  if (!s.cut && s.digits <= most && s.exponent >= -most_exponent && s.exponent <= most_exponent) {
    Number power = 1;
    for (int i = 0; i < std::abs(s.exponent); ++i) power *= 10;
    const auto digits = static_cast<Number>(s.digits);
    value = s.exponent < 0 ? digits / power : digits * power;
    if (s.negative) value = -value;
    return {};
  }
  std::istringstream stream(std::string(first, s.end));
  stream.imbue(std::locale::classic());
  Number read = 0;
  stream >> read;  // fails also for a number that is merely subnormal
  const bool too_large = std::isinf(read) || (stream.fail() && std::abs(read) == std::numeric_limits<Number>::max());
  if (too_large || (read == 0 && s.digits != 0)) return std::errc::result_out_of_range;
  value = read;
  return {};
}

/// As std::from_chars(first, last, value) does it.
template <class Number>
std::from_chars_result from_chars(const char* first, const char* last, Number& value) {
  const Scanned s = scan(first, last);
  if (s.end != nullptr) return {s.end, round(first, s, value)};
  const char* end = scan_name(first, last, value);
  return end != nullptr ? std::from_chars_result{end, {}} : std::from_chars_result{first, std::errc::invalid_argument};
}

template <class Number>
concept InLibrary = requires(const char* text, Number& value) {
  std::from_chars(text, text, value);
};

}  // namespace internal::decimal

/// std::from_chars.
/// Errors    as std::from_chars: result_out_of_range, invalid_argument
template <class Number>
std::from_chars_result number_from_chars(const char* first, const char* last, Number& value) {
  if constexpr (internal::decimal::InLibrary<Number>)
    return std::from_chars(first, last, value);
  else
    return internal::decimal::from_chars(first, last, value);
}

}  // namespace npt::inline NPT_ABI
