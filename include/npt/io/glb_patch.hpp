/// A GLB with other JSON and more bytes behind those of its chunk; further chunks, and what stands behind the last, stay.
/// Errors    npt::Error as read_glb's, and for 4 GiB and more
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/glb.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace npt::inline NPT_ABI::internal {

/// Where in the chunk of bytes more of them would begin.
constexpr std::size_t glb_end(std::size_t chunk) { return (chunk + 3) / 4 * 4; }

/// `file`: one that read_glb reads. `added` may be empty: then the chunk stays as it is.
inline std::string patched_glb(std::string_view file, std::string json, std::string_view added,
                               const std::string& name) {
  while (json.size() % 4 != 0) json += ' ';
  const bool has_bytes = read_glb(file, name).bytes.has_value();
  const std::size_t length = little_u32(file, 8);
  std::string chunks;
  chunks.reserve(file.size() + added.size() + json.size());
  const auto put = [&](std::uint32_t type, std::string_view content, std::string_view more) {
    const std::size_t padding = more.empty() ? 0 : glb_end(content.size()) - content.size();
    const std::size_t tail = (4 - more.size() % 4) % 4, size = content.size() + padding + more.size() + tail;
    if (size > 0xFFFFFFFFU) throw Error({.file = name, .found = "4 GiB", .expected = "less, for GLB"});
    append_little_u32(chunks, static_cast<std::uint32_t>(size));
    append_little_u32(chunks, type);
    chunks.append(content).append(padding, '\0').append(more).append(tail, '\0');
  };
  bool done = false;
  for (std::size_t at = 12; at < length;) {
    const std::size_t size = little_u32(file, at);
    const std::uint32_t type = little_u32(file, at + 4);
    const bool own = type == glb_data && !done;
    put(type, at == 12 ? std::string_view(json) : file.substr(at + 8, size), own ? added : std::string_view());
    if (at == 12 && !has_bytes && !added.empty()) put(glb_data, {}, added);
    done = done || own;
    at += 8 + size;
  }
  const std::uint64_t whole = 12 + std::uint64_t{chunks.size()};
  if (whole > 0xFFFFFFFFU)
    throw Error({.file = name, .found = std::to_string(whole) + " bytes", .expected = "less than 4 GiB, for GLB"});
  std::string out(file.substr(0, 8));
  append_little_u32(out, static_cast<std::uint32_t>(whole));
  out += chunks;
  return out += file.substr(length);
}

}  // namespace npt::inline NPT_ABI::internal
