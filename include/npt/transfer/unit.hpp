/// The unit of a mesh's coordinates. Weights that were trained on people in metres, and meshes only centred, give
/// nonsense for a figure 172 units tall: the unit is inferred from the extent, or the mesh is refused.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/length_unit.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/points.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <span>
#include <string>

namespace npt::inline NPT_ABI {

/// Extents of people, in metres: a child that crouches, arms stretched overhead.
inline constexpr double least_extent = 0.4, largest_extent = 4;

/// The longest side of the bounding box of `xyz` [V, 3], 0 without points. Coordinates that are NaN are left out.
inline double extent_of(std::span<const float> xyz) { return std::max(0.0, bounding_box(xyz).longest_side()); }

/// Metres in one unit of a person's mesh: 1, 0.01 or 0.001, whichever makes its extent a person's.
/// Errors    npt::Error where none does
NPT_INLINE double unit_of(const MeshView& person) {
  const double extent = extent_of(person.xyz);
  for (const LengthUnit& unit : std::span(length_units).first(metric_unit_count))
    if (extent * unit.metres >= least_extent && extent * unit.metres <= largest_extent) return unit.metres;
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", extent);
  throw Error({.file = std::string(person.name),
               .found = std::string("a mesh ") + text.data() + " units across",
               .expected = "a person, 0.4 to 4 metres across, in metres, centimetres or millimetres",
               .code = ErrorCode::unknown_unit,
               .remedy = Remedy::give_unit});
}

}  // namespace npt::inline NPT_ABI
