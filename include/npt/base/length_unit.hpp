/// The units of length that meshes and motions come in.
#pragma once

#include <npt/config.hpp>

#include <array>
#include <cstddef>
#include <string>

namespace npt::inline NPT_ABI {

struct LengthUnit {
  const char* one;   ///< "metre"
  const char* many;  ///< "metres"
  double metres;     ///< in one of them
};

/// The metric ones first, the longest of them foremost.
inline constexpr std::array<LengthUnit, 5> length_units{{{"metre", "metres", 1},
                                                         {"centimetre", "centimetres", 0.01},
                                                         {"millimetre", "millimetres", 0.001},
                                                         {"inch", "inches", 0.0254},
                                                         {"foot", "feet", 0.3048}}};
inline constexpr std::size_t metric_unit_count = 3;

/// So many metres in words: "centimetres".
NPT_INLINE std::string unit_name(double metres) {
  for (const LengthUnit& unit : length_units)
    if (metres == unit.metres) return unit.many;
  return "units of " + std::to_string(metres) + " metres";
}

}  // namespace npt::inline NPT_ABI
