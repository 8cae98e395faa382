/// The mannequin's skin: one closed surface of 6890 vertices and 13776 triangles around its anatomy, symmetric in x.
/// Its left half is data (surface_data.hpp), which examples/sculpt makes from the anatomy: half a second of work, 7 s
/// in a build without optimisation, that no program that starts has to do.
#pragma once

#include <npt/base/digits.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/surface_data.hpp>
#include <npt/config.hpp>
#include <npt/mesh/triangles.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace npt::inline NPT_ABI::anatomy {

/// Positions and shape directions are multiples of this, about a micrometre: every compiler then makes the same bits.
inline constexpr double grid_step = 0x1p-20;

NPT_INLINE Vec3d rounded(Vec3d p) {
  const auto r = [](double x) { return std::floor(x / grid_step + 0.5) * grid_step; };
  return {r(p.x), r(p.y), r(p.z)};
}

/// A piece of a surface. Triangles face outwards.
struct TriangleSheet {
  std::vector<Vec3d> positions;
  std::vector<Triangle> triangles;
};

using digits::numbers_of;

/// The half at x >= 0 as surface_data.hpp holds it.
NPT_INLINE TriangleSheet left_half() {
  const std::vector<std::uint32_t> steps = numbers_of(half_positions, 4), corners = numbers_of(half_triangles, 2);
  TriangleSheet sheet;
  const auto coordinate = [&steps](std::size_t i) { return (static_cast<double>(steps[i]) - 0x1p23) * grid_step; };
  for (std::size_t i = 0; i < steps.size(); i += 3)
    sheet.positions.push_back({coordinate(i), coordinate(i + 1), coordinate(i + 2)});
  for (std::size_t i = 0; i < corners.size(); i += 3)
    sheet.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
  return sheet;
}

struct Surface {
  std::vector<Vec3d> positions;       ///< [V] those with x = 0, those with x > 0, their mirror images
  std::vector<Triangle> triangles;    ///< outward
  std::vector<std::uint32_t> mirror;  ///< [V] the vertex at (-x, y, z)
};

/// A whole surface from its half at x >= 0.
NPT_INLINE Surface mirrored(const TriangleSheet& half) {
  Surface s;
  const auto n = static_cast<std::uint32_t>(half.positions.size());
  std::vector<std::uint32_t> name(n), twin(n);
  for (const bool border : {true, false}) {
    for (std::uint32_t v = 0; v < n; ++v) {
      if ((half.positions[v].x == 0.0) != border) continue;
      name[v] = twin[v] = static_cast<std::uint32_t>(s.positions.size());
      s.positions.push_back(half.positions[v]);
    }
  }
  for (std::uint32_t v = 0; v < n; ++v) s.mirror.push_back(v);
  for (std::uint32_t v = 0; v < n; ++v) {
    const Vec3d p = half.positions[v];
    if (p.x == 0.0) continue;
    twin[v] = static_cast<std::uint32_t>(s.positions.size());
    s.positions.push_back({-p.x, p.y, p.z});
    s.mirror[name[v]] = twin[v];
    s.mirror.push_back(name[v]);
  }
  for (const auto& t : half.triangles) s.triangles.push_back({name[t[0]], name[t[1]], name[t[2]]});
  for (const auto& t : half.triangles) s.triangles.push_back({twin[t[0]], twin[t[2]], twin[t[1]]});
  return s;
}

NPT_INLINE Surface mannequin_surface() { return mirrored(left_half()); }

}  // namespace npt::inline NPT_ABI::anatomy
