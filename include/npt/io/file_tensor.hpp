/// A tensor as it lies in a file: name, type of the elements, shape and bytes.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/text.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

static_assert(std::endian::native == std::endian::little, "tensors are used as they lie in the file, little-endian");

namespace internal {
inline constexpr std::uint64_t max_safetensors_header = 100'000'000;
}  // namespace internal

/// Types of a tensor's elements.
enum class Dtype { f64, f32, f16, bf16, i64, i32, i16, i8, u64, u32, u16, u8, boolean };

namespace internal {

struct DtypeInfo {
  Dtype dtype;
  const char* name;
  std::size_t size;
};
inline constexpr std::array<DtypeInfo, 13> dtypes = {{{Dtype::f64, "F64", 8},
                                                      {Dtype::f32, "F32", 4},
                                                      {Dtype::f16, "F16", 2},
                                                      {Dtype::bf16, "BF16", 2},
                                                      {Dtype::i64, "I64", 8},
                                                      {Dtype::i32, "I32", 4},
                                                      {Dtype::i16, "I16", 2},
                                                      {Dtype::i8, "I8", 1},
                                                      {Dtype::u64, "U64", 8},
                                                      {Dtype::u32, "U32", 4},
                                                      {Dtype::u16, "U16", 2},
                                                      {Dtype::u8, "U8", 1},
                                                      {Dtype::boolean, "BOOL", 1}}};

}  // namespace internal

/// Bytes of one element.
constexpr std::size_t size_of(Dtype dtype) noexcept { return internal::dtypes[static_cast<std::size_t>(dtype)].size; }
/// The name in the file: "F32".
constexpr const char* to_string(Dtype dtype) noexcept {
  // Not by the index alone: where a switch has had every type, g++ 12 for ARM64 warns of what is left.
  const auto index = static_cast<std::size_t>(dtype);
  return index < internal::dtypes.size() ? internal::dtypes[index].name : "unknown";
}

/// Sizes, the slowest first; empty: a single number.
using TensorShape = std::vector<std::uint64_t>;

/// "[64, 3, 1]"
NPT_INLINE std::string to_string(const TensorShape& shape) {
  std::string text = "[";
  for (const std::uint64_t n : shape) text += (text.size() > 1 ? ", " : "") + std::to_string(n);
  return text + "]";
}

/// One tensor: its description, and its bytes where they lie in memory (row major, without alignment).
struct FileTensor {
  std::string name;
  Dtype dtype = Dtype::f32;
  TensorShape shape;                   ///< empty: a single number
  std::span<const std::byte> bytes{};  ///< owned by the SafetensorsFile, or by whoever writes
  std::string file{};                  ///< where it came from, for messages

  std::size_t count() const noexcept { return bytes.size() / size_of(dtype); }
};

/// Throws npt::Error about one tensor of a file.
[[noreturn]] inline void invalid_tensor(const std::string& file, std::string_view tensor, std::string found,
                                        std::string expected) {
  throw Error({.file = file,
               .place = "tensor " + in_quotes(tensor),
               .found = std::move(found),
               .expected = std::move(expected)});
}

namespace internal {

/// Bytes of a tensor of this type and shape; nothing when the number overflows.
inline std::optional<std::uint64_t> byte_count(Dtype dtype, const TensorShape& shape) {
  std::uint64_t product = size_of(dtype);
  bool overflow = false;
  for (const std::uint64_t n : shape) {
    overflow = overflow || (n != 0 && product > std::numeric_limits<std::uint64_t>::max() / n);
    product *= n;
  }
  // A zero among the sizes makes the tensor empty whatever the others are.
  for (const std::uint64_t n : shape)
    if (n == 0) return 0;
  return overflow ? std::nullopt : std::optional(product);
}

}  // namespace internal

}  // namespace npt::inline NPT_ABI
