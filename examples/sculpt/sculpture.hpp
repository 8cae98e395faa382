/// The left half of the mannequin's surface, sculpted: polygons of its figure, remeshed.
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <sculpt/figure.hpp>
#include <sculpt/polygonise.hpp>
#include <sculpt/remesh.hpp>
#include <span>

namespace sculpt {

/// As many vertices as SMPL, so that both kinds of bodies can meet in one data set.
inline constexpr std::size_t mannequin_vertex_count = 6890;

/// Places that need finer triangles: around `centre`, within `radius`, edges shrink to `length`.
struct FineRegion {
  Vec3d centre, radius;
  double length;
};

inline constexpr double coarse_edge_length = 0.0225;
inline constexpr FineRegion fine_regions[] = {
    {{0.000, 1.595, 0.110}, {0.065, 0.085, 0.090}, 0.0052},   // nose, mouth, eyes
    {{0.000, 1.600, 0.100}, {0.095, 0.120, 0.120}, 0.0080},   // face
    {{0.080, 1.628, -0.008}, {0.030, 0.050, 0.040}, 0.0065},  // ear
    {{0.000, 1.640, 0.000}, {0.150, 0.200, 0.180}, 0.0160},   // head and neck
    {{0.850, 1.400, 0.000}, {0.110, 0.120, 0.160}, 0.0070},   // fingers
    {{0.790, 1.400, 0.010}, {0.120, 0.120, 0.160}, 0.0085},   // hand
    {{0.680, 1.405, 0.000}, {0.160, 0.120, 0.120}, 0.0140},   // wrist
    {{0.455, 1.405, 0.000}, {0.160, 0.120, 0.120}, 0.0150},   // elbow
    {{0.180, 1.380, 0.000}, {0.160, 0.180, 0.180}, 0.0180},   // shoulder
    {{0.106, 0.487, 0.000}, {0.140, 0.160, 0.140}, 0.0165},   // knee
    {{0.110, 0.140, 0.000}, {0.140, 0.180, 0.140}, 0.0140},   // ankle
    {{0.060, 0.860, 0.000}, {0.180, 0.160, 0.200}, 0.0180},   // hip
    {{0.120, 0.030, 0.070}, {0.120, 0.120, 0.190}, 0.0110},   // foot
    {{0.000, 1.052, 0.104}, {0.060, 0.060, 0.050}, 0.0080},   // navel
};

/// The wanted length of edges at p: that of the finest region there, `coarse` outside of all.
inline double edge_length_in(std::span<const FineRegion> regions, double coarse, Vec3d p) {
  double result = coarse;
  for (const FineRegion& r : regions) {
    const Vec3d d{(p.x - r.centre.x) / r.radius.x, (p.y - r.centre.y) / r.radius.y, (p.z - r.centre.z) / r.radius.z};
    // From the full effect in the inner half to none at the rim.
    const double t = std::clamp(2.0 * (1.0 - std::sqrt(dot(d, d))), 0.0, 1.0);
    result = std::min(result, coarse + (r.length - coarse) * t * t * (3.0 - 2.0 * t));
  }
  return result;
}

inline double mannequin_edge_length(Vec3d p) { return edge_length_in(fine_regions, coarse_edge_length, p); }

inline TriangleSheet mannequin_half() {
  const Figure figure = mannequin_figure();
  // Cells of 12.5 mm, 2.3 mm at the fingers: narrower than the gaps between them.
  const GridWarp warp{0.0125, 0.65, 0.90, 0.18, 1.405, 0.0};
  std::array<int, 3> seed{0, 88, 0};
  while (figure(warp({0, seed[1], seed[2] + 1})) < 0.0) ++seed[2];
  const TriangleSheet sheet = Polygoniser(figure, warp)(seed);
  return Remesher(figure, mannequin_edge_length, mannequin_vertex_count, sheet)();
}

}  // namespace sculpt
