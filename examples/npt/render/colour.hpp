/// Colours: linear RGB for light, sRGB for files and names. Colours for numbers: data_colours.hpp.
#pragma once

#include <render/image.hpp>

#include <npt/base/error.hpp>
#include <npt/base/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace render {

/// Linear red, green, blue in x, y, z; 1 is white paper.
using Colour = npt::Vec3f;

/// IEC 61966-2-1, both ways.
inline float srgb_to_linear(float s) { return s <= 0.04045F ? s / 12.92F : std::pow((s + 0.055F) / 1.055F, 2.4F); }
inline float linear_to_srgb(float v) {
  return v <= 0.0031308F ? 12.92F * v : 1.055F * std::pow(v, 1.0F / 2.4F) - 0.055F;
}

/// lround would be a call for each pixel, and differs by the last bit of v at most.
inline std::uint8_t to_byte(float v) {
  const float shifted = std::clamp(v, 0.0F, 1.0F) * 255.0F + 0.5F;
  return static_cast<std::uint8_t>(shifted);
}

inline Colour from_srgb(float r, float g, float b) { return {srgb_to_linear(r), srgb_to_linear(g), srgb_to_linear(b)}; }
inline Colour from_hex(std::uint32_t rgb) {
  const auto channel = [rgb](int shift) { return static_cast<float>((rgb >> shift) & 0xFFU) / 255.0F; };
  return from_srgb(channel(16), channel(8), channel(0));
}
inline Pixel to_pixel(Colour c, float alpha = 1.0F) {
  return {to_byte(linear_to_srgb(std::clamp(c.x, 0.0F, 1.0F))), to_byte(linear_to_srgb(std::clamp(c.y, 0.0F, 1.0F))),
          to_byte(linear_to_srgb(std::clamp(c.z, 0.0F, 1.0F))), to_byte(alpha)};
}

inline Colour mix(Colour a, Colour b, float t) { return a + (b - a) * t; }
inline Colour multiply(Colour a, Colour b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline float luminance(Colour c) { return 0.2126F * c.x + 0.7152F * c.y + 0.0722F * c.z; }

/// Surface colours by name: bright enough to keep the shading readable in print.
inline constexpr std::array<std::pair<std::string_view, std::uint32_t>, 12> named_colours{{
    {"clay", 0xD3CCC3},
    {"blue", 0x9DB7D5},
    {"sand", 0xE3C9A0},
    {"green", 0xA9CBA4},
    {"coral", 0xE5A493},
    {"violet", 0xBDB0DA},
    {"white", 0xFFFFFF},
    {"light", 0xE9E9E9},
    {"grey", 0xBFBFBF},
    {"dark", 0x333639},
    {"black", 0x000000},
    {"red", 0xD9665B},
}};

/// A name of named_colours or "#rrggbb".
/// Errors    npt::Error that names `argument` and lists what is understood.
inline Colour parse_colour(const std::string& text, const std::string& argument) {
  for (const auto& [name, rgb] : named_colours)
    if (name == text) return from_hex(rgb);
  if (text.size() == 7 && text[0] == '#' && text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos)
    return from_hex(static_cast<std::uint32_t>(std::stoul(text.substr(1), nullptr, 16)));
  std::string names;
  for (const auto& entry : named_colours) names += std::string(entry.first) + ", ";
  throw npt::Error({argument, {}, "colour '" + text + "'", names + "or #rrggbb"});
}

}  // namespace render
