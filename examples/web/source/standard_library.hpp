/// What libc++ 13, emscripten 3.1.6's standard library, lacks of C++20 and npt uses: std::bit_cast, algorithms on
/// ranges, std::to_chars of floating-point numbers. The build includes it before every unit (build.sh); nothing else
/// should. With a later libc++ it is empty.
#pragma once

#include <version>

#if defined(_LIBCPP_VERSION) && _LIBCPP_VERSION < 14000

#include <algorithm>
#include <bit>
#include <charconv>
#include <concepts>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iterator>
#include <ranges>
#include <system_error>
#include <type_traits>
#include <utility>

// Names in std are not a program's to add: here they stand in for those that the standard puts there.
namespace std {

template <class To, class From>
constexpr To bit_cast(const From& from) noexcept {
  static_assert(sizeof(To) == sizeof(From));
  return __builtin_bit_cast(To, from);
}

namespace npt_numbers {

/// The shortest of the forms with `least` to `most` digits that reads back to the value.
template <class Number, class Parse>
to_chars_result shortest(char* first, char* last, Number value, int least, int most, const Parse& parse) {
  char text[40];
  int length = 0;
  for (int digits = least; digits <= most; ++digits) {
    length = snprintf(text, sizeof text, "%.*g", digits, static_cast<double>(value));
    if (!(value == value) || parse(text) == value) break;
  }
  if (last - first < length) return {last, errc::value_too_large};
  memcpy(first, text, static_cast<size_t>(length));
  return {first + length, errc{}};
}

}  // namespace npt_numbers

inline to_chars_result to_chars(char* first, char* last, float value) {
  return npt_numbers::shortest(first, last, value, 6, 9, [](const char* text) { return strtof(text, nullptr); });
}
inline to_chars_result to_chars(char* first, char* last, double value) {
  return npt_numbers::shortest(first, last, value, 15, 17, [](const char* text) { return strtod(text, nullptr); });
}

namespace ranges {

/// An algorithm on iterators, with projections where they are given.
struct npt_find {
  template <class R, class T, class P = identity>
  constexpr auto operator()(R&& range, const T& value, P projection = {}) const {
    auto at = ranges::begin(range);
    for (; at != ranges::end(range); ++at)
      if (invoke(projection, *at) == value) break;
    return at;
  }
};
inline constexpr npt_find find;

struct npt_find_if {
  template <class R, class F, class P = identity>
  constexpr auto operator()(R&& range, F f, P projection = {}) const {
    auto at = ranges::begin(range);
    for (; at != ranges::end(range); ++at)
      if (invoke(f, invoke(projection, *at))) break;
    return at;
  }
};
inline constexpr npt_find_if find_if;

struct npt_any_of {
  template <class R, class F, class P = identity>
  constexpr bool operator()(R&& range, F f, P projection = {}) const {
    for (auto&& x : range)
      if (invoke(f, invoke(projection, x))) return true;
    return false;
  }
};
inline constexpr npt_any_of any_of;

struct npt_none_of {
  template <class R, class F, class P = identity>
  constexpr bool operator()(R&& range, F f, P projection = {}) const {
    return !npt_any_of{}(range, std::ref(f), std::ref(projection));
  }
};
inline constexpr npt_none_of none_of;

struct npt_all_of {
  template <class R, class F, class P = identity>
  constexpr bool operator()(R&& range, F f, P projection = {}) const {
    for (auto&& x : range)
      if (!invoke(f, invoke(projection, x))) return false;
    return true;
  }
};
inline constexpr npt_all_of all_of;

struct npt_count {
  template <class R, class T, class P = identity>
  constexpr ptrdiff_t operator()(R&& range, const T& value, P projection = {}) const {
    ptrdiff_t found = 0;
    for (auto&& x : range) found += invoke(projection, x) == value ? 1 : 0;
    return found;
  }
};
inline constexpr npt_count count;

struct npt_count_if {
  template <class R, class F, class P = identity>
  constexpr ptrdiff_t operator()(R&& range, F f, P projection = {}) const {
    ptrdiff_t found = 0;
    for (auto&& x : range) found += invoke(f, invoke(projection, x)) ? 1 : 0;
    return found;
  }
};
inline constexpr npt_count_if count_if;

/// Compares elements by their projections.
template <class C, class P>
constexpr auto npt_projected(C& compare, P& projection) {
  return [&](auto&& a, auto&& b) -> bool { return invoke(compare, invoke(projection, a), invoke(projection, b)); };
}

struct npt_sort {
  template <class R, class C = std::less<>, class P = identity>
  constexpr auto operator()(R&& range, C compare = {}, P projection = {}) const {
    std::sort(ranges::begin(range), ranges::end(range), npt_projected(compare, projection));
    return ranges::end(range);
  }
};
inline constexpr npt_sort sort;

struct npt_stable_sort {
  template <class R, class C = std::less<>, class P = identity>
  auto operator()(R&& range, C compare = {}, P projection = {}) const {
    std::stable_sort(ranges::begin(range), ranges::end(range), npt_projected(compare, projection));
    return ranges::end(range);
  }
};
inline constexpr npt_stable_sort stable_sort;

struct npt_is_sorted {
  template <class R, class C = std::less<>, class P = identity>
  constexpr bool operator()(R&& range, C compare = {}, P projection = {}) const {
    return std::is_sorted(ranges::begin(range), ranges::end(range), npt_projected(compare, projection));
  }
};
inline constexpr npt_is_sorted is_sorted;

struct npt_nth_element {
  template <class R, class I, class C = std::less<>, class P = identity>
  constexpr auto operator()(R&& range, I nth, C compare = {}, P projection = {}) const {
    std::nth_element(ranges::begin(range), nth, ranges::end(range), npt_projected(compare, projection));
    return ranges::end(range);
  }
};
inline constexpr npt_nth_element nth_element;

struct npt_max_element {
  template <class R, class C = std::less<>, class P = identity>
  constexpr auto operator()(R&& range, C compare = {}, P projection = {}) const {
    return std::max_element(ranges::begin(range), ranges::end(range), npt_projected(compare, projection));
  }
};
inline constexpr npt_max_element max_element;

struct npt_min_element {
  template <class R, class C = std::less<>, class P = identity>
  constexpr auto operator()(R&& range, C compare = {}, P projection = {}) const {
    return std::min_element(ranges::begin(range), ranges::end(range), npt_projected(compare, projection));
  }
};
inline constexpr npt_min_element min_element;

struct npt_min {
  template <class R, class C = std::less<>, class P = identity>
  constexpr auto operator()(R&& range, C compare = {}, P projection = {}) const {
    return *npt_min_element{}(range, std::ref(compare), std::ref(projection));
  }
};
inline constexpr npt_min min;

struct npt_max {
  template <class R, class C = std::less<>, class P = identity>
  constexpr auto operator()(R&& range, C compare = {}, P projection = {}) const {
    return *npt_max_element{}(range, std::ref(compare), std::ref(projection));
  }
};
inline constexpr npt_max max;

struct npt_adjacent_find {
  template <class R, class C = std::equal_to<>>
  constexpr auto operator()(R&& range, C equal = {}) const {
    return std::adjacent_find(ranges::begin(range), ranges::end(range), equal);
  }
};
inline constexpr npt_adjacent_find adjacent_find;

struct npt_lower_bound {
  template <class R, class T, class C = std::less<>, class P = identity>
  constexpr auto operator()(R&& range, const T& value, C compare = {}, P projection = {}) const {
    return std::lower_bound(
        ranges::begin(range), ranges::end(range), value,
        [&](auto&& element, const T& bound) -> bool { return invoke(compare, invoke(projection, element), bound); });
  }
};
inline constexpr npt_lower_bound lower_bound;

struct npt_binary_search {
  template <class R, class T, class C = std::less<>>
  constexpr bool operator()(R&& range, const T& value, C compare = {}) const {
    return std::binary_search(ranges::begin(range), ranges::end(range), value, compare);
  }
};
inline constexpr npt_binary_search binary_search;

struct npt_equal {
  template <class R, class S, class C = std::equal_to<>, class P = identity, class Q = identity>
  constexpr bool operator()(R&& a, S&& b, C compare = {}, P of_a = {}, Q of_b = {}) const {
    return std::equal(ranges::begin(a), ranges::end(a), ranges::begin(b), ranges::end(b),
                      [&](auto&& x, auto&& y) -> bool { return invoke(compare, invoke(of_a, x), invoke(of_b, y)); });
  }
};
inline constexpr npt_equal equal;

struct npt_reverse {
  template <class R>
  constexpr auto operator()(R&& range) const {
    std::reverse(ranges::begin(range), ranges::end(range));
    return ranges::end(range);
  }
};
inline constexpr npt_reverse reverse;

struct npt_fill {
  template <class R, class T>
  constexpr auto operator()(R&& range, const T& value) const {
    std::fill(ranges::begin(range), ranges::end(range), value);
    return ranges::end(range);
  }
};
inline constexpr npt_fill fill;

/// What a copy returns in the standard holds more; npt uses none of it.
struct npt_copy {
  template <class R, class O>
  constexpr O operator()(R&& range, O out) const {
    return std::copy(ranges::begin(range), ranges::end(range), out);
  }
};
inline constexpr npt_copy copy;

struct npt_copy_if {
  template <class R, class O, class F>
  constexpr O operator()(R&& range, O out, F f) const {
    return std::copy_if(ranges::begin(range), ranges::end(range), out, f);
  }
};
inline constexpr npt_copy_if copy_if;

struct npt_replace {
  template <class R, class T>
  constexpr auto operator()(R&& range, const T& old_value, const T& new_value) const {
    std::replace(ranges::begin(range), ranges::end(range), old_value, new_value);
    return ranges::end(range);
  }
};
inline constexpr npt_replace replace;

}  // namespace ranges
}  // namespace std

#endif
