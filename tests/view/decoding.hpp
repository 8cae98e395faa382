/// What page.js does with the numbers of a page, in C++.
#pragma once

#include <view/encoding.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace decoding {

inline std::uint64_t joined(std::string_view bytes, std::size_t count, int planes, std::size_t i) {
  std::uint64_t value = 0;
  for (int p = planes - 1; p >= 0; --p)
    value = value << 8U | static_cast<unsigned char>(bytes[static_cast<std::size_t>(p) * count + i]);
  return value;
}
inline std::int64_t unfolded(std::uint64_t v) {
  return v % 2 == 0 ? static_cast<std::int64_t>(v / 2) : -static_cast<std::int64_t>((v + 1) / 2);
}

inline std::vector<std::uint32_t> indices(std::string_view bytes, std::size_t count, int planes) {
  std::vector<std::uint32_t> result;
  std::int64_t last = 0;
  for (std::size_t i = 0; i < count; ++i)
    result.push_back(static_cast<std::uint32_t>(last += unfolded(joined(bytes, count, planes, i))));
  return result;
}

inline std::vector<std::vector<npt::Vec3f>> positions(std::string_view bytes, std::size_t vertices, std::size_t frames,
                                                      const view::Box& box) {
  const std::size_t count = 3 * vertices;
  std::vector<std::vector<npt::Vec3f>> result;
  std::vector<std::uint16_t> last, now(count);
  for (std::size_t f = 0; f < frames; ++f) {
    const std::string_view part = bytes.substr(2 * count * f, 2 * count);
    for (std::size_t i = 0; i < count; ++i) {
      const int before = f > 0 ? last[i] : i >= 3 ? now[i - 3] : 0;
      now[i] = static_cast<std::uint16_t>(before + unfolded(joined(part, count, 2, i)));
    }
    last = now;
    std::vector<npt::Vec3f>& points = result.emplace_back(vertices);
    const npt::Vec3f step = (box.high - box.low) * (1.0F / 65535);
    for (std::size_t v = 0; v < vertices; ++v)
      points[v] = {box.low.x + step.x * static_cast<float>(now[3 * v]),
                   box.low.y + step.y * static_cast<float>(now[3 * v + 1]),
                   box.low.z + step.z * static_cast<float>(now[3 * v + 2])};
  }
  return result;
}

inline std::vector<std::vector<double>> values(std::string_view bytes, std::size_t count, std::size_t frames,
                                               double high) {
  std::vector<std::vector<double>> result;
  for (std::size_t f = 0; f < frames; ++f) {
    result.emplace_back();
    for (std::size_t i = 0; i < count; ++i)
      result.back().push_back(static_cast<double>(joined(bytes.substr(2 * count * f, 2 * count), count, 2, i)) * high /
                              65535);
  }
  return result;
}

inline std::string from_base64(std::string_view text) {
  constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6U | static_cast<std::uint32_t>(letters.find(c));
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes += static_cast<char>(static_cast<unsigned char>(bits >> static_cast<unsigned>(count) & 0xFFU));
    }
  }
  return bytes;
}

}  // namespace decoding
