#include <doctest/doctest.h>

#include <npt/base/number_text.hpp>
#include <npt/base/random.hpp>

#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>

namespace {

/// Whether npt's own reading gives the bits, the end and the error of the library's.
template <class T>
bool as_the_library(std::string_view text) {
  T expected = -7, found = -7;
  const auto a = std::from_chars(text.data(), text.data() + text.size(), expected);
  const auto b = npt::internal::decimal::from_chars(text.data(), text.data() + text.size(), found);
  return a.ec == b.ec && a.ptr == b.ptr && (a.ec != std::errc{} || std::memcmp(&expected, &found, sizeof found) == 0);
}

}  // namespace

TEST_CASE_TEMPLATE("numbers are read as std::from_chars reads them", T, float, double) {
  for (const std::string_view text : {"0",
                                      "-0",
                                      "0.0",
                                      "1",
                                      "-1.5",
                                      "1.",
                                      ".5",
                                      "1e3",
                                      "1E-3",
                                      "1e+3",
                                      "1e",
                                      "1e+",
                                      "1ex",
                                      "-",
                                      "",
                                      "+1",
                                      " 1",
                                      "x",
                                      "1,5",
                                      "1.2.3",
                                      "123456789",
                                      "16777217",
                                      "9007199254740993",
                                      "0.1",
                                      "0.30000001192092896",
                                      "3.4028235e38",
                                      "3.4028236e38",
                                      "1e39",
                                      "1.7976931348623157e308",
                                      "1e309",
                                      "-1e400",
                                      "1e-45",
                                      "1e-46",
                                      "5e-324",
                                      "1e-400",
                                      "4.9406564584124654e-324",
                                      "1.1754943e-38",
                                      "2.2250738585072014e-308",
                                      "12345678901234567890123",
                                      "1e22",
                                      "1e23",
                                      "0.000000000000000000000000000000000000000000001",
                                      "0.00000000000000000000000000000000000001e38",
                                      "8.5899345899999999999999999999",
                                      "100000000000000000000000000000000000000000e-41",
                                      "0e99999",
                                      "inf",
                                      "-INF",
                                      "infinity",
                                      "infinite",
                                      "nan",
                                      "-nan",
                                      "NaN(12_a)",
                                      "nan(",
                                      "nan(-)"}) {
    CAPTURE(text);
    CHECK(as_the_library<T>(text));
  }
}

TEST_CASE_TEMPLATE("random numbers are read as std::from_chars reads them", T, float, double) {
  npt::Random random(3);
  int different = 0;
  for (int i = 0; i < 20000; ++i) {
    std::array<char, 64> text{};
    const double exponent = 80 * random.uniform() - 40;
    const auto value =
        static_cast<T>((random.uniform() - 0.5) * std::pow(10, sizeof(T) == 8 ? 7 * exponent : exponent));
    const auto end =
        i % 3 == 0   ? std::to_chars(text.data(), text.data() + text.size(), value).ptr
        : i % 3 == 1 ? std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 7).ptr
                     : std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 19).ptr;
    different += as_the_library<T>(std::string_view(text.data(), end)) ? 0 : 1;
  }
  CHECK(different == 0);
}

TEST_CASE("number_from_chars reads whole numbers, too") {
  const std::string text = "42x";
  int value = 0;
  CHECK(npt::number_from_chars(text.data(), text.data() + text.size(), value).ptr == text.data() + 2);
  CHECK(value == 42);
}
