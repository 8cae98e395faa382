/// A sculpted half as the text of <npt/body/mannequin/surface_data.hpp>, whose reader is <npt/body/mannequin/surface.hpp>.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/surface.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace sculpt {

/// Appends `number` in `width` digits as numbers_of() reads them.
inline void append_number(std::string& text, std::uint32_t number, std::size_t width) {
  constexpr std::string_view digits = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz+-";
  for (std::size_t i = width; i > 0; --i) text += digits[number >> 6 * (i - 1) & 63U];
}

/// The definition of a string, in lines that clang-format leaves as they are.
inline std::string definition(const std::string& name, const std::string& digits) {
  std::string text = "inline constexpr char " + name + "[] =";
  constexpr std::size_t width = 108;  // whole vertices, whole triangles
  for (std::size_t i = 0; i < digits.size(); i += width) text.append("\n    \"").append(digits, i, width).append("\"");
  return text.append(";\n");
}

inline std::string header_text(const npt::anatomy::TriangleSheet& half) {
  std::string positions, triangles;
  const auto append = [&positions](double x) {
    append_number(positions, static_cast<std::uint32_t>(x / npt::anatomy::grid_step + 0x1p23), 4);
  };
  for (const npt::Vec3d p : half.positions) append(p.x), append(p.y), append(p.z);
  for (const auto& triangle : half.triangles)
    for (const std::uint32_t corner : triangle) append_number(triangles, corner, 2);
  return "/// The left half of the mannequin's surface in digits that surface.hpp reads. Written by examples/sculpt "
         "(target\n"
         "/// npt_sculpt), which also checks it as a test: change examples/sculpt, not this.\n"
         "#pragma once\n\n"
         "#include <npt/config.hpp>\n\n"
         "namespace npt::inline NPT_ABI::anatomy {\n\n"
         "/// [" +
         std::to_string(half.positions.size()) +
         ", 3] coordinates, four digits each: steps of 2^-20 metres, plus 2^23.\n" +
         definition("half_positions", positions) + "\n/// [" + std::to_string(half.triangles.size()) +
         ", 3] vertices, two digits each.\n" + definition("half_triangles", triangles) +
         "\n}  // namespace npt::inline NPT_ABI::anatomy\n";
}

}  // namespace sculpt
