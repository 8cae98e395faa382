/// The left half of the four-legged template's surface, sculpted: polygons of its figure, remeshed.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <sculpt/polygonise.hpp>
#include <sculpt/quadruped/anatomy.hpp>
#include <sculpt/remesh.hpp>
#include <sculpt/sculpture.hpp>
#include <span>

namespace sculpt::quadruped {

inline constexpr std::size_t vertex_count = 5600;

inline constexpr double coarse_edge_length = 0.0290;
inline constexpr FineRegion fine_regions[] = {
    {{0.000, 0.850, 0.700}, {0.140, 0.220, 0.280}, 0.0150},   // head
    {{0.000, 0.800, 0.840}, {0.080, 0.100, 0.110}, 0.0105},   // muzzle
    {{0.054, 0.883, 0.705}, {0.050, 0.050, 0.055}, 0.0075},   // eye
    {{0.070, 1.000, 0.590}, {0.100, 0.140, 0.120}, 0.0068},   // ear
    {{0.000, 0.510, -0.590}, {0.080, 0.330, 0.260}, 0.0125},  // tail
    {{0.100, 0.030, 0.240}, {0.090, 0.100, 0.120}, 0.0110},   // forefoot
    {{0.100, 0.030, -0.345}, {0.090, 0.100, 0.120}, 0.0110},  // hindfoot
    {{0.100, 0.200, 0.215}, {0.110, 0.290, 0.150}, 0.0170},   // foreleg
    {{0.100, 0.200, -0.390}, {0.110, 0.290, 0.200}, 0.0170},  // hindleg
    {{0.105, 0.420, -0.220}, {0.130, 0.150, 0.150}, 0.0210},  // knee
    {{0.107, 0.430, 0.200}, {0.130, 0.150, 0.150}, 0.0210},   // elbow
};

inline double edge_length(Vec3d p) { return edge_length_in(fine_regions, coarse_edge_length, p); }

inline TriangleSheet half() {
  const Figure shape = figure();
  // Cells of 11 mm everywhere: half an ear's thickness. From 7 mm the border of the half came out uneven, with edges of
  // 0.7 mm to 57 mm instead of 2.8 mm to 45 mm.
  const GridWarp warp{0.011, 10, 11, 1, 0, 0};
  std::array<int, 3> seed{0, 54, 0};
  while (shape(warp({0, seed[1], seed[2] + 1})) < 0.0) ++seed[2];
  const TriangleSheet sheet = Polygoniser(shape, warp)(seed);
  return Remesher(shape, edge_length, vertex_count, sheet)();
}

}  // namespace sculpt::quadruped
