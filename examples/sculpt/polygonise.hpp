/// Triangles of the half x >= 0 of an implicit figure: marching tetrahedra by continuation from a point on the surface.
/// The result is one connected sheet, outward, whose only border lies in the plane x = 0.
/// Sources   continuation: Bloomenthal, "An implicit surface polygonizer", Graphics Gems IV, 1994; the cube is cut into
///           the six tetrahedra around its main diagonal (Kuhn), which agree on the faces of neighbouring cubes
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/body/mannequin/surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

namespace sculpt {

using npt::Vec3d;
using npt::anatomy::TriangleSheet;

/// Maps grid coordinates (in cells) to space and back: finer cells where a figure is finer.
struct GridWarp {
  double cell;                ///< width of a cell where `scale` is 1
  double start, end;          ///< grid x, in metres, between which cells shrink ...
  double scale;               ///< ... to this fraction
  double centre_y, centre_z;  ///< towards this axis

  Vec3d operator()(std::array<int, 3> node) const {
    const double x = node[0] * cell, t = std::clamp((x - start) / (end - start), 0.0, 1.0);
    // The integral of 1 - (1 - scale) * t, where t rises from 0 to 1 between start and end.
    const double beyond = std::max(x - end, 0.0);
    const double along = x - (1.0 - scale) * (0.5 * t * t * (end - start) + beyond);
    const double s = 1.0 - (1.0 - scale) * t;
    return {along, centre_y + (node[1] * cell - centre_y) * s, centre_z + (node[2] * cell - centre_z) * s};
  }
};

/// `Figure` gives f(p) as a double.
template <class Figure>
class Polygoniser {
 public:
  Polygoniser(const Figure& figure, const GridWarp& warp) : figure_(figure), warp_(warp) {}

  /// `seed` is a cell that the surface passes through.
  TriangleSheet operator()(std::array<int, 3> seed) {
    std::vector<std::array<int, 3>> open{seed};
    seen_.insert(key(seed));
    while (!open.empty()) {
      const std::array<int, 3> cell = open.back();
      open.pop_back();
      if (!march(cell)) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        for (const int step : {-1, 1}) {
          std::array<int, 3> next = cell;
          next[k] += step;
          if (next[0] >= 0 && seen_.insert(key(next)).second) open.push_back(next);
        }
      }
    }
    return std::move(sheet_);
  }

 private:
  static std::uint64_t key(std::array<int, 3> n) {
    std::uint64_t result = 0;
    for (const int c : n) result = result << 21 | static_cast<std::uint64_t>(c + (1 << 20));
    return result;
  }

  double value(std::array<int, 3> node) {
    const auto [at, fresh] = values_.try_emplace(key(node), 0.0);
    if (fresh) at->second = figure_(warp_(node));
    return at->second;
  }

  /// Adds the cell's triangles. False if the surface misses it.
  bool march(std::array<int, 3> cell) {
    std::array<std::array<int, 3>, 8> node{};
    std::array<double, 8> f{};
    int inside = 0;
    for (std::size_t c = 0; c < 8; ++c) {
      node[c] = {cell[0] + static_cast<int>(c & 1), cell[1] + static_cast<int>(c >> 1 & 1),
                 cell[2] + static_cast<int>(c >> 2)};
      f[c] = value(node[c]);
      inside += f[c] < 0.0;
    }
    if (inside == 0 || inside == 8) return false;
    // Corners of the six tetrahedra: paths from corner 0 to corner 7 along the axes. Even permutations turn left.
    constexpr std::array<std::array<std::size_t, 4>, 6> tetrahedra{
        {{0, 1, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 3, 2, 7}, {0, 6, 4, 7}, {0, 5, 1, 7}}};
    for (const auto& t : tetrahedra) cut(t, node, f);
    return true;
  }

  void cut(const std::array<std::size_t, 4>& t, const std::array<std::array<int, 3>, 8>& node,
           const std::array<double, 8>& f) {
    // In order: the inside corners, then the outside ones, by an even permutation, so that orientation is kept.
    std::array<std::size_t, 4> in{}, out{};
    std::size_t ins = 0, outs = 0;
    for (std::size_t i = 0; i < 4; ++i) (f[t[i]] < 0.0 ? in[ins++] : out[outs++]) = i;
    if (ins == 0 || ins == 4) return;
    std::array<std::size_t, 4> order{};
    std::copy_n(in.begin(), ins, order.begin());
    std::copy_n(out.begin(), outs, order.begin() + static_cast<std::ptrdiff_t>(ins));
    // Exchange two corners of the same side.
    if (odd(order)) ins == 3 ? std::swap(order[0], order[1]) : std::swap(order[2], order[3]);
    const auto at = [&](std::size_t a, std::size_t b) { return vertex(node[t[order[a]]], node[t[order[b]]]); };
    // Braces fix the order in which the vertices are made; the arguments of a call have none.
    if (ins == 1) sheet_.triangles.push_back({at(0, 1), at(0, 2), at(0, 3)});
    if (ins == 3) sheet_.triangles.push_back({at(0, 3), at(1, 3), at(2, 3)});
    if (ins == 2) {
      const std::uint32_t a = at(0, 2), b = at(0, 3), c = at(1, 3), d = at(1, 2);
      sheet_.triangles.push_back({a, b, c});
      sheet_.triangles.push_back({a, c, d});
    }
  }

  static bool odd(const std::array<std::size_t, 4>& order) {
    int inversions = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = i + 1; j < 4; ++j) inversions += order[i] > order[j];
    }
    return inversions % 2 == 1;
  }

  /// The surface point on a grid edge, kept off its ends so that no triangle degenerates.
  std::uint32_t vertex(std::array<int, 3> a, std::array<int, 3> b) {
    if (key(b) < key(a)) std::swap(a, b);
    // Edges run along seven directions with steps of 0 or 1: the sum of both ends names the edge.
    const std::array<int, 3> sum{a[0] + b[0], a[1] + b[1], a[2] + b[2]};
    const auto [at, fresh] = edges_.try_emplace(key(sum), static_cast<std::uint32_t>(sheet_.positions.size()));
    if (fresh) {
      const double fa = value(a), fb = value(b), t = std::clamp(fa / (fa - fb), 0.05, 0.95);
      const Vec3d p = warp_(a), q = warp_(b);
      sheet_.positions.push_back(p + (q - p) * t);
    }
    return at->second;
  }

  const Figure& figure_;
  GridWarp warp_;
  TriangleSheet sheet_;
  std::unordered_map<std::uint64_t, double> values_;
  std::unordered_set<std::uint64_t> seen_;
  std::unordered_map<std::uint64_t, std::uint32_t> edges_;
};

}  // namespace sculpt
