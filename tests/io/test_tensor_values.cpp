#include <doctest/doctest.h>

#include <io/scratch.hpp>
#include <npt/io/file_tensor.hpp>
#include <npt/io/tensor_values.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace {

using npt::Dtype;
using scratch::error_of;

template <class T>
std::string raw(std::initializer_list<T> values) {
  std::string bytes;
  for (const T& value : values) bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
  return bytes;
}

/// A tensor "t" of file "f", and its bytes.
struct Owner {
  std::string bytes;
  npt::FileTensor tensor;
  operator const npt::FileTensor&() {
    tensor.bytes = std::as_bytes(std::span(bytes));
    return tensor;
  }
};

/// Of a type's name in the file.
Owner tensor(const std::string& dtype, const std::string& bytes) {
  Owner owner{bytes, {.name = "t", .shape = {}, .file = "f"}};
  for (const auto& info : npt::internal::dtypes)
    if (dtype == info.name) owner.tensor.dtype = info.dtype;
  owner.tensor.shape = {bytes.size() / npt::size_of(owner.tensor.dtype)};
  return owner;
}

}  // namespace

TEST_CASE("each type has its name and its size") {
  CHECK(std::string(npt::to_string(Dtype::bf16)) == "BF16");
  CHECK(npt::size_of(Dtype::bf16) == 2);
  CHECK(std::string(npt::to_string(Dtype::boolean)) == "BOOL");
  CHECK(npt::size_of(Dtype::i64) == 8);
  for (const auto& info : npt::internal::dtypes) CHECK(std::string(npt::to_string(info.dtype)) == info.name);
  CHECK(npt::to_string(npt::TensorShape{64, 3, 1}) == "[64, 3, 1]");
  CHECK(npt::to_string(npt::TensorShape{}) == "[]");
}

TEST_CASE("every type is converted") {
  CHECK(npt::to_float(tensor("F64", raw<double>({0.1, -2}))) == std::vector<float>{0.1F, -2});
  CHECK(npt::to_double(tensor("F32", raw<float>({0.1F, -2}))) == std::vector<double>{double{0.1F}, -2});
  CHECK(npt::to_float(tensor("BF16", raw<std::uint16_t>({0x3F80, 0xC040, 0x0001}))) ==
        std::vector<float>{1, -3, 0x1p-133F});
  CHECK(npt::to_int64(tensor("I64", raw<std::int64_t>({INT64_MIN}))) == std::vector<std::int64_t>{INT64_MIN});
  CHECK(npt::to_int64(tensor("I32", raw<std::int32_t>({-5}))) == std::vector<std::int64_t>{-5});
  CHECK(npt::to_int64(tensor("I16", raw<std::int16_t>({-5}))) == std::vector<std::int64_t>{-5});
  CHECK(npt::to_int64(tensor("I8", raw<std::int8_t>({-5}))) == std::vector<std::int64_t>{-5});
  CHECK(npt::to_int64(tensor("U64", raw<std::uint64_t>({7}))) == std::vector<std::int64_t>{7});
  CHECK(npt::to_int64(tensor("U32", raw<std::uint32_t>({4000000000}))) == std::vector<std::int64_t>{4000000000});
  CHECK(npt::to_int64(tensor("U16", raw<std::uint16_t>({65535}))) == std::vector<std::int64_t>{65535});
  CHECK(npt::to_float(tensor("U8", raw<std::uint8_t>({255}))) == std::vector<float>{255});
  CHECK(npt::to_double(tensor("BOOL", raw<std::uint8_t>({0, 1, 2}))) == std::vector<double>{0, 1, 1});
}

TEST_CASE("half precision: every finite value is exact") {
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    const double exponent = static_cast<double>((bits >> 10) & 31), mantissa = static_cast<double>(bits & 1023);
    if (exponent == 31) continue;
    const double magnitude = exponent == 0 ? mantissa * 0x1p-24 : (1 + mantissa / 1024) * std::exp2(exponent - 15);
    const float value = npt::internal::half_to_float(static_cast<std::uint16_t>(bits));
    REQUIRE(std::abs(static_cast<double>(value)) == magnitude);
    REQUIRE(std::signbit(value) == (bits >= 0x8000));
  }
  CHECK(std::isinf(npt::internal::half_to_float(0x7C00)));
  CHECK(std::isnan(npt::internal::half_to_float(0x7E00)));
}

TEST_CASE("values that the type can't hold are errors that name tensor and element") {
  CHECK(error_of([] {
          npt::to_float(tensor("F64", raw<double>({0, 1e39})));
        }).starts_with("f: tensor 't', element 1: found "));
  CHECK(error_of([] {
          npt::to_int64(tensor("U64", raw<std::uint64_t>({0, 0, 1ULL << 63})));
        }).starts_with("f: tensor 't', element 2: found 9223372036854775808"));
  CHECK(error_of([] { npt::to_int64(tensor("F32", raw<float>({1}))); }) ==
        "f: tensor 't': found F32, expected a type of whole numbers");
}

TEST_CASE("NaN and infinity are refused unless asked for") {
  const float inf = std::numeric_limits<float>::infinity();
  CHECK(error_of([] {
          npt::to_float(tensor("F32", raw<float>({0, NAN})));
        }) == "f: tensor 't', element 1: found NaN, expected a finite number");
  CHECK(error_of([] { npt::to_double(tensor("F16", raw<std::uint16_t>({0xFC00}))); }) ==
        "f: tensor 't', element 0: found infinity, expected a finite number");
  CHECK(error_of([] { npt::to_float(tensor("BF16", raw<std::uint16_t>({0x7FC0}))); }).find("NaN") != std::string::npos);
  CHECK(npt::to_float(tensor("F32", raw<float>({inf})), npt::NonFinite::keep) == std::vector<float>{inf});
  CHECK(npt::to_float(tensor("F64", raw<double>({-double{inf}})), npt::NonFinite::keep) == std::vector<float>{-inf});
}
