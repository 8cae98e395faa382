/// Where glTF keeps bytes outside of a GLB: data URIs, and files beside the document. A name that leaves the document's
/// folder is refused: a file from elsewhere must not make a program read what its user didn't mean to share.
/// Errors    npt::Error that names the document and the place of the URI
/// Source    RFC 2397 (data URIs), RFC 3986 (percent-encoding), RFC 4648 (base64)
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/file.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace npt::inline NPT_ABI::internal {

/// Nothing for other characters or a length that can't be. Padding may be missing.
inline std::optional<std::string> from_base64(std::string_view text) {
  while (text.ends_with('=')) text.remove_suffix(1);
  if (text.size() % 4 == 1) return std::nullopt;
  static constexpr auto table = [] {
    std::array<unsigned char, 256> values{};
    values.fill(255);
    const std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < letters.size(); ++i)
      values[static_cast<unsigned char>(letters[i])] = static_cast<unsigned char>(i);
    return values;
  }();
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const unsigned char value = table[static_cast<unsigned char>(c)];
    if (value == 255) return std::nullopt;
    bits = bits << 6 | value;
    if ((count += 6) < 8) continue;
    count -= 8;
    bytes += static_cast<char>(static_cast<unsigned char>(bits >> count & 255U));
  }
  return bytes;
}

inline std::string to_base64(std::string_view bytes) {
  constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::string_view part = bytes.substr(i, 3);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < part.size() ? static_cast<unsigned char>(part[k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= part.size() ? letters[bits >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

/// "%20" to a blank. Nothing for a '%' without two hexadecimal digits behind it.
inline std::optional<std::string> percent_decoded(std::string_view text) {
  std::string result;
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    const char lower = static_cast<char>(c | 0x20);
    return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      result += text[i];
      continue;
    }
    const int high = i + 2 < text.size() ? digit(text[i + 1]) : -1, low = i + 2 < text.size() ? digit(text[i + 2]) : -1;
    if (high < 0 || low < 0) return std::nullopt;
    result += static_cast<char>(static_cast<unsigned char>(high * 16 + low));
    i += 2;
  }
  return result;
}

struct UriBytes {
  std::string bytes, mime_type;
};

/// What a URI leads to. `folder`: the document's; nothing: files can't be read, the document came from memory.
inline UriBytes read_uri(std::string_view uri, const std::optional<std::filesystem::path>& folder,
                         const std::string& file, const std::string& place) {
  const auto fail = [&](const std::string& found, const std::string& expected) {
    throw Error({.file = file, .place = place, .found = found, .expected = expected});
  };
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string_view::npos) fail("a data URI without ','", "data:TYPE;base64,BYTES");
    std::string_view type = uri.substr(5, comma - 5);
    const bool base64 = type.ends_with(";base64");
    if (base64) type.remove_suffix(7);
    const std::string_view content = uri.substr(comma + 1);
    std::optional<std::string> bytes = base64 ? from_base64(content) : percent_decoded(content);
    if (!bytes) fail("a data URI that can't be decoded", base64 ? "base64" : "percent-encoded bytes");
    return {std::move(*bytes), std::string(type.substr(0, type.find(';')))};
  }
  const std::optional<std::string> name = percent_decoded(uri);
  const std::string shown = "the URI '" + std::string(uri.substr(0, 200)) + "'";
  if (!name || name->empty() || name->find('\0') != std::string::npos) fail(shown, "a file's name or a data URI");
  if (!folder) fail(shown, "a data URI: this document came without a folder");
  // Also "http:", "file:" and a Windows drive, which a colon tells.
  const std::filesystem::path path(*name);
  if (path.is_absolute() || name->find_first_of(":\\") != std::string::npos)
    fail(shown, "a file in the document's folder");
  std::error_code code;
  const std::filesystem::path home = std::filesystem::weakly_canonical(folder->empty() ? "." : *folder, code);
  const std::filesystem::path whole = std::filesystem::weakly_canonical(home / path, code);
  const std::filesystem::path inside = whole.lexically_relative(home);
  if (code || inside.empty() || *inside.begin() == "..") fail(shown, "a file in the document's folder");
  return {read_file(whole), {}};
}

}  // namespace npt::inline NPT_ABI::internal
