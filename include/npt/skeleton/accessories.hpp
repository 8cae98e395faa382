/// What a character wears that is small and a piece of its own: buckles, pouches, buttons, badges. A hand before the
/// belly is nearer to a buckle than the belly is, and where an arm was fitted wrongly even a pouch at the other hip
/// would go with it. What the mesh itself says is surer: such a piece goes with the larger piece that it lies on, where
/// both belong to distant places of the body.
/// Measured, a man with two pouches and a buckle whose right arm is fitted across his belly, PMD x 1e-4: MEASURED
/// Shapes    points: [P] of the mesh
/// Units     metres
/// Source    ours
#pragma once

#include <npt/config.hpp>
#include <npt/core/vec3.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/union_find.hpp>
#include <npt/surface/closest_point.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

namespace skeleton::internal {

/// A piece that belongs with what it lies on.
struct Accessory {
  /// A point of a larger piece.
  struct Contact {
    Triangle triangle;
    std::array<double, 3> weights;
  };
  std::vector<std::uint32_t> points;
  std::vector<Contact> contacts;  ///< at least one
};

/// Where on a body the points of a mesh were looked up.
struct LookUp {
  std::span<const Vec3d> places;              ///< [P] on the resting body
  std::span<const std::uint32_t> taken_from;  ///< [P] the point whose place a point goes by
  std::span<const double> distances;          ///< [P] from the posed body
  double off;                                 ///< distance from which on a point stands off it
};

class Accessories {
 public:
  Accessories(std::span<const Vec3d> points, std::span<const Triangle> triangles, const LookUp& body)
      : points_(points), triangles_(triangles), body_(body) {
    UnionFind pieces(points.size());
    for (const Triangle& t : triangles) pieces.unite(t[0], t[1]), pieces.unite(t[1], t[2]);
    piece_ = pieces.sets();
    sort_out();
  }

  /// Those that belong elsewhere than what they lie on, ascending by their first points.
  std::vector<Accessory> misplaced() const {
    std::vector<Accessory> result;
    if (small_.empty() || large_.empty()) return result;
    const TriangleTree surface(points_, large_);
    for (const std::vector<std::uint32_t>& piece : small_)
      if (std::vector<Accessory::Contact> contacts = broken_contacts(piece, surface); !contacts.empty())
        result.push_back({piece, std::move(contacts)});
    return result;
  }

 private:
  // Shares of the mesh's area. A hand has 0.02 to 0.03, one that is a piece of its own lies close to the body's and may
  // lean on a hip; a pouch of the man above has POUCH and is off the body.
  static constexpr double small = 0.01, largest = 0.04, least_off = 0.3;
  static constexpr double reach = 0.03, slack = 0.005;  ///< of contacts, and beyond the closest one
  static constexpr double apart = 0.1, stretch = 3;     ///< places farther apart than apart + stretch * distance

  void sort_out() {
    std::vector<double> area(points_.size()), standing(points_.size());
    double total = 0;
    for (const Triangle& t : triangles_) {
      const double own = 0.5 * length(cross(points_[t[1]] - points_[t[0]], points_[t[2]] - points_[t[0]]));
      area[piece_[t[0]]] += own, total += own;
      if (std::max({body_.distances[t[0]], body_.distances[t[1]], body_.distances[t[2]]}) > body_.off)
        standing[piece_[t[0]]] += own;
    }
    std::vector<std::uint32_t> number(points_.size(), no_index);
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
      const std::uint32_t first = piece_[p];
      if (!(area[first] > 0) || area[first] > largest * total ||
          (area[first] > small * total && standing[first] < least_off * area[first]))
        continue;
      if (number[first] == no_index) number[first] = static_cast<std::uint32_t>(small_.size()), small_.emplace_back();
      small_[number[first]].push_back(p);
    }
    if (small_.empty()) return;
    for (const Triangle& t : triangles_)
      if (number[piece_[t[0]]] == no_index) large_.push_back(t);
  }

  /// Where a piece comes closest to the surface, if it comes near and most of these places are far from its own.
  std::vector<Accessory::Contact> broken_contacts(const std::vector<std::uint32_t>& piece,
                                                  const TriangleTree& surface) const {
    std::vector<ClosestPoint> closest;
    closest.reserve(piece.size());
    double least = std::numeric_limits<double>::infinity();
    for (const std::uint32_t p : piece) {
      closest.push_back(surface.closest(points_[p]));
      least = std::min(least, closest.back().squared_distance);
    }
    std::vector<Accessory::Contact> contacts;
    if (!(least < reach * reach)) return contacts;
    const double most = std::sqrt(least) + slack;
    std::size_t broken = 0;
    for (std::size_t i = 0; i < piece.size(); ++i) {
      const ClosestPoint& c = closest[i];
      if (c.squared_distance > most * most) continue;
      const Triangle& t = large_[c.triangle];
      Vec3d place;
      for (std::size_t k = 0; k < 3; ++k) place += body_.places[t[k]] * c.weights[k];
      const std::uint32_t from = body_.taken_from[piece[i]];
      if (length(place - body_.places[from]) > apart + stretch * length(c.point - points_[from])) ++broken;
      contacts.push_back({t, c.weights});
    }
    if (2 * broken <= contacts.size()) contacts.clear();
    return contacts;
  }

  std::span<const Vec3d> points_;
  std::span<const Triangle> triangles_;
  LookUp body_;
  std::vector<std::uint32_t> piece_;  ///< [P] the first point of its piece
  std::vector<std::vector<std::uint32_t>> small_;
  std::vector<Triangle> large_;
};

}  // namespace skeleton::internal

}  // namespace npt::inline NPT_ABI
