/// The container of binary glTF: a header of 12 bytes, a chunk of JSON, and at most one of bytes; further chunks are
/// passed over.
/// Errors    npt::Error: another magic or version, lengths that don't fit the file, a first chunk that is no JSON
/// Source    glTF 2.0 specification, section 4
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace npt::inline NPT_ABI::internal {

struct GlbChunks {
  std::string_view json;
  std::optional<std::string_view> bytes;
};

inline constexpr std::uint32_t glb_magic = 0x46546C67, glb_json = 0x4E4F534A, glb_data = 0x004E4942;

/// Four bytes, little-endian, whatever the machine. Requires at + 4 <= size.
inline std::uint32_t little_u32(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}
inline void append_little_u32(std::string& out, std::uint32_t value) {
  for (int i = 0; i < 4; ++i, value >>= 8) out += static_cast<char>(static_cast<unsigned char>(value & 255U));
}

inline bool is_glb(std::string_view file) { return file.starts_with("glTF"); }

/// Views into `file`.
inline GlbChunks read_glb(std::string_view file, const std::string& name) {
  const auto fail = [&](std::size_t at, const std::string& found, const std::string& expected) {
    throw Error({.file = name, .place = "byte " + std::to_string(at), .found = found, .expected = expected});
  };
  if (file.size() < 20) fail(file.size(), "the end", "a GLB header and a chunk: 20 bytes at least");
  if (little_u32(file, 0) != glb_magic) fail(0, "another magic", "glTF");
  if (const std::uint32_t version = little_u32(file, 4); version != 2)
    fail(4, "version " + std::to_string(version), "glTF 2");
  const std::size_t length = little_u32(file, 8);
  if (length > file.size() || length < 20)
    fail(8, "a length of " + std::to_string(length) + " bytes", std::to_string(file.size()) + ", the file's");
  GlbChunks chunks;
  for (std::size_t at = 12; at < length;) {
    if (length - at < 8) fail(at, std::to_string(length - at) + " bytes", "a chunk's header of 8");
    const std::size_t size = little_u32(file, at);
    const std::uint32_t type = little_u32(file, at + 4);
    if (size > length - at - 8)
      fail(at, "a chunk of " + std::to_string(size) + " bytes", "at most " + std::to_string(length - at - 8));
    const std::string_view content = file.substr(at + 8, size);
    if ((at == 12) != (type == glb_json))
      fail(at + 4, at == 12 ? "another chunk" : "JSON again", "one chunk JSON, first");
    if (at == 12) chunks.json = content;
    if (type == glb_data && !chunks.bytes) chunks.bytes = content;
    at += 8 + size;
  }
  return chunks;
}

/// A GLB file. `bytes` may be empty: then it has no chunk.
/// Errors    npt::Error for 4 GiB and more, which the format can't say
inline std::string format_glb(std::string json, std::string_view bytes, const std::string& name) {
  while (json.size() % 4 != 0) json += ' ';
  const std::size_t padding = (4 - bytes.size() % 4) % 4;
  const std::uint64_t size = 20 + std::uint64_t{json.size()} + (bytes.empty() ? 0 : 8 + bytes.size() + padding);
  if (size > 0xFFFFFFFFU)
    throw Error({.file = name, .found = std::to_string(size) + " bytes", .expected = "less than 4 GiB, for GLB"});
  std::string out;
  out.reserve(static_cast<std::size_t>(size));
  for (const std::uint32_t word :
       {glb_magic, 2U, static_cast<std::uint32_t>(size), static_cast<std::uint32_t>(json.size()), glb_json})
    append_little_u32(out, word);
  out += json;
  if (bytes.empty()) return out;
  append_little_u32(out, static_cast<std::uint32_t>(bytes.size() + padding));
  append_little_u32(out, glb_data);
  out += bytes;
  out.append(padding, '\0');
  return out;
}

}  // namespace npt::inline NPT_ABI::internal
