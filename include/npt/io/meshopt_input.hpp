/// The bytes of a buffer view that EXT_meshopt_compression compressed, read one after the other.
/// Errors    npt::Error for bytes that end early or are too many
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace npt::inline NPT_ABI::internal {

class MeshoptInput {
 public:
  /// `file` and `place` stand in messages of errors. header: the first byte that the mode has
  MeshoptInput(std::string_view bytes, std::string file, std::string place, std::uint8_t header)
      : bytes_(bytes), file_(std::move(file)), place_(std::move(place)) {
    static constexpr char digits[] = "0123456789abcdef";
    const auto hex = [](unsigned value) { return std::string("0x") + digits[value >> 4] + digits[value & 15U]; };
    if (const std::uint8_t found = byte(); found != header) fail("a first byte " + hex(found), hex(header));
  }

  /// Cuts off the last bytes, which every mode keeps for itself.
  std::string_view take_tail(std::size_t count) {
    if (bytes_.size() - at_ < count) fail_short();
    const std::string_view tail = bytes_.substr(bytes_.size() - count);
    bytes_.remove_suffix(count);
    return tail;
  }
  std::string_view take(std::size_t count) {
    if (bytes_.size() - at_ < count) fail_short();
    at_ += count;
    return bytes_.substr(at_ - count, count);
  }
  std::uint8_t byte() {
    if (at_ == bytes_.size()) fail_short();
    return static_cast<std::uint8_t>(bytes_[at_++]);
  }
  /// Seven bits a byte, the lowest first.
  std::uint32_t varint() {
    std::uint32_t value = 0;
    for (unsigned shift = 0; shift < 35; shift += 7) {
      const std::uint32_t next = byte();
      value |= (next & 127U) << shift;
      if (next < 128) return value;
    }
    fail("a number of more than five bytes", "five at most");
  }
  void expect_end() const {
    if (at_ != bytes_.size()) fail(std::to_string(bytes_.size() - at_) + " bytes too many", "none");
  }

 private:
  [[noreturn]] void fail_short() const { fail("compressed bytes that end early", "all that `count` asks for"); }
  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw Error({.file = file_, .place = place_, .found = std::move(found), .expected = std::move(expected)});
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  std::string file_, place_;
};

}  // namespace npt::inline NPT_ABI::internal
